"""Several files as one: each changes what those before it say.

Mappings are merged entry by entry, all else is replaced, and `null` removes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.language.source import Document

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.language.positions import DataPath, SourceMap


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
        if value is None:
            merged.pop(key, None)
        elif isinstance(value, dict) and isinstance(merged.get(key), dict):
            merged[key] = _merge_mappings(merged[key], value, at, positions, new_positions)
        else:
            merged[key] = _without_removals(value)
            positions.replace(at, new_positions)
    return merged


def _without_removals(value: Any) -> Any:
    """Return what is new without the nulls, which remove nothing here."""
    if isinstance(value, dict):
        return {key: _without_removals(each) for key, each in value.items() if each is not None}
    return value
