"""Reads ROS's own parameter files as rcl does, with the position of each value.

What rcl refuses is a finding, and so is what it misreads: names that follow `ros__parameters`,
empty mappings, lists in lists.
Source: `parse_key` and `parse_value` in rcl (`rcl_yaml_param_parser/src/parse.c`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, SourceFile, diagnostic_at
from composer.input_limits import MAX_FINDINGS, MAX_VALUES, read_file
from composer.records import record
from composer.ros_parameters.expressions_in_files import Treatment, render_trees, treat_trees
from composer.ros_parameters.node_patterns import find_pattern_problem
from composer.ros_parameters.parameter_types import infer_parameter_type
from composer.ros_parameters.rcl_values import RULE, ValueReader, flatten_list
from composer.spelling import suggest
from composer.yaml_text.reader import decode_content, read_content
from composer.yaml_text.tree import (
    CompositionError,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    compose_trees,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.diagnostics import Span

PARAMETERS_KEY = 'ros__parameters'
_SHAPE_HELP = 'a parameter file is node: {ros__parameters: {name: value}}; /** means every node'


@dataclass(frozen=True, slots=True, eq=False)
class ParameterEntry:
    """A value in a parameter file.

    Attributes:
        pattern: The nodes it is for, as a name with wildcards.
        keys: Its name, key by key; dots join them.
        opened: How many mappings of names begin with this value.
        type: A parameter type; `None` for an empty list.
        spans: The positions of a list's items.
    """

    pattern: str
    keys: tuple[str, ...]
    opened: int
    value: Any
    type: str | None
    pattern_span: Span
    key_span: Span
    value_span: Span
    spans: tuple[Span, ...] = ()

    @property
    def name(self) -> str:
        """The parameter's name."""
        return '.'.join(self.keys)


@record
class ParameterFile:
    """The readable part of a parameter file, in the order of its text, and the findings.

    Attributes:
        patterns: All names of nodes, also those without parameters.
        values: How many keys and values were read of it.
        sampled: Where values depend on samples.
    """

    patterns: tuple[tuple[str, Span], ...] = ()
    entries: tuple[ParameterEntry, ...] = ()
    findings: tuple[Diagnostic, ...] = ()
    values: int = 0
    sampled: tuple[Span, ...] = ()


def read_parameter_file(
    path: Path, most_values: int = MAX_VALUES, treatment: Treatment | None = None
) -> ParameterFile:
    """Read a file.

    Args:
        most_values: How many keys and values it may have.
        treatment: How it is changed before ROS reads it.
    """
    name = str(path)
    content = read_content(path, name)
    text = content if isinstance(content, Diagnostic) else decode_content(content, name)
    if isinstance(text, Diagnostic):
        return ParameterFile(findings=(text,))
    return parse_parameter_file(text, name, most_values, treatment)


def render_treated_file(path: Path, treatment: Treatment) -> str:
    """Return the text of a file without errors as ROS is to read it.

    Raises:
        UnreadableFileError: It cannot be read any more.
    """
    source, trees, _ = _compose(read_file(path).decode('utf-8-sig'), str(path), MAX_VALUES)
    treated, *_ = treat_trees(trees, source, treatment)
    return render_trees(treated)


def parse_parameter_file(
    text: str,
    name: str,
    most_values: int = MAX_VALUES,
    treatment: Treatment | None = None,
) -> ParameterFile:
    """Read the text of a file that is called `name` in findings."""
    try:
        source, trees, values = _compose(text, name, most_values)
    except CompositionError as error:
        return ParameterFile(findings=(_explain_typo(error.diagnostic),), values=error.values)
    reader = _Reader()
    sampled: list[Span] = []
    if treatment is not None or '$(' in text or '{{' in text:
        trees, findings, sampled = treat_trees(trees, source, treatment or Treatment())
        reader.findings += findings[: MAX_FINDINGS + 1]
    # ROS reads several documents as if they were one.
    for tree in trees:
        reader.read_nodes(tree, '')
    reader.check_double_names()
    return ParameterFile(
        tuple(reader.patterns),
        tuple(reader.entries),
        tuple(reader.findings),
        values,
        tuple(sampled),
    )


