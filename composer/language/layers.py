"""Layers: several files as one, each of which changes the files before it.

Mappings are merged entry by entry, all else is replaced, and `null` removes, but for `warn_after`,
where it is a value. What a layer means to change and is not there is a finding.
"""

from __future__ import annotations

import re
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.entity_kinds import ENTITY_KINDS, WORK_KEYS
from composer.language.specs import NodeSpec
from composer.schema.structure import lacks_keys
from composer.spelling import did_you_mean, find_nearest, is_typo, suggest
from composer.yaml_text.document import Document

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from composer.diagnostics import Diagnostic
    from composer.yaml_text.positions import DataPath, SourceMap

# What only expressions use.
_VALUES: dict[DataPath, str] = {('args',): 'argument', ('vars',): 'variable'}
# Below the path of a node that may be one of an include.
REACHING = 'reaching'
# What is in these is the user's own.
_FREE = ('message', 'state', 'with')


def merge_documents(documents: Sequence[Document]) -> Document:
    """Return the documents as one; each value keeps its position."""
    merged, *layers = documents
    for index, layer in enumerate(layers):
        merged = _merge(merged, layer, layers[index:])
    return merged


def _merge(below: Document, above: Document, users: Sequence[Document]) -> Document:
    """Merge a layer into what is below it; `users` are those that may use what it declares."""
    diagnostics = [*below.diagnostics, *above.diagnostics]
    if below.data is None or above.data is None:
        return Document(None, below.positions, diagnostics)
    merging = Merging(below.positions.copy(), above.positions, users)
    # Each node of a layer is looked at, also if there are none below.
    own: dict[str, Any] = {'nodes': {}} if isinstance(above.data.get('nodes'), dict) else {}
    data = merging.merge(own | below.data, above.data, ())
    return Document(data, merging.positions, [*diagnostics, *merging.findings])


class Merging:
    """Merges a layer into what is below it.

    Args:
        positions: Those of what is below; they become those of the result.
        new_positions: Those of the layer.
        users: The layers that may use what this one declares.
    """

    def __init__(
        self, positions: SourceMap, new_positions: SourceMap, users: Sequence[Document]
    ) -> None:
        self.positions = positions
        self.findings: list[Diagnostic] = []
        self._new_positions = new_positions
        self._users = users
        self._has_includes = any(path[0] == 'include' for path in positions.keys)

    def merge(
        self, below: dict[str, Any], above: dict[str, Any], path: DataPath
    ) -> dict[str, Any]:
        """Return a mapping at a path as the layer changes it."""
        merged = dict(below)
        for key, value in above.items():
            at = (*path, key)
            if self._may_reach(path, key, value, below):
                # Nulls remove what the node has, wherever it is declared.
                merged[key] = _overlaid(merged.get(key, {}), value)
                self.positions.graft(at, self._new_positions.branch(at))
                self.positions.values[*at, REACHING] = self._new_positions.key(at)
            elif value is None and not is_null_a_value(at):
                if key not in merged:
                    self._report(at, f"null removes '{key}', which does not exist", below)
                merged.pop(key, None)
                self.positions.remove(at)
            elif isinstance(value, dict) and isinstance(merged.get(key), dict):
                merged[key] = self.merge(merged[key], value, at)
            else:
                if key not in merged and (meant := _find_meant(at, value, below)):
                    self._report_incomplete(at, meant)
                    # What it says is read as what it means, and has findings of its own.
                    self._new_positions.move(at, (*path, meant))
                    merged[meant] = self.merge(merged[meant], value, (*path, meant))
                    continue
                if key not in merged and _only_changes_a_node(at, value):
                    self._report(at, f"there is no node '{key}' to change", below)
                if key not in merged and path in _VALUES and not self._is_used(key):
                    self._report(at, f"there is no {_VALUES[path]} '{key}' to change", below)
                if key not in merged and (near := self._find_typo(at, below)):
                    self._report(at, f"there is no '{key}' to change", [near])
                merged[key] = self._without_removals(value, at)
                self.positions.replace(at, self._new_positions)
        return merged

    def _may_reach(self, path: DataPath, key: str, value: Any, below: dict[str, Any]) -> bool:
        """Return whether an entry may be about a node of an include, by its full name."""
        if path != ('nodes',) or not isinstance(value, dict) or not key.startswith('/'):
            return False
        is_new = key not in below and self._has_includes
        return is_new or (*path, key, REACHING) in self.positions.values

    def _without_removals(self, value: Any, path: DataPath) -> Any:
        """Return a new value without nulls, which have nothing to remove."""
        if not isinstance(value, dict) or path[-1] in _FREE:
            return value
        kept = {}
        for key, each in value.items():
            at = (*path, key)
            if each is not None or is_null_a_value(at):
                kept[key] = self._without_removals(each, at)
            else:
                self._report(at, f"null removes '{key}', which does not exist", {})
        return kept

    def _find_typo(self, path: DataPath, there: dict[str, Any]) -> str | None:
        """Return the entry that a new one, which is whole in itself, is a misspelling of."""
        *outer, name = path
        is_simple = tuple(outer) in (('qos',), ('environment',)) or (
            len(outer) == _IN_NODE and outer[-1] in ('env', 'parameters', 'state')
        )
        near = find_nearest(name, there) if is_simple else None
        if near is None or not is_typo(str(name), near):
            return None
        is_used = any(name == each for user in self._users for each in _values(user.data))
        return None if is_used else near

    def _is_used(self, argument: str) -> bool:
        """Return whether an expression of a layer may use an argument that it declares."""
        word = re.compile(rf'\b{re.escape(argument)}\b')
        return any(
            '{{' in text and word.search(text)
            for each in self._users
            for text in _texts(each.data)
        )

    def _report_incomplete(self, path: DataPath, meant: str) -> None:
        what = _NOUNS[str(path[-2])]
        message = f"there is no {what} '{path[-1]}' to change, and for a new one keys are missing"
        span = self._new_positions.key(path)
        finding = diagnostic_at(span, 'missing-key', message, help=did_you_mean(meant))
        self.findings.append(finding)

    def _report(self, path: DataPath, message: str, there: Iterable[str]) -> None:
        self.findings.append(
            diagnostic_at(
                self._new_positions.key(path),
                'changes-nothing',
                message,
                help=suggest(str(path[-1]), there, 'there are'),
            )
        )


