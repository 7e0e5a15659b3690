"""Programs and their environment: where they are searched for, and why one cannot be run."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from composer.spelling import count_edits, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

# More edits than this are no typo.
_MOST_EDITS = 2
_shell: Mapping[str, str] | None = None


def shell_environment() -> Mapping[str, str]:
    """Return the variables that this process was started with, whatever a system sets.

    A system that runs is read again in the environment that it was read in before.
    """
    return os.environ if _shell is None else _shell


@contextmanager
def shell_environment_kept() -> Iterator[None]:
    """Keep the variables as they are now for `shell_environment`, until the block ends."""
    global _shell  # noqa: PLW0603 - as `os.environ` is one of the whole process
    before, _shell = _shell, dict(os.environ)
    try:
        yield
    finally:
        _shell = before


def base_environment(variables: Mapping[str, str]) -> dict[str, str]:
    """Return the environment that processes start from, with Composer's own Python activated.

    Args:
        variables: The environment of Composer.
    """
    # Python would buffer its output.
    environment = {'PYTHONUNBUFFERED': '1', **variables}
    if sys.prefix != sys.base_prefix:
        # The `python3` of the virtual environment can import rclpy as Composer can.
        folder = Path(sys.executable).parent
        environment['PATH'] = f'{folder}{os.pathsep}{environment.get("PATH", os.defpath)}'
    return environment


def is_on_path(program: str, search_path: str | None = None) -> bool:
    """Return whether a program is on a search path, by default on that of Composer."""
    # It takes long to import, and most systems have no processes.
    import shutil

    return shutil.which(program, path=search_path) is not None


def find_program_problem(
    program: str, folder: Path, environment: Mapping[str, str]
) -> tuple[str, str | None] | None:
    """Return why a program cannot be run, with help; `None` if it can.

    Args:
        program: A name on the `PATH`, or a path.
        folder: What a relative path starts from.
        environment: The environment of the process.
    """
    if '/' not in program:
        search_path = environment.get('PATH', os.defpath)
        if is_on_path(program, search_path):
            return None
        help_text = did_you_mean(_find_near(program, search_path))
        return f"there is no program '{program}' on the PATH", help_text
    path = folder / program
    if not os.path.isfile(path):
        return f"there is no program '{path}'", None
    if not os.access(path, os.X_OK):
        return f"'{path}' is not executable", f'chmod +x {path}'
    return None


def _find_near(program: str, search_path: str) -> str | None:
    near = [name for name in _programs(search_path) if _is_near(name, program)]
    return min(near, key=lambda name: (count_edits(name, program), name), default=None)


def _is_near(name: str, program: str) -> bool:
    most = min(_MOST_EDITS, len(program) // 3)
    if abs(len(name) - len(program)) > most:
        return False
    # Most of the thousands of programs need no closer look.
    is_alike = name[:1] == program[:1] or name[1:] == program[1:]
    return is_alike and count_edits(name, program) <= most


@lru_cache(maxsize=4)
def _programs(search_path: str) -> frozenset[str]:
    found: set[str] = set()
    for folder in search_path.split(os.pathsep):
        with suppress(OSError):
            found.update(os.listdir(folder or '.'))  # noqa: PTH208 - names alone are needed
    return frozenset(found)


def own_command() -> list[str]:
    """Return the command by which this process was started, without its arguments."""
    count = len(sys.argv) - 1
    options = sys.orig_argv[1 : len(sys.orig_argv) - count]
    return [sys.executable, *options]
