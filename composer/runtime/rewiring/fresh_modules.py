"""Modules of a project imported anew, from the source that was checked.

Modules whose source is as before stay, and so does what they hold. Those that differ are executed
from their first line into new modules (`importlib.reload` would keep the names that are gone, and
leave old classes in use). Bytecode on disk is not used: it is compared by size and second, so a
file that is saved twice within a second may seem unchanged.
"""

from __future__ import annotations

import importlib
import sys
from contextlib import contextmanager
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from typing import TYPE_CHECKING, Any

from composer.runtime.behaviours.callables import import_module

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path
    from types import CodeType, ModuleType


class _Loader(SourceFileLoader):
    def __init__(self, name: str, path: str, source: str) -> None:
        super().__init__(name, path)
        self._source = source

    def get_code(self, fullname: str) -> CodeType | None:
        """See the base class."""
        return compile(self._source, self.get_filename(fullname), 'exec', dont_inherit=True)


class _Finder:
    """Finds the modules whose source is given, as Python would, and loads this source."""

    def __init__(self, sources: Mapping[str, str]) -> None:
        self._sources = sources

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, _target: Any = None
    ) -> ModuleSpec | None:
        """See `importlib.abc.MetaPathFinder`."""
        source = self._sources.get(name)
        # Of what Composer has not read, there is no source.
        spec = PathFinder.find_spec(name, path) if source else None
        if not source or spec is None or not isinstance(spec.loader, SourceFileLoader):
            return spec
        spec.loader = _Loader(name, spec.loader.path, source)
        return spec


@contextmanager
def fresh_modules(
    stale: Collection[str], sources: Mapping[str, str], search_path: Iterable[Path] = ()
) -> Iterator[Callable[[], None]]:
    """Let imports make new modules in place of those that are stale.

    If the block raises, the old modules are back as if nothing had been imported. Yields what
    imports those that functions import when they run, for the errors in them to be found now.

    Args:
        stale: The full names of the modules to execute anew.
        sources: The texts of modules, by their names.
        search_path: Folders to search first from now on, as far as they are new.
    """
    # A module that is gone has no source.
    before = {name: sys.modules.get(name) for name in (*sources, *stale)}
    for name in stale:
        _put_back(name, None)
    new_folders = [each for each in map(str, search_path) if each not in sys.path]
    sys.path[:0] = new_folders

    def put_back() -> None:
        for name, module in before.items():
            _put_back(name, module)
        for each in new_folders:
            sys.path.remove(each)

    def import_rest() -> None:
        for name in sorted(stale):
            if before[name] is not None and sources.get(name):
                import_module(name)

    finder: Any = _Finder(sources)
    sys.meta_path.insert(0, finder)
    importlib.invalidate_caches()
    try:
        yield import_rest
    except BaseException:
        put_back()
        raise
    finally:
        sys.meta_path.remove(finder)


def _put_back(name: str, module: ModuleType | None) -> None:
    """Make a module what this name means, in its package, too; `None` for no module."""
    package, _, last = name.rpartition('.')
    if module is None:
        gone = sys.modules.pop(name, None)
        # A package may have something else of this name.
        if package in sys.modules and vars(sys.modules[package]).get(last) is gone:
            vars(sys.modules[package]).pop(last, None)
        return
    sys.modules[name] = module
    if package in sys.modules:
        setattr(sys.modules[package], last, module)
