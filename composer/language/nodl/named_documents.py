"""Documents about the nodes of processes, read and written into them as declarations.

A process, a node or a component names one. Else the packages are asked: NoDL documents are in the
ament index, by package and executable.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.ament import find_share
from composer.diagnostics import Diagnostic, diagnostic_at
from composer.language.nodl.node_builder import RULE, NodlNode
from composer.language.nodl.yaml_documents import (
    find_document,
    find_library,
    is_xml,
    parse_nodl,
    refuse_xml,
)
from composer.language.paths import PathError, explain_absent, resolve_path
from composer.yaml_text.reader import parse_document, read_content

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.diagnostics import Span
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath

    _Merge = Callable[[dict[str, Any], NodlNode, DataPath], dict[str, Any]]

_KEY = 'interface'
_SCHEME = 'nodl://'
# Where packages keep the documents of generate_parameter_library, in their share folder or source.
_FOLDERS = ('', 'src', 'config', 'param', 'params', 'parameters')
_PARAMETERS = re.compile(r'.*param.*\.ya?ml')
_LARGEST = 1 << 20


def read_node_interfaces(system: LoadedSystem) -> None:
    """Write into the processes of a file what documents say of their nodes."""
    processes = system.entries.get('processes', {})
    packages: dict[str, list[tuple[str, Path]]] = {}
    found = {
        name: _Declaring(system, name, entry, packages).run()
        for name, entry in processes.items()
        if _may_have_documents(entry)
    }
    if found:
        system.data = system.entries | {'processes': processes | found}


def _may_have_documents(process: dict[str, Any]) -> bool:
    nodes = process.get('nodes')
    inner = [*nodes.values()] if isinstance(nodes, dict) else []
    named = _KEY in process or any(node and _KEY in node for node in inner)
    return named or 'components' in process or 'executable' in process


class _Declaring:
    """Reads the documents of one process."""

    def __init__(
        self,
        system: LoadedSystem,
        name: str,
        process: dict[str, Any],
        packages: dict[str, list[tuple[str, Path]]],
    ) -> None:
        self._system = system
        self._packages = packages
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
        text = self._process.pop(_KEY, None) or self._find(self._process, 'executable')
        node = self._read(text, self._place(())) if text else None
        if node is not None:
            self._add(node)
        return self._process

    def _place(self, at: DataPath) -> DataPath:
        """Return the path of the key that names a document, or the package that has it."""
        path = (*self._path, *at)
        named = (*path, _KEY)
        return named if named in self._system.positions.values else (*path, 'package')

    def _find(self, entry: dict[str, Any], key: str) -> str | None:
        """Return the document that a package has about a program or plugin; `None` if none.

        Args:
            key: That of the name in the entry.
        """
        package, name = entry.get('package'), entry.get(key)
        if not isinstance(package, str) or not isinstance(name, str):
            return None
        text = f'{_SCHEME}{package}/{name}'
        if find_document(text, Path()):
            return text
        meant = {name, entry.get('name'), name.rpartition('::')[2]}
        meant |= {re.sub('(?<!^)(?=[A-Z])', '_', each).lower() for each in meant if each}
        meant |= {str(each).removesuffix('_node') for each in meant}
        if package not in self._packages:
            self._packages[package] = [*_list_libraries(package)]
        return next((str(path) for root, path in self._packages[package] if root in meant), None)

    def _with_document(self, entry: Any, at: DataPath, merge: _Merge) -> Any:
        """Return a node or component with what its document says, if it names one."""
        plain = dict(entry or {})
        text = plain.pop(_KEY, None) or self._find(plain, 'plugin')
        if not text:
            return entry
        path = (*self._path, *at)
        node = self._read(text, self._place(at))
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
        values = self._system.positions.values
        declared: dict[str, Any] = {}
        for key, each in node.data.pop('parameters', {}).items():
            kept = {part: value for part, value in each.items() if part != 'default'}
            if key not in given:
                declared[key] = kept
            elif not isinstance(given[key], dict):
                declared[key] = {**kept, 'default': given[key]}
                at = (*path, 'parameters', key)
                values[*at, 'default'] = self._system.positions.value(at)
        if node.says_ends:
            # It may have no ends at all.
            node.data.setdefault('publishers', {})
        merged = self._merged(entry, node, path)
        return merged | ({'parameters': {**given, **declared}} if declared else {})

    def _merged(self, entry: dict[str, Any], node: NodlNode, path: DataPath) -> dict[str, Any]:
        """Return an entry with what a document says; what the entry says wins."""
        positions = self._system.positions
        written = {at: positions.values[at] for at in positions.values if at[: len(path)] == path}
        positions.graft(path, node.branch())
        positions.values.update(written)
        merged = dict(entry)
        for section, entries in node.data.items():
            merged[section] = {**entries, **merged.get(section, {})}
        if node.is_open and path[-2] == 'nodes':
            merged.setdefault('allow_undeclared_parameters', True)
        return merged

    def _read(self, text: str, at: DataPath) -> NodlNode | None:
        """Return the node of a document; what is wrong with it becomes findings."""
        if self._path in self._system.left_out:
            return None
        node, findings = self._read_file(text, self._system.positions.value(at))
        if findings and at[-1] != _KEY:
            # What a package says of itself is no mistake of this file.
            return None
        self._system.diagnostics += findings
        if findings:
            # Of what it says, nobody knows what is missing.
            self._system.dropped.add(at)
        return node

    def _read_file(self, text: str, place: Span) -> tuple[NodlNode | None, list[Diagnostic]]:
        path = find_document(text, Path()) if text.startswith(_SCHEME) else None
        try:
            if path is None:
                path = resolve_path(text.replace(_SCHEME, 'package://'), Path())
        except PathError as error:
            rule = 'uninstalled-package'
            return None, [diagnostic_at(place, rule, str(error), help=error.help)]
        self._system.named[path] = None
        content = read_content(path, str(path))
        if isinstance(content, Diagnostic):
            is_there = os.path.lexists(path)
            message = content.message if is_there else f"there is no document '{text}'"
            help_text = content.help if is_there else explain_absent(path, place)
            return None, [diagnostic_at(place, RULE, message, help=help_text)]
        if is_xml(path, content):
            return None, [refuse_xml(place, text)]
        node = parse_nodl(content, path)
        return node, node.findings


def _list_libraries(package: str) -> Iterator[tuple[str, Path]]:
    """Yield the documents of generate_parameter_library of a package, with their names.

    They are compiled in: hardly any package installs them, but one that is built with
    `--symlink-install` leads to its source.
    """
    share = find_share(package)
    if share is None:
        return
    source = Path(os.path.realpath(share / 'package.xml')).parent
    for folder in dict.fromkeys((share, source)):
        for name in _FOLDERS:
            inside = folder / name
            paths = sorted(inside.iterdir()) if os.path.isdir(inside) else ()
            for path in (each for each in paths if _PARAMETERS.fullmatch(each.name)):
                if os.path.isfile(path) and path.stat().st_size <= _LARGEST:
                    data = parse_document(path.read_bytes(), str(path)).data
                    if root := find_library(data or {}):
                        yield root, path
