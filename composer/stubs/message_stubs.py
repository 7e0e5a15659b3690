"""Interface packages as stubs: a class for each message, with its fields and constants.

They describe what rosidl_generator_py generates: keyword-only constructors, a property for each
field, constants of the class, and the parts of services and actions as inner names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.interfaces.descriptions import (
    ActionDescription,
    FieldDescription,
    FieldType,
    MessageDescription,
    ServiceDescription,
)
from composer.stubs.field_types import PAYLOADS, FieldTypes, StubImports, is_writable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.interfaces.catalogue import InterfaceCatalogue, InterfaceKind
    from composer.interfaces.descriptions import InterfaceDescription

_KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')
# What the classes of every service and every action refer to.
_OF_SERVICES = ('service_msgs', 'builtin_interfaces')
_OF_ACTIONS = (*_OF_SERVICES, 'action_msgs', 'unique_identifier_msgs')

_UUID = FieldDescription('goal_id', FieldType('message', 'unique_identifier_msgs/msg/UUID'))
_TIME = FieldType('message', 'builtin_interfaces/msg/Time')
_EVENT_INFO = FieldType('message', 'service_msgs/msg/ServiceEventInfo')
# The parts of an action as `Action.Impl` names them.
_IMPL = (
    ('SendGoalService', '{}_SendGoal'),
    ('GetResultService', '{}_GetResult'),
    ('FeedbackMessage', '{}_FeedbackMessage'),
)
_COMMON_IMPL = (
    ('CancelGoalService', 'action_msgs/srv/CancelGoal'),
    ('GoalStatusMessage', 'action_msgs/msg/GoalStatusArray'),
)


def write_packages(
    packages: Iterable[str], catalogue: InterfaceCatalogue
) -> Iterator[tuple[str, list[str]]]:
    """Yield the path and the lines of each stub of packages, and of those that they use.

    Packages that do not exist are left out.
    """
    done: set[str] = set()
    pending = [*packages]
    while pending:
        package = pending.pop()
        if package in done:
            continue
        done.add(package)
        names = [name for kind in _KINDS for name in catalogue.names(kind, package)]
        interfaces = {name: catalogue.describe(name) for name in names}
        if interfaces:
            pending += _used_packages(interfaces)
            yield from _write_package(package, interfaces)


def _write_package(
    package: str, interfaces: Mapping[str, InterfaceDescription | None]
) -> Iterator[tuple[str, list[str]]]:
    yield f'{package}/__init__.pyi', []
    for kind in _KINDS:
        of_kind = {
            name: interfaces[name] for name in interfaces if name.startswith(f'{package}/{kind}/')
        }
        if of_kind:
            lines = [*_write_interfaces(f'{package}.{kind}', of_kind)]
            yield f'{package}/{kind}/__init__.pyi', lines
    messages = [
        message for each in interfaces.values() if each is not None for message in each.parts
    ]
    yield f'composer_stubs/payloads/{package}.pyi', [*_write_payloads(package, messages)]


def _used_packages(interfaces: Mapping[str, InterfaceDescription | None]) -> Iterator[str]:
    for interface in interfaces.values():
        if interface is None:
            continue
        yield from {'srv': _OF_SERVICES, 'action': _OF_ACTIONS}.get(
            interface.name.split('/')[1], ()
        )
        for message in _list_messages(interface):
            for field in message.fields:
                if field.type.nested is not None:
                    yield field.type.nested.partition('/')[0]


def _list_messages(interface: InterfaceDescription) -> Iterator[MessageDescription]:
    """Yield all messages of an interface, with those that ROS adds to services and actions."""
    if isinstance(interface, ServiceDescription):
        yield from interface.parts
        yield _describe_event(interface)
    elif isinstance(interface, ActionDescription):
        yield from interface.parts
        for service in _inner_services(interface):
            yield from _list_messages(service)
        feedback = FieldDescription('feedback', FieldType('message', interface.feedback.name))
        yield MessageDescription(f'{interface.name}_FeedbackMessage', (_UUID, feedback))
    else:
        yield interface


def _write_interfaces(
    module: str, interfaces: Mapping[str, InterfaceDescription | None]
) -> Iterator[str]:
    """Yield the lines of the stub of a module with interfaces, such as `std_msgs.msg`."""
    imports = StubImports(module)
    classes = [
        line
        for name, interface in interfaces.items()
        for line in _write_interface(name, interface, imports)
    ]
    imports.take('typing', 'Any')
    yield from imports.lines()
    yield from classes


def _describe_event(service: ServiceDescription) -> MessageDescription:
    parts = {'request': service.request.name, 'response': service.response.name}
    fields = (
        FieldDescription(name, FieldType('message', part, None, 'bounded', 1))
        for name, part in parts.items()
    )
    return MessageDescription(
        f'{service.name}_Event', (FieldDescription('info', _EVENT_INFO), *fields)
    )


def _inner_services(action: ActionDescription) -> Iterator[ServiceDescription]:
    goal = FieldDescription('goal', FieldType('message', action.goal.name))
    result = FieldDescription('result', FieldType('message', action.result.name))
    accepted = FieldDescription('accepted', FieldType('bool'))
    status = FieldDescription('status', FieldType('int8'))
    answers = {
        'SendGoal': ((_UUID, goal), (accepted, FieldDescription('stamp', _TIME))),
        'GetResult': ((_UUID,), (status, result)),
    }
    for name, (request, response) in answers.items():
        full_name = f'{action.name}_{name}'
        yield ServiceDescription(
            full_name,
            MessageDescription(f'{full_name}_Request', request),
            MessageDescription(f'{full_name}_Response', response),
        )


def _write_interface(
    name: str, interface: InterfaceDescription | None, imports: StubImports
) -> Iterator[str]:
    if interface is None:
        yield from ('', f'{_last(name)}: {imports.take("typing", "Any")}')
        return
    for message in _list_messages(interface):
        yield from _write_message(message, imports)
    if isinstance(interface, ServiceDescription):
        yield from _write_service(interface.name, imports)
    elif isinstance(interface, ActionDescription):
        yield from _write_action(interface, imports)


def _write_message(message: MessageDescription, imports: StubImports) -> Iterator[str]:
    fields = [field for field in message.fields if is_writable(field.name)]
    constants = [constant.name for constant in message.constants]
    names = frozenset([*constants, *(field.name for field in fields)])
    types = FieldTypes(imports, names)
    text, anything = types.word('str'), imports.take('typing', 'Any')
    yield from ('', f'class {_last(message.name)}:')
    if message.comment:
        yield f'    {" ".join(message.comment.split())!r}'
    of_class = imports.take('typing', 'ClassVar')
    for constant in filter(lambda each: is_writable(each.name), message.constants):
        yield f'    {constant.name}: {of_class}[{types.read(constant.type)}]'
    yield f'    SLOT_TYPES: {of_class}[tuple[{anything}, ...]]'
    yield '    def __init__('
    yield '        self,'
    yield '        *,'
    yield from (f'        {field.name}: {types.write(field.type)} = ...,' for field in fields)
    yield f'        check_fields: {types.word("bool")} | None = ...,'
    yield '    ) -> None: ...'
    for field in fields:
        yield f'    @{types.word("property")}'
        yield f'    def {field.name}(self) -> {types.read(field.type)}:'
        yield f'        {" ".join(field.comment.split())!r}' if field.comment else '        ...'
        yield f'    @{field.name}.setter'
        yield f'    def {field.name}(self, value: {types.write(field.type)}) -> None: ...'
        if field.default is not None:
            yield f'    {field.name.upper()}__DEFAULT: {of_class}[{types.read(field.type)}]'
    yield '    @classmethod'
    yield f'    def get_fields_and_field_types(cls) -> dict[{text}, {text}]: ...'


def _write_service(name: str, imports: StubImports) -> Iterator[str]:
    last, alias = _last(name), imports.take('typing', 'TypeAlias')
    yield from ('', f'class {last}:')
    yield from (
        f'    {part}: {alias} = {last}_{part}' for part in ('Request', 'Response', 'Event')
    )


def _write_action(action: ActionDescription, imports: StubImports) -> Iterator[str]:
    for service in _inner_services(action):
        yield from _write_service(service.name, imports)
    last, alias = _last(action.name), imports.take('typing', 'TypeAlias')
    yield from ('', f'class {last}:')
    yield from (f'    {part}: {alias} = {last}_{part}' for part in ('Goal', 'Result', 'Feedback'))
    yield '    class Impl:'
    yield from (f'        {name}: {alias} = {form.format(last)}' for name, form in _IMPL)
    yield from (
        f'        {name}: {alias} = {imports.message(full)}' for name, full in _COMMON_IMPL
    )


def _last(name: str) -> str:
    return name.rpartition('/')[2]


def _write_payloads(package: str, messages: Iterable[MessageDescription]) -> Iterator[str]:
    """Yield the lines of a stub with what may be given for a package's messages.

    A payload is a message, a mapping of fields, or the bare value of a message with one field. A
    mapping is a `TypedDict`: `Mapping[str, Any]` would take any key. So one that is built in steps
    is declared as the `TypedDict`, or as `Any`.
    """
    imports = StubImports(f'{PAYLOADS}.{package}')
    lines = [line for message in messages for line in _write_payload(message, imports)]
    yield from imports.lines()
    yield from lines


def _write_payload(message: MessageDescription, imports: StubImports) -> Iterator[str]:
    types = FieldTypes(imports, frozenset(field.name for field in message.fields))
    last = _last(message.name)
    message_class = imports.message(message.name)
    # A mapping names the fields of the message itself, so a bare value for its one field is none.
    values = [message_class, f'{imports.support("ToMsg")}[{message_class}]']
    if not message.fields:
        values.append('None')
    if len(message.fields) == 1:
        values.append(types.bare(message.fields[0].type))
    alias = imports.take('typing', 'TypeAlias')
    yield from ('', f'{last}Value: {alias} = {" | ".join(values)}')
    if all(is_writable(field.name) for field in message.fields):
        typed_dict = imports.take('typing', 'TypedDict')
        yield f'class {last}Fields({typed_dict}, total=False):'
        if not message.fields:
            yield '    pass'
        for field in message.fields:
            yield f'    {field.name}: {types.payload(field.type)}'
    else:
        anything = imports.take('typing', 'Any')
        yield f'{last}Fields: {alias} = {imports.take("typing", "Mapping")}[str, {anything}]'
    yield f'{last}: {alias} = {last}Value | {last}Fields'
