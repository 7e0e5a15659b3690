"""What was read in a behaviour: what it uses of its node, and what is wrong in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.entity_kinds import USED_KINDS

if TYPE_CHECKING:
    from composer.diagnostics import Span

# The nouns of the kinds of entity that behaviours use by name, as in `service client`.
USED_NOUNS = frozenset(kind.noun for kind in USED_KINDS)


@dataclass(frozen=True, slots=True)
class NodeUse:
    """A use of an entity of the node by its name, as in `node.publish('status', …)`.

    Attributes:
        kind: The noun of the entity's kind.
        place: Where the name is written.
        is_optional: Whether the behaviour works without it: `node.parameters.get('x')`.
        has_default: Whether the behaviour has a value to use without it.
        is_certain: Whether it happens whatever else the file says: it does not depend on
            parameters, the node's name, or arguments under `with:`.
        is_guarded: Whether the behaviour catches the error that it raises.
        waits: Whether the behaviour itself waits for the answer.
    """

    kind: str
    name: str
    place: Span
    is_optional: bool = False
    has_default: bool = False
    is_certain: bool = True
    is_guarded: bool = False
    waits: bool = False


@dataclass(frozen=True, slots=True)
class Problem:
    """Something wrong in a behaviour, whatever its node declares.

    Attributes:
        rule: The name of the rule that it breaks.
        place: Where it is written.
    """

    rule: str
    message: str
    place: Span
    help: str | None = None


@dataclass(frozen=True, slots=True)
class StateUse:
    """A name of `node.state` that is read.

    Attributes:
        is_guarded: Whether the behaviour does something about one that is not there.
    """

    name: str
    place: Span
    is_guarded: bool = False


@dataclass(frozen=True, slots=True)
class ParameterSet:
    """A parameter that is set by its name, of a node by its name."""

    node: str
    name: str
    place: Span


@dataclass(slots=True)
class Reading:
    """All that is known of what a behaviour does.

    Attributes:
        uses: What it uses of its node.
        problems: What is wrong in it.
        open_kinds: The kinds of which it may use more.
        reads_others: Whether it may read parameters of other nodes.
        reaches_ros: Whether it uses the node of rclpy, and may declare parameters there.
        state_read: What it reads of `node.state`.
        state_set: The names that it sets there.
        is_state_open: Whether it may set others.
        state_tested: The names that it asks for with `hasattr`.
        parameters_set: What it sets with `node.set_parameters`.
    """

    uses: list[NodeUse] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    open_kinds: set[str] = field(default_factory=set)
    reads_others: bool = False
    reaches_ros: bool = False
    state_read: list[StateUse] = field(default_factory=list)
    state_set: set[str] = field(default_factory=set)
    is_state_open: bool = False
    state_tested: set[str] = field(default_factory=set)
    parameters_set: list[ParameterSet] = field(default_factory=list)

    def open_all(self) -> None:
        """Note that the node was given to something unknown."""
        self.open_kinds |= USED_NOUNS
        self.reads_others = self.reaches_ros = self.is_state_open = True

    def settle(self) -> None:
        """Forget what was noted twice."""
        self.uses = list(dict.fromkeys(self.uses))
        self.problems = list(dict.fromkeys(self.problems))
        self.state_read = list(dict.fromkeys(self.state_read))


def unknown_reading() -> Reading:
    """Return the reading of a behaviour whose source is not known."""
    reading = Reading()
    reading.open_all()
    return reading
