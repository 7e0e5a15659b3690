"""What a behaviour uses of its node, what is wrong in it, and the types around it."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.entity_kinds import PUBLISHED, USED_KINDS
from composer.language.specs import SubscriptionSpec
from composer.node_uses.names import Texts
from composer.records import record

if TYPE_CHECKING:
    import ast
    from collections.abc import Callable, Iterator

    from composer.diagnostics import Related, Span
    from composer.language.bindings import Binding
    from composer.language.specs import EndSpec, NodeSpec
    from composer.node_uses.names import Chain, Made, Names, Scope, Value
    from composer.python_source.modules import ModuleSource

# What a behaviour waits for when it uses an entity.
Waited: TypeAlias = Literal['', 'answer', 'end']
# The nouns of the kinds of entity that behaviours use by name, as in `service client`.
USED_NOUNS = frozenset(kind.noun for kind in USED_KINDS)
# The methods of the node that create an entity, and the noun of its kind.
CREATING_METHODS = {
    'create_publisher': 'publisher',
    'create_subscription': 'subscription',
    'create_timer': 'timer',
    'create_service': 'service',
    'create_client': 'service client',
}
# The methods of the node that send something, and the noun of what they use by its name.
SENDING_METHODS = {
    'publish': 'publisher',
    'call': 'service client',
    'call_async': 'service client',
    'send_goal': 'action client',
}
# All methods by whose first arguments code may name something of the node.
NAMING_METHODS = frozenset({*CREATING_METHODS, *SENDING_METHODS, 'get', 'setdefault', 'update'})


@record
class NodeUse:
    """A use of something of the node by its name, as in `node.publish('status', …)`.

    Attributes:
        kind: The noun of the entity's kind; `state` or `own_state` for a name that is read there.
        is_optional: Whether the behaviour works without it: `node.parameters.get('x')`.
        has_default: Whether the behaviour has a value to use without it.
        is_certain: Whether it happens whatever else the file says: it does not depend on
            parameters, the node's name, or arguments under `with:`.
        is_guarded: Whether the behaviour catches the error that it raises.
        waits: What the behaviour itself waits for, whatever else the file says: the answer, or
            the end of the goal.
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


@record
class CreatedEntity:
    """An entity that a behaviour creates: `node.create_publisher(…)`.

    Attributes:
        kind: The noun of its kind.
        name: The name by which behaviours use it; like what follows, `None` if it is not known.
        channel: The name of its topic or service.
        type: The full name of its type.
    """

    kind: str
    name: str | None
    channel: str | None
    type: str | None
    type_place: Span | None


@record
class Problem:
    """Something wrong in a behaviour, whatever its node declares."""

    rule: str
    message: str
    place: Span
    help: str | None = None
    related: tuple[Related, ...] = ()


@record
class NeededValue:
    """A parameter or state that has to have a value.

    Attributes:
        of: `parameters` or `state`.
        held: The names of the state on which alone it depends: they have to hold.
    """

    of: str
    name: str
    place: Span
    held: tuple[str, ...] = ()


@record
class RemoteParameter:
    """A parameter that `node.set_parameters` or `node.get_parameters` names.

    Attributes:
        node: The name of its node, empty for the behaviour's own; `node_place` is where it is
            written.
        value: What it is set to, if the code shows it; else `None`.
    """

    node: str
    node_place: Span
    name: str
    place: Span
    value: object
    value_place: Span


@record
class Awaited:
    """What threads wait for: an object that a module or class makes, or a name of the state.

    Attributes:
        kind: The class of the object, as in `threading.Event`; empty for a name itself.
        owner: The file and the place of the object; `state` for a name of the state.
    """

    kind: str
    owner: str
    name: str
    made_at: Span | None = field(default=None, compare=False)


@record
class Block:
    """A wait for something that another behaviour has to bring about, without an end.

    Attributes:
        called_at: Where the behaviour calls what waits, if it does not wait itself.
    """

    what: Awaited
    place: Span
    called_at: Span | None = None


