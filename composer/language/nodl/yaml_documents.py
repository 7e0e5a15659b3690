"""NoDL documents of version 2, in YAML or JSON: the ends of a node with QoS, and its parameters.

Also the documents of generate_parameter_library, which have parameters alone, in the same form.
Source: `nodl_schema/schemas/` of https://github.com/ros-tooling/nodl, and
https://github.com/PickNikRobotics/generate_parameter_library
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any

from composer.ament import ament_prefixes, find_path
from composer.diagnostics import Diagnostic, diagnostic_at
from composer.language.nodl.node_builder import FIXED_SIZE, RULE, NodlNode
from composer.language.qos import NANOSECONDS
from composer.spelling import suggest
from composer.yaml_text.reader import parse_document, read_content

if TYPE_CHECKING:
    from pathlib import Path

    from composer.diagnostics import Span
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath

_SECTIONS = {
    'publishers': 'publishers',
    'subscriptions': 'subscriptions',
    'service_servers': 'services',
    'service_clients': 'service_clients',
    'action_servers': 'actions',
    'action_clients': 'action_clients',
}
_KEYS = ('nodl_version', 'description', 'codegen', 'include', 'parameters', *_SECTIONS)
_POLICIES = ('history', 'depth', 'reliability', 'durability', 'liveliness')
_DURATION_KEYS = ('deadline', 'lifespan', 'liveliness_lease_duration')
_SCALARS = ('int', 'double', 'string')
_RULES_OF_LIMITS = {
    **dict.fromkeys(('gt_eq', 'lower_bounds'), ('minimum', 0)),
    **dict.fromkeys(('lt_eq', 'upper_bounds'), ('maximum', 0)),
    'gt': ('minimum', 1),
    'lt': ('maximum', -1),
}
# Of a parameter for each of several things, whose names another parameter has.
_MAPPED = '__map_'
_MOST_INCLUDED = 100
_XML = re.compile(rb'(?:\xef\xbb\xbf)?\s*<[?!\w]')


def is_xml(path: Path, content: bytes) -> bool:
    """Return whether a document is of version 1, which is XML."""
    return path.suffix == '.xml' or _XML.match(content) is not None


def refuse_xml(place: Span, text: str) -> Diagnostic:
    """Return the finding about a document of version 1."""
    return diagnostic_at(
        place,
        RULE,
        f"'{text}' is NoDL of version 1 (XML), and only version 2 (YAML) is read",
        help="write it in YAML, with 'nodl_version: 2' at its top, and name that file",
    )


def parse_nodl(content: bytes, path: Path) -> NodlNode:
    """Return the node of a document, with what is wrong with it."""
    node = NodlNode()
    _Reader(node).read(parse_document(content, str(path)), path, [path])
    return node


class _Reader:
    def __init__(self, node: NodlNode) -> None:
        self._node = node
        self._included = 0

    def read(self, document: Document, path: Path, stack: list[Path]) -> None:
        """Add what a document, and those that it includes, have."""
        self._node.findings += document.diagnostics
        data, positions = document.data, document.positions
        if data is None:
            return
        if library := find_library(data):
            self._node.says_ends, self._node.is_open = False, True
            self._add_parameters(document, (library,), data[library])
            return
        if data.get('nodl_version') != 2:  # noqa: PLR2004 - the version that this module reads
            place = positions.value(('nodl_version',))
            self._node.report(place, "a NoDL document begins with 'nodl_version: 2'")
            return
        for key in data:
            if key not in _KEYS:
                help_text = suggest(key, _KEYS, 'the keys are')
                self._node.report(positions.key((key,)), f"NoDL has no key '{key}'", help_text)
        for key, section in _SECTIONS.items():
            for index, end in enumerate(_list(data.get(key))):
                self._add_end(document, section, end, (key, index))
        parameters = data.get('parameters')
        if isinstance(parameters, dict):
            self._node.data.setdefault('parameters', {})
            self._add_parameters(document, ('parameters',), parameters)
        for index, reference in enumerate(_list(data.get('include'))):
            self._include(document, reference, ('include', index), path, stack)

    def _add_end(self, document: Document, section: str, end: Any, at: DataPath) -> None:
        positions = document.positions
        if not isinstance(end, dict) or not all(
            isinstance(end.get(key), str) for key in ('name', 'type')
        ):
            self._node.report(positions.value(at), "an entry of NoDL has 'name' and 'type'")
            return
        spans = (positions.value((*at, 'name')), positions.value((*at, 'type')))
        if not self._node.add_end(section, end['name'], end['type'], spans):
            return
        qos = end.get('qos')
        if isinstance(qos, dict) and not section.startswith('action'):
            entry = self._node.data[section][end['name']]
            entry['qos'] = self._read_qos(qos, document, (*at, 'qos'))
            path = (section, end['name'], 'qos')
            self._node.values[path] = positions.value((*at, 'qos'))

    def _read_qos(self, qos: dict[str, Any], document: Document, at: DataPath) -> dict[str, Any]:
        policies: dict[str, Any] = {}
        for key, value in qos.items():
            name = key.removesuffix('_ns')
            if key in _POLICIES and isinstance(value, str):
                policies[key] = value.lower()
            elif key == 'depth' and type(value) is int and value > 0:
                policies[key] = value
            elif key != name and name in _DURATION_KEYS and type(value) is int and value >= 0:
                # 0 is no limit.
                policies |= {name: value / NANOSECONDS} if value else {}
            else:
                known = [*_POLICIES, *(f'{policy}_ns' for policy in _DURATION_KEYS)]
                message, path = f"'{key}: {value}' is no QoS of NoDL", (*at, key)
                if key in known:
                    self._node.report(document.positions.value(path), message)
                else:
                    help_text = suggest(key, known, 'the policies are')
                    self._node.report(document.positions.key(path), message, help_text)
        return policies

    def _add_parameters(
        self, document: Document, at: DataPath, declared: dict[str, Any], prefix: str = ''
    ) -> None:
        for key, entry in declared.items():
            name, here = f'{prefix}{key}', (*at, key)
            kind = entry.get('type') if isinstance(entry, dict) else None
            if _MAPPED in name or kind == 'none':
                # Which there are depends on values, or others declare it.
                self._node.is_open = True
            elif isinstance(kind, str):
                spans = (document.positions.key(here), document.positions.value((*here, 'type')))
                self._node.add_parameter(name, kind, spans, **_limits(entry))
            elif isinstance(entry, dict) and not self._node.says_ends:
                self._add_parameters(document, here, entry, f'{name}.')
            else:
                message = f"the parameter '{name}' has no type"
                self._node.report(document.positions.value(here), message)

    def _include(
        self, document: Document, reference: Any, at: DataPath, path: Path, stack: list[Path]
    ) -> None:
        text = reference.get('ref') if isinstance(reference, dict) else None
        place = document.positions.value((*at, 'ref'))
        found = find_document(str(text), path.parent)
        self._included += 1
        if found is None:
            self._node.report(place, f"there is no NoDL document '{text}'")
        elif found in stack:
            self._node.report(place, f"'{text}' includes itself")
        elif self._included <= _MOST_INCLUDED:
            content = read_content(found, str(found))
            if isinstance(content, Diagnostic):
                self._node.findings.append(content)
            elif is_xml(found, content):
                self._node.findings.append(refuse_xml(place, str(text)))
            else:
                self.read(parse_document(content, str(found)), found, [*stack, found])


def find_library(data: dict[str, Any]) -> str | None:
    """Return the name that parameters of generate_parameter_library stand under, if data are such.

    No other document of ours has one key alone, with parameters that say their types.
    """
    if len(data) != 1:
        return None
    ((name, inner),) = data.items()
    return name if name != 'parameters' and _has_types(inner) else None


def _has_types(data: Any) -> bool:
    return isinstance(data, dict) and (
        isinstance(data.get('type'), str) or any(map(_has_types, data.values()))
    )


def find_document(text: str, folder: Path) -> Path | None:
    """Return the document that a reference names, if it is there."""
    scheme, _, rest = text.partition('://')
    if scheme == 'local':
        path = folder / rest
        return path if os.path.isfile(path) else None
    package, _, name = rest.partition('/')
    if scheme != 'nodl' or not name:
        return None
    index = f'share/ament_index/resource_index/nodl/{package}__{name}'
    in_share = f'share/{package}/nodl/{name}.nodl.yaml'
    prefixes = ament_prefixes()
    return find_path(in_share, prefixes) or find_path(index, prefixes)


def _limits(declared: dict[str, Any]) -> dict[str, Any]:
    """Return the default and the limits of a parameter in the keys of the language."""
    found: dict[str, Any] = {
        key: declared[key] for key in ('description', 'read_only') if key in declared
    }
    if declared['type'] != 'byte_array' and 'default_value' in declared:
        found['default'] = declared['default_value']
    rules = declared.get('validation')
    scalar = FIXED_SIZE.sub('', declared['type'])
    if not isinstance(rules, dict) or scalar not in _SCALARS:
        return found
    rules = {key.removesuffix('<>'): value for key, value in rules.items()}
    bounds = rules.get('bounds')
    if isinstance(bounds, list) and len(bounds) == 2:  # noqa: PLR2004 - lower and upper
        found['minimum'], found['maximum'] = bounds
    for rule, (key, step) in _RULES_OF_LIMITS.items():
        given = rules.get(rule)
        limit: Any = given[0] if isinstance(given, list) and given else given
        if type(limit) in {int, float}:
            # Of an integer the next one; of a double the limit itself, which is hardly meant.
            found[key] = limit + step if scalar == 'int' else limit
    choices = rules.get('one_of')
    if isinstance(choices, list) and choices and isinstance(choices[0], list):
        found['choices'] = choices[0]
    return found


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
