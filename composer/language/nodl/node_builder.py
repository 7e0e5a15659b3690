"""A node of a NoDL document, as the data of a declared node, with positions."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.entity_kinds import KIND_OF_SECTION, TYPE_FOLDERS
from composer.names import with_article
from composer.ros_parameters.parameter_types import PARAMETER_TYPES
from composer.spelling import suggest
from composer.yaml_text.positions import Branch

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.yaml_text.positions import DataPath

RULE = 'bad-node-interface'
_TYPE = re.compile(r'(\w+)(?:/(msg|srv|action))?/(\w+)')
FIXED_SIZE = re.compile(r'_fixed_\d+$')
_OTHER_NAMES = {'int': 'integer', 'boolean': 'bool', 'float': 'double', 'str': 'string'}
# A program can do without those who would publish and serve for it.
_NEEDS_NOBODY = ('subscriptions', 'service_clients', 'action_clients')


@dataclass(slots=True)
class NodlNode:
    """The node of a document.

    Attributes:
        data: Its sections, as in a declared node.
        findings: Those of the document and of all that it includes.
        says_ends: Whether it tells its ends, and not its parameters alone.
        is_open: Whether it may have other parameters.
    """

    findings: list[Diagnostic] = field(default_factory=list)
    says_ends: bool = True
    is_open: bool = False
    data: dict[str, Any] = field(default_factory=dict)
    keys: dict[DataPath, Span] = field(default_factory=dict)
    values: dict[DataPath, Span] = field(default_factory=dict)

    def add_end(self, section: str, name: str, type_name: str, spans: tuple[Span, Span]) -> bool:
        """Add an end; a wrong type, or a second one of the name, is a finding.

        Args:
            type_name: With or without its folder, as in `std_msgs/String`.
            spans: Those of the name and of the type.
        """
        channel = KIND_OF_SECTION[section].channel
        folder = TYPE_FOLDERS[channel] if channel else ''
        match = _TYPE.fullmatch(type_name)
        if match is None or match[2] not in (None, folder):
            noun = with_article(f'{channel} type'.replace('topic', 'message'))
            self.report(spans[1], f"'{type_name}' is not {noun}, as in package/{folder}/Name")
            return False
        if name in self.data.setdefault(section, {}):
            noun = KIND_OF_SECTION[section].noun
            self.report(spans[0], f"there is {with_article(noun)} '{name}' already")
            return False
        entry: dict[str, Any] = {'type': f'{match[1]}/{folder}/{match[3]}'}
        if section in _NEEDS_NOBODY:
            entry['external'] = True
        self.data[section][name] = entry
        path = (section, name)
        self.keys[path], self.values[path] = spans[0], spans[0]
        self.values[*path, 'type'] = spans[1]
        return True

    def add_parameter(
        self, name: str, type_name: str, spans: tuple[Span, Span], **declared: Any
    ) -> None:
        """Add a parameter; a type that ROS does not have is a finding."""
        base = FIXED_SIZE.sub('', type_name)
        scalar, separator, _ = base.partition('_array')
        known = f'{_OTHER_NAMES.get(scalar, scalar)}{separator}'
        if known not in PARAMETER_TYPES:
            help_text = suggest(type_name, PARAMETER_TYPES, 'the types are')
            self.report(spans[1], f"'{type_name}' is not a type of parameters", help_text)
            return
        self.data.setdefault('parameters', {})[name] = {'type': known, **declared}
        path = ('parameters', name)
        self.keys[path], self.values[path] = spans[0], spans[0]
        self.values[*path, 'type'] = spans[1]

    def report(self, span: Span, message: str, help_text: str | None = None) -> None:
        """Add a finding."""
        self.findings.append(diagnostic_at(span, RULE, message, help=help_text))

    def branch(self) -> Branch:
        """Return the positions of its sections."""
        return Branch(tuple(self.keys.items()), tuple(self.values.items()))