@record
class Payload:
    """A payload in the code.

    Attributes:
        section: The section of the entity that sends it; empty for one that the behaviour yields
            or returns.
        name: The name of this entity; or `yielded` or `returned`.
        part: The part of the type that it becomes, as in `_Request`.
        is_certain: As of a `NodeUse`.
    """

    section: str
    name: str
    part: str
    value: ast.expr
    module: ModuleSource
    is_certain: bool


@record
class MessageUse:
    """An attribute or item of the message that a behaviour is given.

    Attributes:
        path: The names and indices that lead to it: `('poses', '[0]', 'position')`.
        of_type: The type of a message that the code makes; `None` for the one that is given.
        is_certain: Whether the file does not decide on it.
        value: What is stored there.
    """

    path: tuple[str, ...]
    node: ast.expr | ast.keyword
    module: ModuleSource
    is_write: bool = False
    is_certain: bool = True
    of_type: str | None = None
    value: ast.expr | None = None


@record
class Passed:
    """What a function of the project is given; `None` for something that is not known."""

    definition: ast.AST
    given: dict[str, Value | None]
    is_call: bool


@dataclass(slots=True)
class Reading:
    """All that is known of what a behaviour does.

    Attributes:
        open_kinds: The kinds of which it may use more.
        reads_others: Whether it may read parameters of other nodes.
        reaches_ros: Whether it uses the node of rclpy, and may declare parameters there.
        is_state_open: Whether it may set other names of `node.state` than those of `state_set`.
        state_tested: The names that it asks for with `hasattr`.
        unpublished: Where it gives away payloads that nothing publishes.
        blocks: What it waits for without an end.
        fills: What it brings about that others may wait for, and whether it does so itself: what
            it starts may do so, too.
        asked: What it asks first, as in `queue.empty()`.
        compared: The parameters that it compares with texts, each with the text and its place.
        sleeps: How long it sleeps, in seconds, and where.
        passed: What the functions are given that it runs.
        unresolved: Attributes, items and calls of what may be the node, or not.
    """

    uses: list[NodeUse] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    open_kinds: set[str] = field(default_factory=set)
    reads_others: bool = False
    reaches_ros: bool = False
    state_read: list[NodeUse] = field(default_factory=list)
    state_set: dict[str, Span] = field(default_factory=dict)
    is_state_open: bool = False
    state_tested: set[str] = field(default_factory=set)
    own_state_read: list[NodeUse] = field(default_factory=list)
    own_state_set: set[str] = field(default_factory=set)
    is_own_state_open: bool = False
    modules: dict[int, ModuleSource] = field(default_factory=dict)
    unpublished: list[Span] = field(default_factory=list)
    remote_parameters: list[RemoteParameter] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    fills: dict[Awaited, set[bool]] = field(default_factory=dict)
    asked: set[Awaited] = field(default_factory=set)
    sleeps: list[tuple[float, Span]] = field(default_factory=list)
    created: list[CreatedEntity] = field(default_factory=list)
    payloads: list[Payload] = field(default_factory=list)
    message_uses: list[MessageUse] = field(default_factory=list)
    values_needed: list[NeededValue] = field(default_factory=list)
    compared: list[tuple[str, str, Span]] = field(default_factory=list)
    passed: list[Passed] = field(default_factory=list)
    unresolved: list[ast.AST] = field(default_factory=list)

    def open_all(self) -> None:
        """Note that the node was given to something unknown."""
        self.open_kinds |= USED_NOUNS
        self.reads_others = self.reaches_ros = self.is_state_open = True
        self.is_own_state_open = True


def missing_reading() -> Reading:
    """Return the reading of a behaviour that does not exist, which another check reports."""
    return Reading(open_kinds=set(USED_NOUNS), is_state_open=True, is_own_state_open=True)


def unknown_reading() -> Reading:
    """Return the reading of a behaviour whose source is not known."""
    return replace(missing_reading(), reads_others=True, reaches_ros=True)


