"""Values of parameters as rcl reads them, in parameter files and behind `:=`.

The types that rcl gives to scalars are not those of YAML 1.2: they lean on `strtol` and `strtod`
of the C library.
Source: `get_value` and `parse_value` in rcl (`rcl_yaml_param_parser/src/parse.c`).
"""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.diagnostics import Diagnostic, SourceFile, diagnostic_at
from composer.names import with_article
from composer.ros_parameters.parameter_types import INT64_MAX, INT64_MIN, infer_parameter_type
from composer.yaml_text.scalars import BOOLS, BOOLS_OF_YAML_1_1, TAG_STR, suggest_flat
from composer.yaml_text.tree import (
    CompositionError,
    MappingNode,
    ScalarNode,
    SequenceNode,
    TreeNode,
    compose_trees,
)

if TYPE_CHECKING:
    from composer.diagnostics import Span

RULE = 'bad-parameter-file'
ParameterScalar: TypeAlias = bool | int | float | str

_BOOLS = {**BOOLS_OF_YAML_1_1, **BOOLS}
_DOTTED = re.compile(r'(\.nan|\.NaN|\.NAN|[-+]?\.(?:inf|Inf|INF))')

_SPACE = r'[ \t\n\v\f\r]*'
# What `strtol` reads to its end in base 0: a leading zero makes it octal.
_INTEGER = re.compile(rf'{_SPACE}([-+]?)(?:0[xX]([0-9a-fA-F]+)|(0[0-7]*)|([1-9][0-9]*))')
# What `strtod` reads to its end.
_DECIMAL = re.compile(rf'{_SPACE}[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?')
_HEXADECIMAL = re.compile(
    rf'{_SPACE}[-+]?0[xX](?:[0-9a-fA-F]+\.?[0-9a-fA-F]*|\.[0-9a-fA-F]+)(?:[pP][-+]?[0-9]+)?'
)
_NAMED = re.compile(rf'{_SPACE}[-+]?(?:inf|infinity|nan(?:\([0-9A-Za-z_]*\))?)', re.IGNORECASE)

# The smallest number of full precision; below it `strtod` reports what is not exact.
_LEAST_NORMAL = 2.2250738585072014e-308
# No number needs more; Python does not read integers of more digits without being asked to.
_MAX_LENGTH = 1000


def parse_override(text: str) -> tuple[Any, str | None] | None:
    """Return the value after `:=` on a command line, and its type; `None` if rcl refuses it."""
    findings: list[Diagnostic] = []
    try:
        trees, _ = compose_trees(text, SourceFile('<command line>', (text,)), alias_rule=RULE)
    except CompositionError:
        return None
    if len(trees) != 1 or isinstance(trees[0], MappingNode):
        return None
    value = ValueReader(findings).read(trees[0])
    return None if findings else (value, infer_parameter_type(value))


class ValueReader:
    """Reads values.

    Args:
        findings: Findings are added to it.
    """

    def __init__(self, findings: list[Diagnostic]) -> None:
        self._findings = findings

    def read(self, node: TreeNode, key: str = '') -> Any:
        """Return a value, `None` if rcl refuses it.

        Args:
            key: The name of the parameter in the file.
        """
        if isinstance(node, ScalarNode):
            if node.text or node.quoted:
                return read_scalar(node)
            where = f"'{key}' has no value" if key else 'there is no value'
            help_text = "write '' for an empty string; ROS has no null"
            self._report(node.span, where, help_text)
            return None
        if isinstance(node, MappingNode):
            message = 'a list of parameters cannot contain mappings'
            self._report(node.span, message, suggest_flat({}))
            return None
        return self._read_list(node)

    def _read_list(self, node: SequenceNode) -> list[Any] | None:
        values: list[Any] = []
        for item in node.items:
            if isinstance(item, SequenceNode):
                message = 'a list of parameters cannot contain lists'
                self._report(item.span, message, suggest_flat([]))
                return None
            value = self.read(item)
            if value is None:
                return None
            if values and type(value) is not type(values[0]):
                first, other = (infer_parameter_type(each) for each in (values[0], value))
                self._report(
                    item.span,
                    f'all items of a list have one type: this is {with_article(str(other))}, '
                    f'the first is {with_article(str(first))}',
                    _help_for_mixture(values[0], value),
                )
                return None
            values.append(value)
        return values

    def _report(self, span: Span, message: str, help_text: str | None = None) -> None:
        self._findings.append(diagnostic_at(span, RULE, message, help=help_text))


