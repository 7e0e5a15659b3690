"""Find the modules of behaviours: in the project first, then in installed packages."""

from __future__ import annotations

import importlib.util
import os
import sys
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import TYPE_CHECKING

from composer.confidential import list_lineage
from composer.input_limits import MAX_TOKENS_OF_MODULES
from composer.python_source.modules import FunctionSource, ModuleSource, read_module
from composer.records import record
from composer.spelling import find_nearest

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable


@record
class MissingModule:
    """A module that does not exist.

    Attributes:
        missing: The part of its name that was not found, as in `behaviours.greter`.
        nearest: The module that may have been meant.
        hidden_by: The `__init__.py` without which Python would find it in another folder.
    """

    missing: str
    nearest: str | None
    hidden_by: Path | None = None


@record
class _Location:
    """Where a module is.

    Attributes:
        file: Its file; `None` for a package without one.
        missing: The part of its name that was not found; empty if all was.
        folders: Those in which this part was searched, or that the module's own modules are in.
    """

    file: Path | None
    missing: str
    folders: list[Path]


def project_search_path(configs: Iterable[Path]) -> list[Path]:
    """Return the folders to search for behaviours before the installed packages.

    These are the current folder, then the folder of each file and its parents up to the one with a
    `pyproject.toml` or `.git`, else `package.xml`; if there is none, only the folder of the file.
    """
    folders = dict.fromkeys(Path(os.path.realpath(config)).parent for config in configs)
    chains = (each for folder in folders for each in list_lineage(folder))
    return list(dict.fromkeys([Path.cwd(), *chains]))


class ModuleFinder:
    """Finds and reads modules, each once.

    Args:
        before: A finder whose modules are kept where their source is the same.
        interfaces: The interface packages that the project declares. A folder of this name has
            their definitions: Python finds the package that is built of these.
    """

    def __init__(
        self,
        search_path: list[Path],
        before: ModuleFinder | None = None,
        interfaces: Collection[str] = (),
    ) -> None:
        self._project = search_path
        self._interfaces = interfaces
        self._before = before.list_read(search_path) if before else {}
        installed = [Path(entry) for entry in sys.path if entry]
        self._roots = list(dict.fromkeys([*search_path, *installed]))
        self._found: dict[str, ModuleSource | MissingModule] = {}
        self._locate = cache(self._locate_anew)
        self._list_names = cache(_list_names)
        self._tokens_left = MAX_TOKENS_OF_MODULES
        # Python lists a folder once, until its time of change is another one.
        importlib.invalidate_caches()

    def find(self, name: str) -> ModuleSource | MissingModule:
        """Return the module `package.module`, or the part of its name that is missing."""
        if name not in self._found:
            missing, file = self.find_missing(name), self._locate(name).file
            if missing is not None or file is None:
                self._found[name] = missing or ModuleSource(None)
            else:
                module = read_module(file, self._tokens_left, self._before.get(file))
                self._tokens_left -= module.tokens
                self._found[name] = module
        return self._found[name]

    def find_function(self, module: str, function: str) -> FunctionSource | None:
        """Return a function of a module; `None` if it, or the module, does not exist."""
        found = self.find(module)
        return found.find_function(function) if isinstance(found, ModuleSource) else None

    def list_read(self, search_path: list[Path]) -> dict[Path, ModuleSource]:
        """Return the modules that were read, by their files, if they were searched here."""
        # They are named after the current folder, which is the first of these.
        if search_path != self._project:
            return {}
        modules = (each for each in self._found.values() if isinstance(each, ModuleSource))
        return {each.path: each for each in modules if each.path}

    def list_files(self) -> list[Path]:
        """Return the files of the modules of the project that were searched, found or not."""
        files: list[Path] = []
        for name, module in self._found.items():
            if isinstance(module, MissingModule):
                paths = [folder.joinpath(*name.split('.')) for folder in self._project]
                files += [*paths, *(each.with_name(f'{each.name}.py') for each in paths)]
            elif module.path and self.is_of_project(name):
                files.append(module.path)
        return files

    def has(self, name: str) -> bool:
        """Return whether there is a module or package of this name."""
        return not self._locate(name).missing

    def find_missing(self, name: str) -> MissingModule | None:
        """Return the part of a module's name that is missing, `None` if it is there."""
        located = self._locate(name)
        if not located.missing:
            return None
        *done, part = located.missing.split('.')
        paths = [folder / name for folder in located.folders for name in self._list_names(folder)]
        known = {path.stem for path in paths if path.suffix == '.py' or os.path.isdir(path)}
        near = find_nearest(part, (name for name in known if name.isidentifier()))
        nearest = '.'.join([*done, near]) if near else None
        return MissingModule(located.missing, nearest, self._find_hiding(done, part))

    def is_package(self, name: str) -> bool:
        """Return whether a name is that of a package with an `__init__.py`."""
        located = self._locate(name)
        return located.file is not None and located.file.name == '__init__.py'

    def is_of_project(self, name: str) -> bool:
        """Return whether a module, or the package that it is in, is not an installed one."""
        top = name.partition('.')[0]
        # Python asks no folder for these, whatever is there.
        if top in sys.builtin_module_names:
            return False
        file, folders = self._locate_part(top, self._roots)
        is_built = file is None and top in self._interfaces
        places = [] if is_built else [file, *folders[:1]]
        is_own = any(place and place.parent in self._project for place in places)
        return is_own or self.is_of_ros_package(top)

    def is_of_ros_package(self, name: str) -> bool:
        """Return whether a module is in the Python package of the ROS package of the files.

        Where that is installed, the files are in its share folder, and the modules are not.
        """
        top = name.partition('.')[0]
        return any(each.name == top and each.parent.name == 'share' for each in self._project)

    def _locate_anew(self, name: str) -> _Location:
        folders = self._roots
        done: list[str] = []
        file: Path | None = None
        for part in name.split('.'):
            file, inner = self._locate_part(part, folders)
            if file is None and not inner and not done:
                file, inner = _locate_with_importers(part)
            done.append(part)
            if file is None and not inner:
                return _Location(None, '.'.join(done), folders)
            folders = inner
        return _Location(file, '', folders)

    def _find_hiding(self, done: list[str], part: str) -> Path | None:
        """Return the `__init__.py` without which a module would be found in another folder."""
        file = self._locate('.'.join(done)).file if done else None
        inside = Path(*done, f'{part}.py')
        if file is None or not any(os.path.isfile(root / inside) for root in self._roots):
            return None
        return file

    def _locate_part(self, part: str, folders: list[Path]) -> tuple[Path | None, list[Path]]:
        return _places_of(PathFinder.find_spec(part, [*map(str, folders)]))


def _list_names(folder: Path) -> frozenset[str]:
    try:
        return frozenset(os.listdir(folder))  # noqa: PTH208 - fast
    except OSError:
        return frozenset()


def _places_of(spec: ModuleSpec | None) -> tuple[Path | None, list[Path]]:
    """Return the file of a module or package, and the folders of its modules."""
    if spec is None:
        return None, []
    file = Path(spec.origin) if spec.origin else None
    return file, [Path(entry) for entry in spec.submodule_search_locations or ()]


def _locate_with_importers(part: str) -> tuple[Path | None, list[Path]]:
    """Ask the other importers, such as those of editable installs, for a top-level name."""
    try:
        return _places_of(importlib.util.find_spec(part))
    except (ImportError, ValueError, AttributeError):
        return None, []
