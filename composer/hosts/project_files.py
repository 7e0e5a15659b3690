"""The files of a project that a system needs, and the wheels of its behaviours."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from composer.confidential import list_lineage
from composer.export.project import list_project_files
from composer.hosts.wheels import Wheel, build_wheel, read_folder
from composer.python_source.module_finder import MissingModule
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

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
        """Return where a file or folder is, seen from the root."""
        return path.relative_to(self.root).as_posix()


def collect_files(given: Sequence[Path], named: Iterable[Path], spec: SystemSpec) -> ProjectFiles:
    """Return the files of a system.

    Args:
        given: The file and its layers.
        named: What else it is read from, but for modules; what is installed is left out.
    """
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


def build_behaviours(
    context: CheckContext, part: Snapshot, files: ProjectFiles
) -> dict[Path, Wheel]:
    """Return a wheel of the behaviours of a part for each folder that it imports modules from.

    A wheel has whole packages, with their data, and of those only what the part imports.
    """
    tops: dict[Path, dict[str, Path]] = {}
    for name in filter(context.modules.is_of_project, part.code):
        found = context.modules.find(name)
        if isinstance(found, MissingModule) or found.path is None:
            continue
        words = name.split('.')
        depth = len(words) - (found.path.name != '__init__.py')
        folder = _absolute(found.path).parents[depth]
        top = folder / words[0]
        tops.setdefault(folder, {})[words[0]] = top if top.is_dir() else found.path
    return {
        folder: build_wheel(_wheel_name(files, folder), _read(found, folder))
        for folder, found in tops.items()
    }


def _read(found: Mapping[str, Path], folder: Path) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    for name, path in found.items():
        if path.is_dir():
            files |= {f'{name}/{inner}': data for inner, data in read_folder(path)}
        else:
            files[path.relative_to(folder).as_posix()] = path.read_bytes()
    return files


def _wheel_name(files: ProjectFiles, folder: Path) -> str:
    inside = files.place(folder) if folder.is_relative_to(files.root) else folder.name
    words = (inside if inside != '.' else files.root.name).replace('/', '_')
    safe = ''.join(each if each.isalnum() and each.isascii() else '_' for each in words)
    return f'behaviours_{safe.strip("_") or "project"}'.lower()


def _absolute(path: Path) -> Path:
    # Links stay as they are: files name each other by the paths that users see.
    return Path(os.path.abspath(path))  # noqa: PTH100
