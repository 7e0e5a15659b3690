"""The modules of a project, which begin anew in each simulation, with all that they keep."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from composer.virtual_time.preemption import is_own_code

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


@contextmanager
def forgotten_modules(folders: Iterable[Path]) -> Iterator[None]:
    """Forget the modules in folders that are imported meanwhile, but no libraries there.

    Else the next simulation would find what behaviours have changed in them, or another
    project's modules of the same names.
    """
    before = set(sys.modules)
    yield
    roots = set(folders)
    for name in set(sys.modules) - before:
        path = getattr(sys.modules[name], '__file__', None)
        if path and is_own_code(path) and not roots.isdisjoint(Path(path).parents):
            del sys.modules[name]
