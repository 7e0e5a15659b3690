"""What was read in a behaviour: what it uses of its node, and what is wrong in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.entity_kinds import USED_KINDS
from composer.records import record

if TYPE_CHECKING:
    from composer.diagnostics import Span
    from composer.inference.values import Constant, Held, Primitive, Value
    from composer.python_source.modules import ModuleSource

# What a behaviour waits for when it uses an entity.
Waited: TypeAlias = Literal['', 'answer', 'end']
# What behaviours wait for, and bring about.
Awaited: TypeAlias = 'Primitive | Held'
# The nouns of the kinds of entity that behaviours use by name, as in `service client`.
USED_NOUNS = frozenset(kind.noun for kind in USED_KINDS)
# The methods of the node that create an entity, the noun of its kind, and the position of its
# behaviour, if it has one.
CREATING_METHODS = {
    'create_publisher': ('publisher', None),
    'create_subscription': ('subscription', 2),
    'create_timer': ('timer', 1),
    'create_service': ('service', 2),
    'create_client': ('service client', None),
}
# The methods of the node that send something, and the noun of what they use by its name.
SENDING_METHODS = {
    'publish': 'publisher',
    'call': 'service client',
    'call_async': 'service client',
    'send_goal': 'action client',
}


@record
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
        waits: What the behaviour itself waits for, whatever else the file says: the answer, or
            the end of the goal.
        among: The names of which it is one, if one of several is used.
        is_guess: Whether the running system may give it another name.
        is_change: Whether it is looked for among the changes of `on_parameters`.
    """

    kind: str
    name: str
    place: Span
    is_optional: bool = False
    has_default: bool = False
    is_certain: bool = True
    is_guarded: bool = False
    waits: Waited = ''
    is_change: bool = False
    among: tuple[str, ...] = ()
    is_guess: bool = False


@record
class CreatedEntity:
    """An entity that a behaviour creates: `node.create_publisher(…)`.

    Attributes:
        kind: The noun of its kind.
        name: The name by which behaviours use it; `None` for one that is not known.
        channel: The name of its topic or service, as it is given; `None` for any.
        type: The full name of its type; `None` for any.
        type_place: Where the type is written.
    """

    kind: str
    name: str | None
    channel: str | None
    type: str | None
    type_place: Span | None


@record
class Problem:
    """Something wrong in a behaviour, whatever its node declares.

    Attributes:
        rule: The name of the rule that it breaks.
        place: Where it is written.
        used_at: Where it is used, if that is elsewhere.
    """

    rule: str
    message: str
    place: Span
    help: str | None = None
    used_at: Span | None = None


@record
class StateUse:
    """A name of `node.state` or `node.own_state` that is read.

    Attributes:
        is_guarded: Whether the behaviour does something about one that is not there.
    """

    name: str
    place: Span
    is_guarded: bool = False


@record
class RemoteParameter:
    """A parameter that `node.set_parameters` or `node.get_parameters` names.

    Attributes:
        node: The name of its node; `node_place` is where it is written.
        value: What it is set to, if the code shows it, and where.
    """

    node: str
    node_place: Span
    name: str
    place: Span
    value: Constant | None
    value_place: Span
    is_certain: bool


@record
class Block:
    """A wait for something that another behaviour has to bring about, without an end.

    Attributes:
        related: What else has to do with it, and where.
    """

    what: Awaited
    place: Span
    related: tuple[tuple[str, Span], ...] = ()


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
        needs_values: Whether it hangs on the values of parameters, or on the node's name.
        mentioned: Texts that something unknown is given, and may use as names.
        modules: The modules that it needs.
        own_state_read: What it reads of `node.own_state`; `own_state_set` and `is_own_state_open`
            are as those of `state`.
        state_tested: The names that it asks for with `hasattr`.
        unpublished: Where it gives away payloads that nothing publishes.
        kept: What it keeps in `node.state`, and as `[name]` in `node.own_state`.
        kept_by_file: The names of those of these that it has from the file, or keeps where the
            file says so.
        needs_state: Whether it hangs on what is kept in the state.
        kept_read: The names of what it reads of these.
        remote_parameters: Parameters of nodes that it sets or reads by their names.
        blocks: What it waits for without an end.
        fills: What it brings about that others may wait for, and whether it does so itself: what
            it starts may do so, too.
        asked: What it asks first, as in `queue.empty()`.
        sleeps: How long it sleeps, in seconds, where, and where that is written.
        created: The entities that it creates.
    """

    uses: list[NodeUse] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    open_kinds: set[str] = field(default_factory=set)
    reads_others: bool = False
    reaches_ros: bool = False
    state_read: list[StateUse] = field(default_factory=list)
    state_set: set[str] = field(default_factory=set)
    is_state_open: bool = False
    mentioned: set[str] = field(default_factory=set)
    modules: dict[int, ModuleSource] = field(default_factory=dict)
    needs_values: bool = False
    own_state_read: list[StateUse] = field(default_factory=list)
    own_state_set: set[str] = field(default_factory=set)
    is_own_state_open: bool = False
    state_tested: set[str] = field(default_factory=set)
    unpublished: list[Span] = field(default_factory=list)
    kept: dict[str, Value] = field(default_factory=dict)
    kept_by_file: set[str] = field(default_factory=set)
    needs_state: bool = False
    kept_read: set[str] = field(default_factory=set)
    remote_parameters: list[RemoteParameter] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    fills: dict[Awaited, set[bool]] = field(default_factory=dict)
    asked: set[Awaited] = field(default_factory=set)
    sleeps: list[tuple[float, Span, Span]] = field(default_factory=list)
    created: list[CreatedEntity] = field(default_factory=list)

    def open_all(self) -> None:
        """Note that the node was given to something unknown."""
        self.open_kinds |= USED_NOUNS
        self.reads_others = self.reaches_ros = self.is_state_open = True
        self.is_own_state_open = True

    def settle(self) -> None:
        """Forget what was noted twice."""
        self.blocks = list(dict.fromkeys(self.blocks))
        self.created = list(dict.fromkeys(self.created))
        self.sleeps = list(dict.fromkeys(self.sleeps))
        self.uses = list(dict.fromkeys(self.uses))
        self.problems = list(dict.fromkeys(self.problems))
        self.own_state_read = list(dict.fromkeys(self.own_state_read))
        self.state_read = list(dict.fromkeys(self.state_read))


def unknown_reading() -> Reading:
    """Return the reading of a behaviour whose source is not known."""
    reading = Reading()
    reading.open_all()
    return reading


def missing_reading() -> Reading:
    """Return the reading of a behaviour that does not exist, which another check reports."""
    return Reading(open_kinds=set(USED_NOUNS), is_state_open=True, is_own_state_open=True)