def _values(data: Any) -> Iterator[Any]:
    """Yield the scalars of data, without its keys."""
    inner = data.values() if isinstance(data, dict) else data if isinstance(data, list) else ()
    for each in inner:
        yield from _values(each) if isinstance(each, dict | list) else (each,)


def _texts(data: Any) -> Iterator[str]:
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _texts(key)
            yield from _texts(value)
    elif isinstance(data, list):
        for value in data:
            yield from _texts(value)
    elif isinstance(data, str):
        yield data


def _find_meant(path: DataPath, value: Any, there: dict[str, Any]) -> str | None:
    """Return the entry that a new one without all its keys was meant to change."""
    if not isinstance(value, dict) or len(path) == 1:
        return None
    if path[-2] not in _SECTIONS.get((len(path), str(path[0])), ()):
        return None
    meant = find_nearest(path[-1], there)
    if meant is None or not isinstance(there[meant], dict):
        return None
    part: Any = value
    for key in reversed(path):
        part = {key: part}
    return meant if lacks_keys(part) else None


def _only_changes_a_node(path: DataPath, value: Any) -> bool:
    """Return whether a value only changes a node, and gives it nothing to do."""
    is_node = len(path) == _NODE and path[0] == 'nodes'
    return is_node and isinstance(value, dict) and 0 < len(value) == len(value.keys() & _CHANGES)


def is_change_of_node(value: Any) -> bool:
    """Return whether what a layer says of a node can only change one."""
    path = ('nodes', 'node')
    return _only_changes_a_node(path, value) or lacks_keys({'nodes': {'node': value}})


def _overlaid(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Return what two layers say of a node that is in neither of them."""
    both = {
        key: _overlaid(below[key], value)
        for key, value in above.items()
        if isinstance(value, dict) and isinstance(below.get(key), dict)
    }
    return below | above | both


def is_null_a_value(path: DataPath) -> bool:
    """Return whether `null` at a path is a value, and removes nothing."""
    return path[-1] == 'warn_after' and (
        path[:-1] == ('defaults',)
        or (path[0] == 'nodes' and (len(path) == _IN_NODE or _is_in_entity(path)))
    )


# The sections with entries that need some keys, by the depth of these and the first key.
_NOUNS = {
    **{kind.section: kind.noun for kind in ENTITY_KINDS if kind.section != 'parameters'},
    'nodes': 'node',
    'include': 'include',
    'processes': 'process',
    'containers': 'container',
}
_SECTIONS = {
    (2, 'nodes'): ('nodes',),
    (2, 'include'): ('include',),
    (2, 'processes'): ('processes',),
    (2, 'containers'): ('containers',),
    (4, 'nodes'): tuple(_NOUNS),
}
_NODE = 2
_IN_NODE = 3
_IN_ENTITY = 5
_OF_THE_USER = ('parameters', 'remap', 'state')
# The keys that say how a node runs, and give it nothing to do.
_CHANGES = {
    *({each.name for each in fields(NodeSpec)} - WORK_KEYS),
    *('warn_after', 'local_delivery', 'when', 'foreach'),
}


def _is_in_entity(path: DataPath) -> bool:
    return len(path) == _IN_ENTITY and path[2] not in _OF_THE_USER
