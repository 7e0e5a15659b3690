"""What a function does with the node that it is given, told by its text.

The node is the first positional parameter, whatever its name. What cannot be told makes a kind of
use *open*: there may be further ones, by names that only running it would show.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from composer.python_source.control_flow import find_run
from composer.python_source.local_names import (
    find_chosen,
    find_parameter,
    list_arguments,
    nested_names,
    stored_names,
)
from composer.python_source.modules import find_texts
from composer.python_source.node_use_reader import UseReader
from composer.python_source.node_uses import ALL_KINDS, NodePass, NodeUse, NodeUses, UseKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from composer.python_source.modules import FunctionNode

__all__ = [
    'ALL_KINDS',
    'NodePass',
    'NodeUse',
    'NodeUses',
    'UseKind',
    'find_parameter',
    'read_node_uses',
]


def read_node_uses(
    function: FunctionNode,
    node_name: str,
    given: Iterable[str],
    texts: Mapping[str, str] = MappingProxyType({}),
) -> NodeUses:
    """Return what a function does with its parameter `node_name`.

    Args:
        given: The parameters whose values no file decides: the node itself, a message.
        texts: The names outside of the function that are a text for good.
    """
    parameters = {argument.arg for argument in list_arguments(function.args)}
    stored = {name.id for name in stored_names(function)}
    if node_name in stored:
        return NodeUses()
    local = parameters | stored | nested_names(function)
    chosen = find_chosen(function, node_name, parameters - set(given))
    known = {name: text for name, text in texts.items() if name not in local}
    known |= {n: text for n, text in find_texts(function.body).items() if n not in parameters}
    reader = UseReader(node_name, local, chosen, find_run(function), known)
    for statement in function.body:
        reader.visit(statement)
    return NodeUses(
        tuple(reader.uses),
        tuple(reader.passes),
        frozenset(reader.open_kinds),
        reader.reads_others,
        reader.reaches_ros,
    )
