"""NoDL documents that processes name, read and written into them as declarations."""

from __future__ import annotations

import os
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, SourceFile, diagnostic_at
from composer.language.nodl.node_builder import RULE, NodlNode
from composer.language.nodl.xml_documents import parse_xml
from composer.language.nodl.yaml_documents import parse_yaml
from composer.language.paths import PathError, explain_absent, resolve_path
from composer.spelling import suggest
from composer.yaml_text.reader import decode_content, read_content

if TYPE_CHECKING:
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath

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
                name: self._with_document(name, node) if node and _KEY in node else node
                for name, node in nodes.items()
            }
        if 'components' in self._process:
            self._process['components'] = {
                name: self._with_ends(each, ('components', name)) if _KEY in each else each
                for name, each in self._process['components'].items()
            }
        if _KEY in self._process:
            text = self._process.pop(_KEY)
            for node in self._choose(self._read(text, (*self._path, _KEY)), text):
                self._add(node)
        return self._process

    def _with_document(self, name: str, node: dict[str, Any]) -> dict[str, Any]:
        plain = dict(node)
        path = (*self._path, 'nodes', name)
        found = self._read(plain.pop(_KEY), (*path, _KEY))
        last = name.rpartition('/')[2]
        chosen = [each for each in found if each.name in (None, last)] or found
        return self._merged(plain, chosen[0], path) if chosen else plain

    def _with_ends(self, component: dict[str, Any], at: DataPath) -> dict[str, Any]:
        plain = dict(component)
        path = (*self._path, *at)
        found = self._read(plain.pop(_KEY), (*path, _KEY))
        last = str(at[-1]).rpartition('/')[2]
        chosen = [each for each in found if each.name in (None, last)] or found
        return self._declaring(plain, chosen[0], path) if chosen else plain

    def _choose(self, nodes: list[NodlNode], text: str) -> list[NodlNode]:
        """Return the nodes of a document that are in the program of the process."""
        wanted = self._process.get('executable')
        command = map(str, self._process.get('command', ()))
        words = [wanted] if wanted else [PurePath(word).name for word in command]
        known = [each.executable for each in nodes if each.executable]
        chosen = [each for each in nodes if each.executable in words]
        if wanted and known and not chosen:
            self._report(
                (*self._path, _KEY),
                f"'{PurePath(text).name}' has no node of the executable '{wanted}'",
                suggest(wanted, known, 'it has those of'),
            )
        return chosen or ([] if wanted and known else nodes)

    def _add(self, node: NodlNode) -> None:
        name = self._process.get('name', node.name)
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

    def _read(self, text: str, at: DataPath) -> list[NodlNode]:
        """Return the nodes of a document; what is wrong with it becomes findings."""
        if self._path in self._system.left_out:
            return []
        nodes, findings = self._read_file(text, at)
        self._system.diagnostics += findings
        if findings:
            # Of what it says, nobody knows what is missing.
            self._system.dropped.add(at)
        return nodes

    def _read_file(self, text: str, at: DataPath) -> tuple[list[NodlNode], list[Diagnostic]]:
        place = self._system.positions.value(at)
        try:
            path = resolve_path(text, Path())
        except PathError as error:
            rule = 'uninstalled-package'
            return [], [diagnostic_at(place, rule, str(error), help=error.help)]
        self._system.named[path] = None
        content = read_content(path, str(path))
        if isinstance(content, Diagnostic):
            is_there = os.path.lexists(path)
            message = content.message if is_there else f"there is no NoDL document '{text}'"
            help_text = content.help if is_there else explain_absent(path, place)
            return [], [diagnostic_at(place, RULE, message, help=help_text)]
        if path.suffix in ('.yaml', '.yml', '.json') or not content.lstrip().startswith(b'<'):
            return parse_yaml(content, str(path))
        decoded = decode_content(content, str(path))
        if isinstance(decoded, Diagnostic):
            return [], [decoded]
        return parse_xml(decoded, SourceFile(str(path), tuple(decoded.splitlines())))

    def _report(self, at: DataPath, message: str, help_text: str | None) -> None:
        place = self._system.positions.value(at)
        self._system.diagnostics.append(diagnostic_at(place, RULE, message, help=help_text))
        self._system.dropped.add(at)