@record
class Wire:
    """The types of what a behaviour gets and of what it gives; `None` for none, or unknown.

    Attributes:
        given: The type of its second argument.
        aborted: The type of the result with which an action aborts a goal.
        is_unpublished: Whether nothing publishes what it gives, although `publish:` could.
        needs_payload: Whether a response has to be returned.
        is_read_only: Whether others have what it is given, too.
    """

    given: str | None = None
    yielded: str | None = None
    returned: str | None = None
    aborted: str | None = None
    needs_payload: bool = False
    is_unpublished: bool = False
    is_read_only: bool = False


def wire_of(node: NodeSpec, binding: Binding, has_real_type: Callable[[EndSpec], bool]) -> Wire:
    """Return the types around a behaviour of a node."""
    kind, key = binding.kind, binding.key
    if kind is None or binding.entity is None:
        return Wire()
    own = type_in(node, kind.section, binding.entity.name, has_real_type) if kind.channel else None
    published = getattr(binding.entity, 'publish', None) if kind.publishes else None
    sent = type_in(node, 'publishers', published, has_real_type) if published else None

    def type_of(part: str | None) -> str | None:
        if part == PUBLISHED:
            return sent
        if part is None or own is None:
            return None
        return f'{own}_{part}' if part else own

    return Wire(
        given=None if getattr(binding.entity, 'raw', False) else type_of(key.given),
        yielded=type_of(key.yielded),
        returned=type_of(key.returned),
        aborted=type_of(key.returned) if kind.channel == 'action' else None,
        needs_payload=key.returned not in (None, PUBLISHED),
        is_unpublished=key.returned == PUBLISHED and published is None,
        is_read_only=isinstance(binding.entity, SubscriptionSpec) and binding.entity.read_only,
    )


def type_in(
    node: NodeSpec, section: str, name: str, has_real_type: Callable[[EndSpec], bool]
) -> str | None:
    """Return the type of an entity; `None` if there is none, or none that is known."""
    entity: Any = getattr(node, section).get(name)
    return entity.type if entity is not None and has_real_type(entity) else None