def flatten_list(node: SequenceNode) -> tuple[list[str], SequenceNode] | None:
    """Return a list with mappings as rcl reads it: names that it adds to the parameter's, items.

    The parser takes the first key of each mapping for a part of the name, and the values for items
    of the list; `None` if it refuses the list, or reads something that nobody can mean.
    """
    names: list[str] = []
    items: list[TreeNode] = []
    pending = [*reversed(node.items)]
    while pending:
        item = pending.pop()
        if isinstance(item, ScalarNode):
            items.append(item)
        elif isinstance(item, MappingNode) and len(item.pairs) == 1:
            ((key, value),) = item.pairs
            if not isinstance(key, ScalarNode) or not key.text:
                return None
            names.append(key.text)
            pending.append(value)
        else:
            return None
    return names, replace(node, items=items)


def _help_for_mixture(first: Any, other: Any) -> str | None:
    if {type(first), type(other)} == {int, float}:
        return 'write each with a decimal point'
    return 'put each in quotes if they are strings' if str in (type(first), type(other)) else None


def read_scalar(node: ScalarNode) -> ParameterScalar:
    """Return the value that rcl reads."""
    # rcl's strings are those of C.
    text = node.text.split('\0')[0]
    return text if node.quoted or node.tag == TAG_STR else read_plain_scalar(text)


def read_plain_scalar(text: str) -> ParameterScalar:
    """Return the value that rcl reads in a scalar without quotes, of plain or block style."""
    if text in _BOOLS:
        return _BOOLS[text]
    integer = _read_integer(text)
    if integer is not None:
        return integer
    double = _read_double(text)
    return text if double is None else double


def _read_integer(text: str) -> int | None:
    match = _INTEGER.fullmatch(text)
    if match is None or len(text) > _MAX_LENGTH:
        return None
    sign, *digits = match.groups()
    value = next(int(text, base) for text, base in zip(digits, (16, 8, 10), strict=True) if text)
    value = -value if sign == '-' else value
    # If it does not fit, rcl tries a double.
    return value if INT64_MIN <= value <= INT64_MAX else None


def _read_double(text: str) -> float | None:
    if _DOTTED.fullmatch(text):
        return float(text.replace('.', '', 1))
    if _NAMED.fullmatch(text):
        return float(text.partition('(')[0])
    if _DECIMAL.fullmatch(text):
        value = float(text)
        return value if _is_in_range(value, text) else None
    if _HEXADECIMAL.fullmatch(text):
        return _read_hexadecimal(text.strip().lower())
    return None


def _read_hexadecimal(text: str) -> float | None:
    try:
        value = float.fromhex(text)
    except OverflowError:
        return None
    mantissa, _, exponent = text.partition('x')[2].partition('p')
    whole, _, part = mantissa.partition('.')
    if abs(value) >= _LEAST_NORMAL or not int(whole + part, 16):
        return value
    if not value or len(text) > _MAX_LENGTH:
        return None
    exact = int(whole + part, 16) * Fraction(2) ** (int(exponent or 0) - 4 * len(part))
    return value if exact == abs(Fraction(value)) else None


def _is_in_range(value: float, text: str) -> bool:
    """Return whether `strtod` reports no overflow or underflow, after which rcl takes a string."""
    magnitude = abs(value)
    if magnitude == float('inf'):
        return False
    if magnitude >= _LEAST_NORMAL:
        return True
    if magnitude == 0:
        return not re.sub('[eE].*', '', text).strip(' \t\n\v\f\r+-.0')
    return len(text) <= _MAX_LENGTH and Fraction(text.strip()) == Fraction(value)
