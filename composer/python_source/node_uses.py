"""Records of what a function does with its node."""

from __future__ import annotations

from dataclasses import dataclass

from composer.entity_kinds import USED_KINDS

# The nouns of the kinds of entity that behaviours use by name, as in `service client`.
USED_NOUNS = frozenset(kind.noun for kind in USED_KINDS)


@dataclass(frozen=True, slots=True)
class NodeUse:
    """A use of an entity by a literal name, as in `node.publish('status', …)`.

    Attributes:
        kind: The noun of the entity's kind.
        line: The line of the name, counted from 1; `column` likewise.
        length: The length of the name, or of the constant that holds it.
        is_optional: Whether the function works without it: `node.parameters.get('x')`.
        has_default: Whether the function has a value to use without it.
        is_certain: Whether it happens whatever the file says: it does not depend on parameters,
            the node's name, or arguments under `with:`.
        is_guarded: Whether the function catches the error that it raises.
        waits: Whether the function itself waits for the answer.
    """

    kind: str
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
    """A call that passes the node to a function of the module: `helper(node)`.

    Attributes:
        position: The position of the node among the arguments, or its keyword.
        is_awaited: Whether the returned coroutine is awaited here.

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
    """All that a function does with its node.

    Attributes:
        open_kinds: The kinds of which it may use more than `uses` lists.
        reads_others: Whether it reads parameters of other nodes.
        reaches_ros: Whether it uses the node of rclpy, and may declare parameters there.
    """

    uses: tuple[NodeUse, ...] = ()
    passes: tuple[NodePass, ...] = ()
    open_kinds: frozenset[str] = USED_NOUNS
    reads_others: bool = False
    reaches_ros: bool = False