class Run:
    """What all parts of a reading share.

    Attributes:
        doubts: The number of conditions before the place on which the file decides.
        branches: Those of them that it is on a branch of.
        state_doubts: Likewise, on which what is kept in the state does.
        held_states: The names of the state of which one of the latter is that they hold.
        fixed: Those of the first that hang on a constant, a type or the node's name.
        kinds: Those of these that it is on a branch of.
        guards: The number of statements around it that catch what a wrong name raises, and of
            those branches.
        broad_guards: The number of statements around it that catch everything.
        held_locks: The locks that are held, and the lines where they were taken.
        calls: Where the functions under way are called.
    """

    def __init__(self, names: Names) -> None:
        self.names = names
        self.reading = Reading()
        self.doubts = 0
        self.branches = 0
        self.state_doubts = 0
        self.fixed = 0
        self.kinds = 0
        self.held_states: tuple[str, ...] = ()
        self.guards = 0
        self.broad_guards = 0
        self.held_locks: list[tuple[Made, int]] = []
        self.calls: list[Span] = []

    @property
    def is_certain(self) -> bool:
        """Whether what is used at the place has to be there."""
        return not (self.doubts or self.state_doubts or self.broad_guards)

    @property
    def standing(self) -> tuple[int, int, int, tuple[str, ...]]:
        """The conditions that a function may leave behind."""
        return self.doubts, self.state_doubts, self.fixed, self.held_states

    @standing.setter
    def standing(self, conditions: tuple[int, int, int, tuple[str, ...]]) -> None:
        self.doubts, self.state_doubts, self.fixed, self.held_states = conditions

    @contextmanager
    def condition(self, chosen: str, held: str = '') -> Iterator[None]:
        """Note what is read meanwhile as read on a condition of the file, or the state.

        What hangs on a constant, a type or the name of the node may be for another case.
        """
        before = self.standing
        self.doubt(chosen, held)
        is_of_file = chosen in ('file', 'fixed')
        self.branches += is_of_file
        self.kinds += chosen == 'fixed'
        with self.guard(is_guard=chosen == 'fixed'):
            yield
        self.kinds -= chosen == 'fixed'
        self.branches -= is_of_file
        self.standing = before

    def doubt(self, chosen: str, held: str = '') -> None:
        """Note a condition from here on."""
        self.held_states += (held,) if held else ()
        self.doubts += chosen in ('file', 'fixed')
        self.state_doubts += chosen == 'state'
        self.fixed += chosen == 'fixed'

    @contextmanager
    def guard(self, *, is_guard: bool, is_broad: bool = False) -> Iterator[None]:
        """Note what is read meanwhile as guarded, if it is."""
        self.guards += is_guard
        self.broad_guards += is_broad
        yield
        self.guards -= is_guard
        self.broad_guards -= is_broad

    def report(
        self, rule: str, module: ModuleSource, node: ast.AST, message: str, help_text: str | None
    ) -> None:
        """Note a problem, unless the behaviour is ready for it.

        It is one in any system, so where only the file decides whether the place is reached, too.
        """
        if not (self.guards or self.broad_guards):
            problem = Problem(rule, message, module.span_of(node), help_text)
            self.reading.problems.append(problem)

    def use(
        self,
        kind: str,
        value: Value | None,
        *,
        waits: Waited = '',
        is_optional: bool = False,
        has_default: bool = False,
        is_change: bool = False,
    ) -> None:
        """Note the use of an entity by its name; of one that is not known, any may be used."""
        if not isinstance(value, Texts):
            self.reading.open_kinds.add(kind)
            return
        is_one = len(value.options) == 1
        for name, node, module in value.options:
            use = NodeUse(
                kind,
                name,
                module.span_of(node, name),
                is_optional,
                has_default,
                self.is_certain and is_one,
                bool(self.guards),
                waits if is_one else '',
                is_change,
            )
            self.reading.uses.append(use)

    def ask(
        self, kind: str, value: Value | None, *, has_default: bool = True, is_change: bool = False
    ) -> None:
        """Note the use of something without which the behaviour works as well."""
        self.use(kind, value, is_optional=True, has_default=has_default, is_change=is_change)

    def use_state(self, name: str, module: ModuleSource, node: ast.expr) -> None:
        """Note that a name of `node.state` is read."""
        is_guarded = bool(self.guards or self.doubts or self.state_doubts)
        use = NodeUse('state', name, module.span_of(node, name), is_guarded=is_guarded)
        self.reading.state_read.append(use)

    def set_state(self, name: str, scope: Scope, node: ast.expr) -> None:
        """Note that a name of `node.state` is set."""
        self.reading.state_set.setdefault(name, scope.module.span_of(node, name))
        self.fill(Awaited('', 'state', name), scope)

    def fill(self, what: Awaited, scope: Scope) -> None:
        """Note that something is brought about, by the behaviour or beside it."""
        self.reading.fills.setdefault(what, set()).add(scope.waits)

    def escape(self, chain: Chain) -> None:
        """Note that the node, or a part of it, is given to something unknown."""
        reading = self.reading
        match chain.path:
            case ('node',):
                reading.open_all()
            case ('node', 'parameters') | ('changes',):
                reading.open_kinds.add('parameter')
            case ('node', 'publishers', *_):
                reading.open_kinds.add('publisher')
            case ('node', 'state'):
                reading.is_state_open = True
            case ('node', 'own_state'):
                reading.is_own_state_open = True
            case ('node', 'get_parameters'):
                reading.reads_others = True
            case ('node', method) if method in SENDING_METHODS:
                reading.open_kinds.add(SENDING_METHODS[method])
            case ('node', method) if method in CREATING_METHODS:
                created = CreatedEntity(CREATING_METHODS[method], None, None, None, None)
                reading.created.append(created)
