"""The modules of a project, which begin anew in each simulation, with all that they keep."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from composer.virtual_time.preemption import is_own_code

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator


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
