"""What is told of a function: its uses of the node, and where it passes the node on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

UseKind: TypeAlias = Literal['publisher', 'service client', 'action client', 'parameter']

ALL_KINDS: frozenset[UseKind] = frozenset(
    ('publisher', 'service client', 'action client', 'parameter')
)


@dataclass(frozen=True, slots=True)
class NodeUse:
    """One use of something by a literal name, as in `node.publish('status', …)`.

    Attributes:
        line: Of the name, counted from 1; `column` likewise.
        length: Of what stands for the name there: itself, or that of a constant.
        is_optional: Whether it copes without: `node.parameters.get('x')`.
        has_default: Whether it brings a value for that case.
        is_certain: Whether it hangs on nothing that a file can decide: on parameters, the node's
            name, or arguments of `with:`.
        is_guarded: Whether an error that it raises is caught.
        waits: Whether the function itself waits for the answer.
    """

    kind: UseKind
    name: str
    line: int
    column: int
    length: int
    is_optional: bool = False
    has_default: bool = False
    is_certain: bool = True
    is_guarded: bool = False
    waits: bool = False


@dataclass(frozen=True, slots=True)
class NodePass:
    """The node is given to a function of the module: `helper(node)`.

    Attributes:
        position: Of the node among the arguments, or the keyword that it is given by.
        is_awaited: Whether a coroutine that it returns is run here.

    The others are as in `NodeUse`, and hold for all that the function does.
    """

    function: str
    position: int | str
    is_certain: bool
    is_guarded: bool
    is_awaited: bool
    waits: bool


@dataclass(frozen=True, slots=True)
class NodeUses:
    """All that a function does with the node.

    Attributes:
        open_kinds: Of what it may use more than `uses` says.
        reads_others: Whether it reads parameters of other nodes.
        reaches_ros: Whether it uses the node of rclpy, and may declare parameters there.
    """

    uses: tuple[NodeUse, ...] = ()
    passes: tuple[NodePass, ...] = ()
    open_kinds: frozenset[UseKind] = ALL_KINDS
    reads_others: bool = False
    reaches_ros: bool = False
