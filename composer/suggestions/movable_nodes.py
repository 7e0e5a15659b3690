"""Which nodes a layer can move into another process."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import has_errors
from composer.yaml_text.writer import render_yaml

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec

_PROBE = 'composer_suggest_probe'


def find_movable(
    load: Callable[..., LoadedSystem], spec: SystemSpec, keys: Iterable[str]
) -> set[str]:
    """Return the keys of nodes that a layer can move: not those of includes, and of loops.

    Args:
        load: Loads the system, given one layer more.
        keys: Those to try.
    """
    keys = list(keys)
    found = _probe(load, spec, keys)
    # What one of them makes wrong may be all of it.
    return found or {key for key in keys if _probe(load, spec, [key])}


def _probe(load: Callable[..., LoadedSystem], spec: SystemSpec, keys: Sequence[str]) -> set[str]:
    with tempfile.NamedTemporaryFile('w', suffix='.yaml', encoding='utf-8') as file:
        file.write(render_yaml({'nodes': {key: {'worker': _PROBE} for key in keys}}))
        file.flush()
        moved = load(Path(file.name))
    if has_errors(moved.diagnostics) or moved.spec is None:
        return set()
    if moved.spec.nodes.keys() != spec.nodes.keys():
        return set()
    return {key for key in keys if moved.spec.nodes[key].worker == _PROBE}
