"""Several files as one: each changes what those before it say.

Mappings are merged entry by entry, all else is replaced, and `null` removes, but for `warn_after`,
where it is a value.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.language.source import Document

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.language.positions import DataPath, SourceMap

# What is in these is the user's own.
_FREE = ('message', 'state', 'with')


def merge_documents(documents: Sequence[Document]) -> Document:
    """Return the documents as one; each value keeps the position of where it was written."""
    merged, *layers = documents
    for layer in layers:
        merged = _merge(merged, layer)
    return merged


def _merge(below: Document, above: Document) -> Document:
    diagnostics = (*below.diagnostics, *above.diagnostics)
    if below.data is None or above.data is None:
        return Document(None, below.positions, diagnostics)
    positions = below.positions.copy()
    data = _merge_mappings(below.data, above.data, (), positions, above.positions)
    return Document(data, positions, diagnostics)


def _merge_mappings(
    below: dict[str, Any],
    above: dict[str, Any],
    path: DataPath,
    positions: SourceMap,
    new_positions: SourceMap,
) -> dict[str, Any]:
    merged = dict(below)
    for key, value in above.items():
        at = (*path, key)
        if value is None and not is_null_a_value(at):
            merged.pop(key, None)
            positions.remove(at)
        elif isinstance(value, dict) and isinstance(merged.get(key), dict):
            merged[key] = _merge_mappings(merged[key], value, at, positions, new_positions)
        else:
            merged[key] = _without_removals(value, at)
            positions.replace(at, new_positions)
    return merged


def is_null_a_value(path: DataPath) -> bool:
    """Return whether `null` at a path says something, and does not remove what is there."""
    return path[-1] == 'warn_after' and (
        path[:-1] == ('defaults',)
        or (path[0] == 'nodes' and (len(path) == _IN_NODE or _is_in_entity(path)))
    )


_IN_NODE = 3
_IN_ENTITY = 5
_OF_THE_USER = ('parameters', 'remap', 'state')


def _is_in_entity(path: DataPath) -> bool:
    return len(path) == _IN_ENTITY and path[2] not in _OF_THE_USER


def _without_removals(value: Any, path: DataPath) -> Any:
    """Return what is new without the nulls, which remove nothing here."""
    if not isinstance(value, dict) or path[-1] in _FREE:
        return value
    return {
        key: _without_removals(each, (*path, key))
        for key, each in value.items()
        if each is not None or is_null_a_value((*path, key))
    }
