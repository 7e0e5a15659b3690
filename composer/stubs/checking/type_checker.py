"""Run pyrefly, and read what it reports."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Mapping

# The version whose messages are read; pyproject.toml pins it.
TESTED_VERSION: Final = '1.4.1'
_TIMEOUT_SEC = 60
_OPTIONS = ('--config', 'pyrefly.toml', '--output-format', 'json', '--summary=none')
# The presets differ from version to version, so each kind that is read is named. Whatever is not
# in the stubs or the project is unknown: of libraries, nothing is reported.
_SETTINGS = """\
preset = "default"
search-path = ["modules", "stubs"]
site-package-path = []
skip-interpreter-query = true
disable-search-path-heuristics = true
check-unannotated-defs = true
infer-return-types = "checked"
python-version = "{version}"
project-includes = ["modules/**/*.py"]
project-excludes = []

[errors]
bad-argument-count = true
bad-argument-type = true
bad-return = true
bad-specialization = true
incompatible-comparison = true
missing-argument = true
missing-attribute = true
no-matching-overload = true
not-callable = true
not-iterable = true
unbound-name = true
unexpected-keyword = true
unsupported-operation = true
"""


class TypeCheckerError(ComposerError):
    """Pyrefly does not work."""


class TypeReport(NamedTuple):
    """What pyrefly says about a place of a module; lines and columns count from 1."""

    path: str
    line: int
    column: int
    end_line: int
    end_column: int
    kind: str
    message: str


def find_program() -> Path | None:
    """Return pyrefly: that beside Composer's own Python, or one on the `PATH`."""
    own = Path(sys.executable).parent / 'pyrefly'
    found = str(own) if own.exists() else shutil.which('pyrefly')
    return Path(found) if found else None


def version_of(program: Path) -> str:
    """Return the version of pyrefly.

    Raises:
        TypeCheckerError: Pyrefly does not work.
    """
    return _run(program, ['--version']).strip().removeprefix('pyrefly ')


def run_type_checker(
    program: Path, modules: Mapping[str, str], stubs: Mapping[str, str]
) -> list[TypeReport]:
    """Return what pyrefly reports of modules; texts are by their paths.

    Raises:
        TypeCheckerError: Pyrefly does not work.
    """
    files = {
        'pyrefly.toml': _SETTINGS.format(version='.'.join(map(str, sys.version_info[:2]))),
        **{f'modules/{path}': text for path, text in modules.items()},
        **{f'stubs/{path}': text for path, text in stubs.items()},
    }
    with tempfile.TemporaryDirectory(prefix='composer-types-') as name:
        folder = Path(os.path.realpath(name))
        for path, text in files.items():
            place = folder / path
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(text, encoding='utf-8', errors='replace')
        text = _run(
            program, ['check', *_OPTIONS, '--relative-to', str(folder / 'modules')], folder
        )
    try:
        reports = json.loads(text)['errors']
    except (ValueError, KeyError) as error:
        message = f'pyrefly does not work: it printed {text.strip()[-200:]!r}'
        raise TypeCheckerError(message) from error
    keys = ('path', 'line', 'column', 'stop_line', 'stop_column', 'name', 'description')
    return [TypeReport(*(report[key] for key in keys)) for report in reports]


def _run(program: Path, arguments: list[str], folder: Path | None = None) -> str:
    """Return what pyrefly prints; with errors in the modules, it exits with 1."""
    try:
        done = subprocess.run(  # noqa: S603 - a program of the installation
            [str(program), *arguments],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_SEC,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        message = f'pyrefly does not work: {error}'
        raise TypeCheckerError(message) from error
    if done.returncode not in (0, 1):
        said = (done.stderr or done.stdout).strip().rpartition('\n')[2]
        message = f'pyrefly does not work: {said[-200:]}'
        raise TypeCheckerError(message)
    return done.stdout
