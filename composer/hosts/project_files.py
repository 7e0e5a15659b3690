"""The files of a project that a system needs, and its behaviours."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from composer.confidential import list_lineage
from composer.export.project import check_not_installed, list_project_files
from composer.hosts.wheels import read_folder
from composer.python_source.module_finder import MissingModule
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from composer.checks.context import CheckContext
    from composer.language.specs import SystemSpec
    from composer.planning.snapshot import Snapshot

_PYPROJECT = 'pyproject.toml'


@record
class ProjectFiles:
    """The files of a system, with the folder that all of them are in.

    Attributes:
        root: This folder.
        folder: Where Composer runs: the current folder, or that of the first file.
        paths: The files, absolute.
        marks: The folders of projects, which behaviours are searched in.
    """

    root: Path
    folder: Path
    paths: tuple[Path, ...]
    marks: tuple[Path, ...]

    def place(self, path: Path) -> str:
        """Return where a file or folder is, seen from the root; others get places of their own."""
        if path.is_relative_to(self.root):
            return path.relative_to(self.root).as_posix()
        return f'.beside/{"/".join(path.parts[1:])}'


def collect_files(given: Sequence[Path], named: Iterable[Path], spec: SystemSpec) -> ProjectFiles:
    """Return the files of a system.

    Args:
        given: The file and its layers.
        named: What else it is read from, but for modules; what is installed is left out.

    Raises:
        ComposerError: A given file is in an installed package.
    """
    check_not_installed(given)
    installed = [Path(sys.prefix), Path(sys.base_prefix)]
    found = list_project_files(spec, [*given, *named])
    paths = [path for path in found if not any(map(path.is_relative_to, installed))]
    folders = dict.fromkeys(_absolute(path).parent for path in given)
    chains = dict.fromkeys(each for folder in folders for each in list_lineage(folder))
    marks = [each for each in chains if (each / _PYPROJECT).is_file()]
    paths += [mark / _PYPROJECT for mark in marks if mark / _PYPROJECT not in paths]
    here = Path.cwd()
    first = _absolute(given[0])
    folder = here if first.is_relative_to(here) else first.parent
    root = Path(os.path.commonpath([folder, *(path.parent for path in paths)]))
    return ProjectFiles(root, folder, tuple(paths), tuple(dict.fromkeys([folder, *marks])))


def read_behaviours(context: CheckContext, part: Snapshot) -> dict[Path, dict[str, bytes]]:
    """Return the behaviours of a part, by the folder that it imports their modules from.

    Packages are whole, with their data; only those that the part imports.
    """
    behaviours: dict[Path, dict[str, bytes]] = {}
    for name in filter(context.modules.is_of_project, part.code):
        module = context.modules.find(name)
        if isinstance(module, MissingModule) or module.path is None:
            continue
        words = name.split('.')
        depth = len(words) - (module.path.name != '__init__.py')
        folder = _absolute(module.path).parents[depth]
        top, read = folder / words[0], behaviours.setdefault(folder, {})
        if not top.is_dir():
            read[module.path.name] = module.path.read_bytes()
        elif not any(inner.startswith(f'{top.name}/') for inner in read):
            read |= {f'{top.name}/{inner}': data for inner, data in read_folder(top)}
    return behaviours


def _absolute(path: Path) -> Path:
    # Links stay as they are: files name each other by the paths that users see.
    return Path(os.path.abspath(path))  # noqa: PTH100