def _compose(text: str, name: str, most_values: int) -> tuple[SourceFile, Sequence[TreeNode], int]:
    source = SourceFile(name, tuple(text.splitlines()))
    return source, *compose_trees(text, source, alias_rule=RULE, most_values=most_values)


class _Reader:
    """Walks down the tree of a file."""

    def __init__(self) -> None:
        self.patterns: list[tuple[str, Span]] = []
        self.entries: list[ParameterEntry] = []
        self.findings: list[Diagnostic] = []
        self._values = ValueReader(self.findings)
        # Mappings of names that were entered since the last value.
        self._opened = 0

    def read_nodes(
        self, node: TreeNode, prefix: str, place: Span | None = None, *, is_last: bool = True
    ) -> None:
        """Read a mapping of names of nodes, or of what belongs to them.

        Args:
            place: The position of the last name before it.
            is_last: Whether nothing follows in the mappings around it, the outermost excepted.
        """
        if not isinstance(node, MappingNode):
            self._refuse_value(node)
            return
        for index, (key_node, value_node) in enumerate(node.pairs):
            key = self._key(key_node)
            if key is None:
                continue
            if key.startswith(PARAMETERS_KEY):
                pair = key_node, value_node
                is_last_key = index + 1 == len(node.pairs)
                self._read_parameters_of(prefix, place, pair, is_last_key=is_last_key)
                continue
            ends = is_last and (not prefix or index + 1 == len(node.pairs))
            if '/' in key and prefix and not ends:
                self._report(
                    key_node.span,
                    f"ROS puts the names after '{key}' into another namespace",
                    'write names with slashes at the top of the file, or as the last of a mapping',
                )
            if not isinstance(value_node, MappingNode):
                self._refuse_value(value_node, key)
                continue
            if advice := suggest(key, [PARAMETERS_KEY]):
                self._report(
                    key_node.span,
                    f"'{key}' is not a key of parameter files",
                    advice,
                )
                continue
            self.read_nodes(value_node, _join(prefix, key), key_node.span, is_last=ends)

    def _read_parameters_of(
        self,
        pattern: str,
        place: Span | None,
        pair: tuple[TreeNode, TreeNode],
        *,
        is_last_key: bool,
    ) -> None:
        key_node, node = pair
        key = self._key(key_node)
        if key != PARAMETERS_KEY:
            message = f"ROS reads '{key}' as '{PARAMETERS_KEY}'"
            self._report(key_node.span, message, f"write '{PARAMETERS_KEY}'")
        if place is None:
            message = f"'{PARAMETERS_KEY}' belongs below the name of a node"
            self._report(key_node.span, message, _SHAPE_HELP)
        elif problem := find_pattern_problem(pattern):
            self._report(place, f"'{pattern}': {problem}")
        elif not is_last_key:
            message = f"ROS misreads the names that follow '{PARAMETERS_KEY}'"
            self._report(key_node.span, message, 'write it last, or each node at the top')
        elif not isinstance(node, MappingNode):
            message = f"'{PARAMETERS_KEY}' must be a mapping of parameters"
            help_text = _help_for(node) or 'write {} if there are none'
            self._report(node.span, message, help_text)
        else:
            self.patterns.append((pattern, place))
            self._read_parameters(node, pattern, place, (), is_last=True)

    def _read_parameters(
        self,
        node: MappingNode,
        pattern: str,
        place: Span,
        outer: tuple[str, ...],
        *,
        is_last: bool,
    ) -> None:
        for index, (key_node, value_node) in enumerate(node.pairs):
            key = self._key(key_node)
            if key is None:
                continue
            keys = (*outer, key)
            if isinstance(value_node, MappingNode):
                self._check_names(key_node, key, value_node)
                ends = is_last and (not outer or index + 1 == len(node.pairs))
                if '.' in key and outer and not ends:
                    self._report(
                        key_node.span,
                        f"ROS reads what follows '{key}' as a part of it",
                        'write nested keys instead of the dot',
                    )
                self._opened += 1
                self._read_parameters(value_node, pattern, place, keys, is_last=ends)
                continue
            names, read_node = _without_mappings(value_node)
            value = self._values.read(read_node, key)
            if value is None:
                continue
            keys = (*keys, *names)
            if names:
                self._explain_mappings(value_node, '.'.join(keys))
            items = read_node.items if isinstance(read_node, SequenceNode) else []
            entry = ParameterEntry(
                pattern,
                keys,
                self._opened,
                value,
                infer_parameter_type(value),
                place,
                key_node.span,
                value_node.span,
                tuple(item.span for item in items),
            )
            self.entries.append(entry)
            self._opened = 0

    def _explain_mappings(self, node: TreeNode, name: str) -> None:
        place = next(each for each in getattr(node, 'items', ()) if isinstance(each, MappingNode))
        finding = diagnostic_at(
            place.span,
            'misread-list',
            f"ROS has no mappings in lists: it reads this as the list '{name}'",
            help="give each item a name, as in 'list: {first: {key: value}}'",
        )
        self.findings.append(finding)

    def check_double_names(self) -> None:
        """Report names that have a value and, elsewhere, names below them."""
        mappings = {
            (entry.pattern, '.'.join(entry.keys[:count]))
            for entry in self.entries
            for count in range(1, len(entry.keys))
        }
        for entry in self.entries:
            if (entry.pattern, entry.name) in mappings:
                message = f"'{entry.name}' has both a value and names below it"
                self._report(entry.key_span, message, 'ROS loses one of them: rename it')

    def _check_names(self, key_node: TreeNode, key: str, node: MappingNode) -> None:
        if not node.pairs:
            self._report(
                key_node.span,
                f"'{key}' is an empty mapping, and ROS misreads what follows it",
                'remove it',
            )
        elif key.startswith(PARAMETERS_KEY):
            message = f"'{PARAMETERS_KEY}' is inside another '{PARAMETERS_KEY}'"
            self._report(key_node.span, message, 'put it below the name of a node')

    def _key(self, node: TreeNode) -> str | None:
        if isinstance(node, ScalarNode) and node.text:
            return node.text.split('\0')[0]
        is_empty = isinstance(node, ScalarNode)
        what = 'and this one is empty' if is_empty else 'not a list or a mapping'
        is_expression = '{{' in node.span.source.line(node.span.line)
        advice = 'put an expression in quotes' if is_expression and not is_empty else None
        self._report(node.span, f'a key must be a string, {what}', advice)
        return None

    def _refuse_value(self, node: TreeNode, key: str = '') -> None:
        if len(self.findings) > MAX_FINDINGS:
            return
        if advice := suggest(key, [PARAMETERS_KEY]):
            message = f"'{key}' is not a key of parameter files"
            self._report(node.span, message, advice)
            return
        help_text = _help_for(node) or _SHAPE_HELP
        self._report(node.span, f"this value has no '{PARAMETERS_KEY}' above it", help_text)

    def _report(self, span: Span, message: str, help_text: str | None = None) -> None:
        # Nobody sees more, and each takes its time.
        if len(self.findings) <= MAX_FINDINGS:
            self.findings.append(diagnostic_at(span, RULE, message, help=help_text))


