"""What an expression of a behaviour may be, as far as its source tells.

A value is compared by what it says, but for mappings, sequences, objects and functions: these can
be changed, and are the same only if they are one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.records import record

if TYPE_CHECKING:
    import ast
    from collections.abc import Iterable, Iterator

    from composer.interfaces.descriptions import FieldType
    from composer.python_source.modules import ModuleSource
    from composer.python_source.syntax import FunctionNode

# Of more alternatives, nothing is known.
_MOST_ALTERNATIVES = 16
# What shows that another object changes.
_VIEWS: tuple[type, ...] = (type({}.keys()), type({}.values()), type({}.items()))


@record
class Place:
    """An expression or statement of a module."""

    module: ModuleSource
    node: ast.AST


@record
class Unknown:
    """Anything.

    Attributes:
        is_chosen: Whether the file decides on it: `BY_FILE` for an argument under `with:` or the
            name of the node, `BY_PARAMETER` for what may change while the system runs,
            `BY_STATE` for what behaviours keep, which they may have from the file, and `BY_RUN`
            for what goes either way while the system runs, whatever the file says: a message's
            number that is compared with a parameter.
        is_read_only: Whether it is a view of an array in a message that others have, too.
        is_ros: Whether it is `node.ros`.
    """

    is_chosen: int = 0
    is_ros: bool = field(default=False, kw_only=True)
    is_read_only: bool = field(default=False, kw_only=True)


@record
class Constant:
    """A number, a text, bytes, a truth value or `None`.

    Attributes:
        kind: Its type, as 1 and `True` are equal.
        origin: Where it is written.
        is_chosen: As that of `Unknown`.
        member: Of a member of an enumeration, its `Class` and its name there.
    """

    kind: type
    value: Any
    is_chosen: int = 0
    origin: Place | None = field(default=None, compare=False)
    member: Any = field(default=None, compare=False)


@record
class Scalar:
    """A number, text or the like of a type of Python, as in `float`.

    Attributes:
        unset: The parameter that it is, if this is `None` until something sets it.
        pattern: Of a text, the parts that are known, with `ANY` for the others.
    """

    kind: type
    is_chosen: int = 0
    origin: Place | None = field(default=None, compare=False)
    unset: str = ''
    pattern: str = ''


@record
class Message:
    """A message, request, response, goal, result or feedback, by its type's full name.

    Attributes:
        is_made: Whether the behaviour made it, and may have put anything into its fields.
        is_read_only: Whether it is, or is part of, a message that others have, too.
    """

    type: str
    is_made: bool = False
    is_read_only: bool = False


@record
class MessageClass:
    """The class of messages of a type."""

    type: str


@record
class ArrayField:
    """The value of a field that is an array.

    Attributes:
        is_made: As that of `Message`.
        is_read_only: As that of `Message`.
    """

    type: FieldType
    is_made: bool = False
    is_read_only: bool = False


@record
class NodeValue:
    """The node that a behaviour is called with."""


@record
class PartOfNode:
    """`parameters`, `state`, `own_state` or `logger` of the node, and what comes out of it.

    Attributes:
        name: As in `logger`; `goal` is what `send_goal` returns, `time` what `now` returns,
            `changes` what `on_parameters` is given.
        type: Of a goal, its action; `entity` is the action client that sent it.
    """

    name: str
    type: str = ''
    entity: str = ''


@record
class BoundMethod:
    """A method of something, not called yet."""

    owner: Value
    name: str


@record
class External:
    """What an import gives that is not of the project: a module, or something in one."""

    name: str


@record
class Awaitable:
    """A coroutine that has not been awaited."""

    result: Value


@record
class Generated:
    """A generator, by what it yields and what it returns.

    Attributes:
        items: What it yields one after the other, if that is known.
    """

    yielded: Value
    returned: Value
    is_async: bool = False
    items: tuple[Value, ...] | None = None


@dataclass(slots=True, eq=False)
class Mapping:
    """A dictionary.

    Attributes:
        entries: The values by their keys, and where each is written.
        has_unknown: Whether it may have further entries, of which nothing is known.
        depth: On how many conditions it was made.
        others: What it holds under keys that are not known, if it has any.
    """

    entries: dict[object, tuple[Value, Place]]
    has_unknown: bool = False
    depth: int = 0
    is_lost: bool = False
    others: Value | None = None

    @property
    def is_open(self) -> bool:
        """Whether it may have further entries."""
        return self.has_unknown or self.others is not None

    @is_open.setter
    def is_open(self, is_open: bool) -> None:
        self.has_unknown = is_open

    def set_other(self, value: Value) -> None:
        """Store a value under a key that is not known."""
        self.others = value if self.others is None else join([self.others, value])

    def value_of(self, key: Value) -> Value | None:
        """Return what it may hold under a key, `None` if that is nothing."""
        if self.is_lost:
            return UNKNOWN
        if not isinstance(key, Constant):
            return self.any_value()
        held = self.entries.get(key.value)
        found = [*([held[0]] if held else []), *([self.others] if self.others else [])]
        if not held and self.has_unknown:
            return UNKNOWN
        return join(found) if found else None

    def any_value(self) -> Value:
        """Return what any of its entries may hold."""
        if self.is_lost:
            return UNKNOWN
        values = [value for value, _ in self.entries.values()]
        values += [self.others] if self.others else []
        return join([*values, UNKNOWN] if self.has_unknown or not values else values)

    def set(self, key: object, value: Value, place: Place, depth: int) -> None:
        """Store a value; one that is stored on a condition is one of two."""
        before = self.entries.get(key)
        if before is not None and depth > self.depth:
            value = join([before[0], value])
        # Whether one that is stored on a condition is there, is not known.
        self.has_unknown |= before is None and depth > self.depth
        self.entries[key] = (value, place)


@dataclass(slots=True, eq=False)
class Sequence:
    """A list, tuple or set.

    Attributes:
        items: Its items, as far as they are known, and where each is written.
        kind: The type of Python.
        is_open: Whether it may have more or fewer items.
        is_lost: Whether something unknown may have changed it.
    """

    items: list[tuple[Value, Place]]
    kind: type
    is_open: bool = False
    is_lost: bool = False
    origin: Place | None = None

    @property
    def is_whole(self) -> bool:
        """Whether all of its items are known."""
        return not (self.is_open or self.is_lost)

    @property
    def is_fixed(self) -> bool:
        """Whether nothing can change it, but for what is in it."""
        return self.kind in (tuple, frozenset, range)

    @property
    def is_ordered(self) -> bool:
        """Whether its first item comes first, in whatever runs."""
        return self.kind not in (set, frozenset) or len(self.items) < 2  # noqa: PLR2004

    def item_at(self, index: int | None) -> Value:
        """Return what the item at an index may be; `None` for one that is not known."""
        count = len(self.items)
        if index is not None and not self.is_open and -count <= index < count:
            return self.items[index][0]
        return self.item()

    def item(self) -> Value:
        """Return what any of its items may be."""
        if self.is_lost or (self.is_open and not self.items):
            return UNKNOWN
        return join(value for value, _ in self.items) if self.items else UNKNOWN


@dataclass(slots=True, eq=False)
class Function:
    """A function of the project.

    Attributes:
        outer: The `Scope` around it; `None` for the module's own.
        owner: What its first parameter is bound to, if it is a method.
        is_read: Whether a call of it has been followed.
        of: The `Class` that defines it, if it is a method.
        defaults: What those of an inner function were when it was made, by their expressions.
    """

    module: ModuleSource
    definition: FunctionNode | ast.Lambda
    outer: Any = None
    owner: Value | None = None
    is_read: bool = False
    of: Any = None
    defaults: dict[ast.expr, Value] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class Class:
    """A class of the project.

    Attributes:
        outer: The `Scope` around it; `None` for the module's own.
        attributes: What was stored in it later, wherever that was.
        is_open: As that of `Instance`.
    """

    module: ModuleSource
    definition: ast.ClassDef
    outer: Any = None
    attributes: dict[str, Value] = field(default_factory=dict)
    is_open: bool = False


@dataclass(slots=True, eq=False)
class Instance:
    """An object of a class of the project.

    Attributes:
        attributes: What was stored in it, wherever that was.
        is_shared: Whether other behaviours may have it, too.
        doubtful: The attributes that were stored on conditions.
        version: How often what it has changed.
        is_open: Whether something unknown may have stored attributes in it.
        is_unmade: Whether nobody has seen how it was made.
        is_member: Whether it is a member of an enumeration.
        is_no_value: Whether it is one that no field holds: only its `value` may be.
    """

    of: Class
    attributes: dict[str, Value] = field(default_factory=dict)
    is_shared: bool = False
    doubtful: set[str] = field(default_factory=set)
    version: int = 0
    is_open: bool = False
    is_unmade: bool = False
    is_member: bool = False
    is_no_value: bool = False

    def set(self, name: str, value: Value) -> None:
        """Note what an attribute may be."""
        before = self.attributes.get(name)
        self.attributes[name] = value if before is None else join([before, value])
        self.version += before != self.attributes[name]


@record
class Descriptor:
    """What a class stores for `property`, `staticmethod`, `classmethod` or `partialmethod`."""

    kind: str
    function: Value
    setter: Value | None = None


@record
class Super:
    """What `super()` gives: the attributes of an object that come after those of a class."""

    of: Class
    owner: Value


@dataclass(slots=True, eq=False)
class Partial:
    """A function with some of its arguments: `functools.partial`."""

    function: Value
    arguments: Arguments


@record
class ProjectModule:
    """A module of the project."""

    module: ModuleSource


@dataclass(slots=True, eq=False)
class Primitive:
    """Something that threads wait for, such as an event, a queue or a lock; or a thread.

    Attributes:
        kind: The full name of its class.
        origin: Where it is made.
        target: What a thread runs.
        is_lost: Whether something unknown may bring about what is waited for.
    """

    kind: str
    origin: Place
    target: Any = None
    is_lost: bool = False


@record
class Held:
    """A name of `node.state`, of a module, or what is kept there.

    Attributes:
        kind: The class of what is kept; `state` for the name itself, or the file of the module.
    """

    kind: str
    name: str


@record
class Never:
    """What a call gives that always raises.

    Attributes:
        is_again: Whether it is only not known yet: a call of a function in that function.
    """

    is_again: bool = False


@record
class Alternatives:
    """One of several values.

    Attributes:
        is_direct: Whether one expression chooses between them, as in `a if b else c`.
    """

    values: tuple[Value, ...]
    is_direct: bool = field(default=False, compare=False)


@record
class Argument:
    """An argument of a call, and where it is written."""

    value: Value
    place: Place


@record
class Arguments:
    """The arguments of a call.

    Attributes:
        positional: Those by position.
        named: Those by keyword.
        is_open: Whether there are others: `*names`, `**names`.
    """

    positional: tuple[Argument, ...] = ()
    named: tuple[tuple[str, Argument], ...] = ()
    is_open: bool = False

    def get(self, position: int, name: str) -> Argument | None:
        """Return an argument by its position or its name."""
        if position < len(self.positional):
            return self.positional[position]
        return next((each for key, each in self.named if key == name), None)

    def all(self) -> Iterator[Argument]:
        """Yield all arguments."""
        yield from self.positional
        yield from (argument for _, argument in self.named)


Value: TypeAlias = (
    Unknown
    | Constant
    | Scalar
    | Message
    | MessageClass
    | ArrayField
    | NodeValue
    | PartOfNode
    | BoundMethod
    | External
    | Awaitable
    | Generated
    | Mapping
    | Sequence
    | Function
    | Class
    | Instance
    | Descriptor
    | Super
    | Partial
    | ProjectModule
    | Primitive
    | Never
    | Alternatives
)

# Stands in patterns for any characters.
ANY = '\0'
BY_RUN = 1
BY_STATE = 2
BY_FILE = 3
BY_PARAMETER = 4

UNKNOWN = Unknown()
NEVER = Never()
AGAIN = Never(is_again=True)
CHOSEN = Unknown(BY_PARAMETER)
NODE = NodeValue()
NONE = Constant(type(None), None)


def constant(value: object, origin: Place | None = None, *, is_chosen: int = 0) -> Constant:
    """Return the value of a constant."""
    return Constant(type(value), value, is_chosen, origin)


def pattern_of(value: Value) -> str:
    """Return what is known of a text, with `ANY` for the rest."""
    if isinstance(value, Constant) and isinstance(value.value, str | int):
        return str(value.value)
    return getattr(value, 'pattern', '') or ANY


def alternatives(value: Value) -> tuple[Value, ...]:
    """Return what a value may be: several, or itself."""
    return value.values if isinstance(value, Alternatives) else (value,)


def join(values: Iterable[Value], *, like: Value | None = None) -> Value:
    """Return the value that is one of several.

    Args:
        like: Of what they are a part; one expression chooses between them if it does there.
    """
    found: dict[Value, None] = {}
    for value in values:
        found.update(dict.fromkeys(alternatives(value)))
    if len(found) > 1:
        found.pop(NEVER, None)
    if len(found) > 1:
        found.pop(AGAIN, None)
    if len(found) == 1:
        return next(iter(found))
    if not found or len(found) > _MOST_ALTERNATIVES:
        return Unknown(max(map(is_chosen, found), default=0))
    if any(isinstance(value, Unknown) for value in found):
        unknown = Unknown(max(map(is_chosen, found), default=0))
        # Of what may be called, something is known still.
        called = [each for each in found if _is_acting(each)]
        return Alternatives((unknown, *called)) if called else unknown
    return Alternatives(tuple(found), isinstance(like, Alternatives) and like.is_direct)


def _is_acting(value: Value) -> bool:
    if isinstance(value, Instance):
        return not value.is_member
    return isinstance(value, Function | Partial | Class | NodeValue)


def held_by(value: Value) -> list[Value]:
    """Return what can be reached from a value in one step."""
    match value:
        case Alternatives(values=values):
            return list(values)
        case Sequence(items=items):
            return [each for each, _ in items]
        case Mapping():
            return [each for each, _ in value.entries.values()] + [value.others or UNKNOWN]
        case Instance(attributes=attributes) | Class(attributes=attributes):
            return list(attributes.values())
        case BoundMethod(owner=owner) | Super(owner=owner):
            return [owner]
        case Generated(yielded=yielded, returned=returned):
            return [yielded, returned]
        case Awaitable(result=result):
            return [result]
    return []


def share(value: Value) -> None:
    """Note that other behaviours may have the objects in a value, too."""
    pending = [value]
    for each in pending:
        if isinstance(each, Instance) and not each.is_shared:
            each.is_shared = True
            pending += held_by(each)
        elif isinstance(each, Alternatives):
            pending += each.values


def once_set(value: Value) -> Value:
    """Return a value where something has asked for `None`."""
    if isinstance(value, Alternatives):
        return Alternatives(tuple(map(once_set, value.values)), value.is_direct)
    return replace(value, unset='') if isinstance(value, Scalar) and value.unset else value


def before_set(value: Value) -> Value:
    """Return what a parameter is until something sets it."""
    return Scalar(type(None)) if getattr(value, 'unset', '') else value


def is_none(value: Value) -> bool:
    """Return whether a value is `None`, whoever decided on it."""
    return isinstance(value, Constant) and value.value is None


def is_chosen(value: Value) -> int:
    """Return whether the file decides on a value, and how."""
    return max(getattr(each, 'is_chosen', 0) for each in alternatives(value))


def chosen_with(*values: Value) -> int:
    """Return how the file decides on what comes of several values together.

    It has the last word only if all of them are its own, or written in the code: who compares
    what a message says with a parameter does not ask which part the node plays.
    """
    chosen = max(map(is_chosen, values), default=0)
    return BY_RUN if chosen and any(map(_moves, values)) else chosen


def _moves(value: Value) -> bool:
    """Return whether a value comes from outside while the system runs."""
    return all(
        isinstance(each, Unknown | Scalar | ArrayField | PartOfNode) and is_chosen(each) <= BY_RUN
        for each in alternatives(value)
    )


def truth_of(value: Value) -> bool | None:
    """Return whether a value counts as true, `None` if that is not known."""
    found = {_truth_of(each) for each in alternatives(value)}
    return found.pop() if len(found) == 1 else None


def _truth_of(value: Value) -> bool | None:
    match value:
        case Constant():
            return bool(value.value)
        case NodeValue() | MessageClass() | Function() | Class() | BoundMethod() | Partial():
            return True
        case Message() | ProjectModule() | External() | Awaitable():
            return True
        case Mapping() if not value.is_open and not value.is_lost:
            return bool(value.entries)
        case Sequence() if value.is_whole and value.kind not in _VIEWS:
            return bool(value.items)
    return None


def chosen_by(arguments: Arguments) -> int:
    """Return whether the file decides on one of the arguments, and how."""
    values = [argument.value for argument in arguments.all()]
    given = (each.yielded if isinstance(each, Generated) else each for each in values)
    return max(map(is_chosen, given), default=0)
