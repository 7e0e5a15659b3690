"""Records that describe ROS interfaces: messages, services and actions with their fields.

They have the content of the definition files (`.msg`, `.srv`, `.action`), in the same order,
wherever a description comes from, and need neither ROS nor any message package.

See https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html for the notation.
"""

from typing import Literal, TypeAlias

from composer.records import record

ArrayKind: TypeAlias = Literal['fixed', 'bounded', 'unbounded']


@record
class FieldType:
    """The type of a field; `str()` of it is in `.msg` notation, such as `string<=10[<=3]`.

    Attributes:
        kind: `bool`, `byte`, `char`, `int8` to `uint64`, `float32`, `float64`, `string`,
            `wstring`, or `message`. A `char` is a `uint8` by another name, and installed packages
            describe it as that.
        nested: full name of the message, such as `geometry_msgs/msg/Point`, of kind `message`.
        string_bound: greatest length of a bounded string.
        array: kind of array, or None for a single value.
        array_bound: number of items of a fixed array, greatest number of a bounded one.
    """

    kind: str
    nested: str | None = None
    string_bound: int | None = None
    array: ArrayKind | None = None
    array_bound: int | None = None

    @property
    def item(self) -> 'FieldType':
        """The type of one item of an array; of a single value, its own type."""
        if self.array is None:
            return self
        return FieldType(self.kind, self.nested, self.string_bound)

    def __str__(self) -> str:
        """Write the type as a `.msg` file does."""
        name = self.nested or self.kind
        bound = '' if self.string_bound is None else f'<={self.string_bound}'
        match self.array:
            case None:
                return f'{name}{bound}'
            case 'fixed':
                return f'{name}{bound}[{self.array_bound}]'
            case 'bounded':
                return f'{name}{bound}[<={self.array_bound}]'
            case 'unbounded':
                return f'{name}{bound}[]'


@record
class FieldDescription:
    """One field of a message.

    Attributes:
        name: as behaviours and payloads spell it.
        type: what it holds.
        default: the default value of the definition as a Python value (a tuple for an array), or
            None where the definition gives none.
        comment: the definition's comment on it.
    """

    name: str
    type: FieldType
    default: object | None = None
    comment: str = ''


@record
class ConstantDescription:
    """One constant of a message."""

    name: str
    type: FieldType
    value: object
    comment: str = ''


@record
class MessageDescription:
    """A message, or one part of a service or an action.

    Attributes:
        name: full name, such as `std_msgs/msg/String` or `std_srvs/srv/SetBool_Request`.
        fields: in the order of the definition; none for an empty message: the placeholder
            `structure_needs_at_least_one_member` of the generators is left out.
        constants: in the order of the definition; none if the description comes without them.
        comment: the definition's comment on the whole.
    """

    name: str
    fields: tuple[FieldDescription, ...]
    constants: tuple[ConstantDescription, ...] = ()
    comment: str = ''

    @property
    def parts(self) -> 'tuple[MessageDescription, ...]':
        """The messages that a definition file defines, in its order: just this one."""
        return (self,)

    def field(self, name: str) -> FieldDescription | None:
        """Return the field of a name, or None."""
        return next((field for field in self.fields if field.name == name), None)


@record
class ServiceDescription:
    """A service, such as `std_srvs/srv/SetBool`."""

    name: str
    request: MessageDescription
    response: MessageDescription
    comment: str = ''

    @property
    def parts(self) -> tuple[MessageDescription, ...]:
        """Request and response."""
        return (self.request, self.response)


@record
class ActionDescription:
    """An action, such as `example_interfaces/action/Fibonacci`."""

    name: str
    goal: MessageDescription
    result: MessageDescription
    feedback: MessageDescription
    comment: str = ''

    @property
    def parts(self) -> tuple[MessageDescription, ...]:
        """Goal, result and feedback."""
        return (self.goal, self.result, self.feedback)


InterfaceDescription: TypeAlias = MessageDescription | ServiceDescription | ActionDescription
