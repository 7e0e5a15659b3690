"""The files of a project that a system needs, and the folder that all of them are in."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from composer.ament import ament_prefixes
from composer.confidential import list_lineage
from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.language.specs import SystemSpec

_COMPOSER = Path(__file__).parents[1]
# The root of the file system, and the folders right below it, belong to no project.
_FEWEST_PARTS = 3


def list_project_files(spec: SystemSpec, named: Iterable[Path]) -> list[Path]:
    """Return the files that a system needs, as absolute paths, but for those that are installed.

    What behaviours and processes open by themselves is not known.

    Args:
        named: The files that the system is read from, those that they name, and the modules of
            behaviours with what these import.
    """
    candidates = [*named, *_of_processes(spec)]
    files = dict.fromkeys(Path(os.path.abspath(each)) for each in candidates)  # noqa: PTH100 - links stay
    # Composer itself is there already.
    prefixes = [_COMPOSER, *(each.absolute() for each in ament_prefixes())]
    return [
        each
        for each in files
        if each.is_file() and not any(each.is_relative_to(prefix) for prefix in prefixes)
    ]


def check_not_installed(given: Iterable[Path]) -> None:
    """Check that no file of a command line is in an installed package.

    Raises:
        ComposerError: One is: containers and other hosts would lack it.
    """
    for path in map(Path.absolute, given):
        if any(path.is_relative_to(prefix.absolute()) for prefix in ament_prefixes()):
            message = f'{path} is a file of an installed package, which is not brought along'
            raise ComposerError(message, help='name the file in the source of the package instead')


def find_root(files: Iterable[Path]) -> Path:
    """Return the folder of the project that files are in: that of all of them, if there are more.

    Raises:
        ComposerError: They have none in common but one that belongs to no project.
    """
    roots = sorted({list_lineage(each.parent)[-1] for each in files})
    common = Path(os.path.commonpath(roots))
    if len(roots) > 1 and len(common.parts) < _FEWEST_PARTS:
        message = f'{roots[0]} and {roots[-1]} are in no folder that a container can be given'
        raise ComposerError(message, help='move the files of the system into one project')
    return common


def _of_processes(spec: SystemSpec) -> Iterator[Path]:
    for process in spec.processes.values():
        folder = Path(process.cwd or '')
        words = [*process.command, *process.arguments, *filter(None, [process.launch])]
        for word in words:
            try:
                path = folder / word
                if path.is_file():
                    yield path
            except (OSError, ValueError):
                continue  # too long, or no path at all
