"""Joining namespaces, and the names of nodes in them, as files write them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath


def note_namespace(system: LoadedSystem, path: DataPath, outer: DataPath, inner: str) -> None:
    """Note that the namespace at a path lies in the one that is written at another path."""
    positions, notes = system.positions, system.notes
    place = ', '.join(filter(None, (positions.value(outer).place, notes.get(outer))))
    if inner:
        own = notes.get(path)
        notes[path] = f'{own}, in that of {place}' if own else f'in that of {place}'
        return
    positions.values[path] = positions.value(outer)
    if outer in notes:
        notes[path] = notes[outer]


def split_node_name(name: str, node: dict[str, Any]) -> tuple[str, str]:
    """Return the namespace and the simple name of a node."""
    if name.startswith('/'):
        namespace, _, simple = name.rpartition('/')
        return namespace or '/', simple
    return node.get('namespace', ''), name


def full_node_name(namespace: str, name: str) -> str:
    """Return the full name of a node of the file that is started."""
    return '/' + join_namespaces(namespace, name).lstrip('/')


def join_namespaces(outer: str, inner: str) -> str:
    """Return the inner namespace in the outer one; each may be absolute, relative or empty."""
    if not outer or inner.startswith('/'):
        return inner
    return f'{outer.rstrip("/")}/{inner}' if inner else outer
