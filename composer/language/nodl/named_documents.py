"""NoDL documents that processes name, read and written into them as declarations."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.language.nodl.node_builder import RULE, NodlNode
from composer.language.nodl.yaml_documents import is_xml, parse_nodl, refuse_xml
from composer.language.paths import PathError, explain_absent, resolve_path
from composer.yaml_text.reader import read_content

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.diagnostics import Span
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath

    _Merge = Callable[[dict[str, Any], NodlNode, DataPath], dict[str, Any]]

_KEY = 'nodl'


def read_nodl_documents(system: LoadedSystem) -> None:
    """Write into the processes of a file what the NoDL documents say that they name."""
    processes = system.entries.get('processes', {})
    if not any(map(_names_documents, processes.values())):
        return
    system.data = system.entries | {
        'processes': {
            name: _Declaring(system, name, entry).run() if _names_documents(entry) else entry
            for name, entry in processes.items()
        }
    }


def _names_documents(process: dict[str, Any]) -> bool:
    nodes = process.get('nodes')
    inner = [*nodes.values()] if isinstance(nodes, dict) else []
    inner += process.get('components', {}).values()
    return _KEY in process or any(node and _KEY in node for node in inner)


class _Declaring:
    """Reads the documents of one process."""

    def __init__(self, system: LoadedSystem, name: str, process: dict[str, Any]) -> None:
        self._system = system
        self._path = ('processes', name)
        self._process = dict(process)

    def run(self) -> dict[str, Any]:
        """Return the process with what its documents say."""
        nodes = self._process.get('nodes')
        if isinstance(nodes, dict):
            self._process['nodes'] = {
                name: self._with_document(node, ('nodes', name), self._merged)
                for name, node in nodes.items()
            }
        if 'components' in self._process:
            self._process['components'] = {
                name: self._with_document(component, ('components', name), self._declaring)
                for name, component in self._process['components'].items()
            }
        if _KEY in self._process:
            node = self._read(self._process.pop(_KEY), (*self._path, _KEY))
            if node is not None:
                self._add(node)
        return self._process

    def _with_document(self, entry: Any, at: DataPath, merge: _Merge) -> Any:
        """Return a node or component with what its document says, if it names one."""
        if not entry or _KEY not in entry:
            return entry
        plain = dict(entry)
        path = (*self._path, *at)
        node = self._read(plain.pop(_KEY), (*path, _KEY))
        return plain if node is None else merge(plain, node, path)

    def _add(self, node: NodlNode) -> None:
        name = self._process.get('name')
        if name is None:
            self._process = self._declaring(self._process, node, self._path)
            return
        nodes = self._process.get('nodes')
        listed = dict(nodes) if isinstance(nodes, dict) else dict.fromkeys(nodes or ())
        own = listed.get(name) or {}
        listed[name] = self._merged(own, node, (*self._path, 'nodes', name))
        self._process['nodes'] = listed

    def _declaring(self, entry: dict[str, Any], node: NodlNode, path: DataPath) -> dict[str, Any]:
        """Return a process or component with what a document says beside its other keys."""
        # The names of its parameters stand beside the values that it is given.
        given = entry.get('parameters', {})
        declared = {
            key: {part: value for part, value in each.items() if part != 'default'}
            for key, each in node.data.pop('parameters', {}).items()
            if key not in given
        }
        # It may have no ends at all.
        node.data.setdefault('publishers', {})
        merged = self._merged(entry, node, path)
        return merged | ({'parameters': {**declared, **given}} if declared else {})

    def _merged(self, entry: dict[str, Any], node: NodlNode, path: DataPath) -> dict[str, Any]:
        """Return an entry with what a document says; what the entry says wins."""
        positions = self._system.positions
        written = {at: positions.values[at] for at in positions.values if at[: len(path)] == path}
        positions.graft(path, node.branch())
        positions.values.update(written)
        merged = dict(entry)
        for section, entries in node.data.items():
            merged[section] = {**entries, **merged.get(section, {})}
        return merged

    def _read(self, text: str, at: DataPath) -> NodlNode | None:
        """Return the node of a document; what is wrong with it becomes findings."""
        if self._path in self._system.left_out:
            return None
        node, findings = self._read_file(text, self._system.positions.value(at))
        self._system.diagnostics += findings
        if findings:
            # Of what it says, nobody knows what is missing.
            self._system.dropped.add(at)
        return node

    def _read_file(self, text: str, place: Span) -> tuple[NodlNode | None, list[Diagnostic]]:
        try:
            path = resolve_path(text, Path())
        except PathError as error:
            rule = 'uninstalled-package'
            return None, [diagnostic_at(place, rule, str(error), help=error.help)]
        self._system.named[path] = None
        content = read_content(path, str(path))
        if isinstance(content, Diagnostic):
            is_there = os.path.lexists(path)
            message = content.message if is_there else f"there is no NoDL document '{text}'"
            help_text = content.help if is_there else explain_absent(path, place)
            return None, [diagnostic_at(place, RULE, message, help=help_text)]
        if is_xml(path, content):
            return None, [refuse_xml(place, text)]
        node = parse_nodl(content, path)
        return node, node.findings