def _without_mappings(node: TreeNode) -> tuple[list[str], TreeNode]:
    """Return what mappings in a list add to its name, and the list without them."""
    has_mappings = isinstance(node, SequenceNode) and any(
        isinstance(item, MappingNode) for item in node.items
    )
    flat = flatten_list(node) if isinstance(node, SequenceNode) and has_mappings else None
    return flat or ([], node)


def _join(prefix: str, key: str) -> str:
    if not prefix or prefix.endswith('/'):
        return prefix + key
    return f'{prefix}/{key}'


def _help_for(node: TreeNode) -> str | None:
    """Return the help for a scalar that was meant as a key with its value."""
    return _explain_assignment(node.text) if isinstance(node, ScalarNode) else None


def _explain_typo(finding: Diagnostic) -> Diagnostic:
    """Return a syntax error with help about `:=`, if that stands on its line or the one before."""
    span = finding.span
    near = (span.source.line(span.line), span.source.line(span.line - 1)) if span else ()
    advice = next(filter(None, map(_explain_assignment, near)), None)
    return replace(finding, help=advice) if advice else finding


def _explain_assignment(text: str) -> str | None:
    name, separator, value = text.partition(':=')
    if not separator:
        return None
    return f"write '{name.strip()}: {value.strip()}', ':=' is for command lines"
