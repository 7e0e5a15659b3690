"""Values in parameter files and behind `:=`, as rcl reads them.

Source: `parse_value` in rcl (`rcl_yaml_param_parser/src/parse.c`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, SourceFile, diagnostic_at
from composer.names import with_article
from composer.ros_parameters.parameter_types import infer_parameter_type
from composer.ros_parameters.rcl_scalars import read_scalar
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


def parse_override(text: str) -> tuple[Any, str | None] | None:
    """Return value and type of what follows `:=` on a command line; `None` if rcl refuses it."""
    faults: list[Diagnostic] = []
    try:
        trees = compose_trees(text, SourceFile('<command line>', (text,)), alias_rule=RULE)
    except CompositionError:
        return None
    if len(trees) != 1 or isinstance(trees[0], MappingNode):
        return None
    value = ValueReader(faults).read(trees[0])
    return None if faults else (value, infer_parameter_type(value))


class ValueReader:
    """Reads values.

    Args:
        faults: What is wrong with them is added to it.
    """

    def __init__(self, faults: list[Diagnostic]) -> None:
        self._faults = faults

    def read(self, node: TreeNode, key: str = '') -> Any:
        """Return a value, `None` if rcl refuses it.

        Args:
            key: What the file calls it.
        """
        if isinstance(node, ScalarNode):
            if node.text or node.quoted:
                return read_scalar(node)
            where = f"'{key}' has no value" if key else 'there is no value'
            help_text = "write one; '' is an empty text, and ROS has no null"
            self._fault(node.span, where, help_text)
            return None
        if isinstance(node, MappingNode):
            self._fault(node.span, 'a list of parameters holds no mappings')
            return None
        return self._read_list(node)

    def _read_list(self, node: SequenceNode) -> list[Any] | None:
        values: list[Any] = []
        for item in node.items:
            if isinstance(item, SequenceNode):
                self._fault(
                    item.span, 'a list of parameters holds no lists', 'write one long list'
                )
                return None
            value = self.read(item)
            if value is None:
                return None
            if values and type(value) is not type(values[0]):
                first, other = (infer_parameter_type(each) for each in (values[0], value))
                self._fault(
                    item.span,
                    f'a list has one type: this is {with_article(str(other))}, and the first item '
                    f'{with_article(str(first))}',
                    _help_for_mixture(values[0], value),
                )
                return None
            values.append(value)
        return values

    def _fault(self, span: Span, message: str, help_text: str | None = None) -> None:
        self._faults.append(diagnostic_at(span, RULE, message, help=help_text))


def _help_for_mixture(first: Any, other: Any) -> str | None:
    if {type(first), type(other)} == {int, float}:
        return 'give each of them a decimal point'
    return 'put each in quotes if they are texts' if str in (type(first), type(other)) else None
