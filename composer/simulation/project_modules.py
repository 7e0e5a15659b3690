"""The modules of a project, which begin anew in each simulation, with all that they keep."""

from __future__ import annotations

import sys
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.errors import StartError
from composer.runtime.behaviours.callables import import_module
from composer.virtual_time.preemption import is_own_code

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping


def list_project_modules(folders: Iterable[Path], before: Collection[str]) -> dict[str, Path]:
    """Return the files of the modules in folders, but of no libraries there, by their names.

    Args:
        before: The names of those that are left out.
    """
    roots = set(folders)
    files = {
        name: Path(path)
        for name in sorted(set(sys.modules) - set(before))
        if (path := getattr(sys.modules[name], '__file__', None)) and is_own_code(path)
    }
    return {name: path for name, path in files.items() if not roots.isdisjoint(path.parents)}


@contextmanager
def replaced_objects(
    names: Mapping[str, str], folders: Collection[Path], before: Collection[str]
) -> Iterator[None]:
    """Put objects in the place of others meanwhile, also where a module has imported these.

    Args:
        names: The new ones by the old ones, both as `module:name` or `module:Class.name`.
        folders: Those of the project.
        before: The names of the modules that are not of the project.

    Raises:
        ComposerError: One of them is not there.
    """
    found = [(*_find(old), _find(new)[2]) for old, new in names.items()]
    with ExitStack() as stack:
        for owner, name, old, new in found:
            places = [(owner, name)]
            for module in list_project_modules(folders, before):
                values = vars(sys.modules[module])
                places += [(sys.modules[module], key) for key in values if values[key] is old]
            for place, key in places:
                stack.callback(setattr, place, key, getattr(place, key))
                setattr(place, key, new)
        yield


def _find(name: str) -> tuple[Any, str, Any]:
    """Return what has an object, its name there, and the object."""
    module, _, path = name.partition(':')
    *parents, last = path.split('.')
    owner: Any = import_module(module)
    try:
        for parent in parents:
            owner = getattr(owner, parent)
        return owner, last, getattr(owner, last)
    except AttributeError as error:
        message = f"there is no '{path}' in the module '{module}'"
        raise StartError(message) from error


@contextmanager
def forgotten_modules(folders: Collection[Path]) -> Iterator[set[str]]:
    """Forget the modules in folders that are imported meanwhile, but no libraries there.

    Else the next simulation would find what behaviours have changed in them, or another
    project's modules of the same names.

    Yields:
        The names of all modules that there are before.
    """
    before = set(sys.modules)
    yield before
    for name in list_project_modules(folders, before):
        del sys.modules[name]
