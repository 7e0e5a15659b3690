"""Type hashes (RIHS01), computed from descriptions.

Two nodes can talk if their types' hashes agree. The rules are those of REP-2016 and of
`rosidl_generator_type_description`, which writes them into the code that it generates.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import TypeAlias

from composer.interfaces.descriptions import (
    ActionDescription,
    FieldDescription,
    FieldType,
    InterfaceDescription,
    MessageDescription,
    ServiceDescription,
)

Fields: TypeAlias = tuple[FieldDescription, ...]

# type_description_interfaces/msg/FieldType; char is a uint8 in IDL.
_TYPE_IDS = {
    'message': 1,
    'int8': 2,
    'uint8': 3,
    'char': 3,
    'int16': 4,
    'uint16': 5,
    'int32': 6,
    'uint32': 7,
    'int64': 8,
    'uint64': 9,
    'float32': 10,
    'float64': 11,
    'bool': 15,
    'byte': 16,
    'string': 17,
    'wstring': 18,
}
_BOUNDED_STRING_OFFSET = 4
_ARRAY_OFFSETS = {None: 0, 'fixed': 48, 'bounded': 96, 'unbounded': 144}

# IDL knows no empty structure, so rosidl_adapter puts this field into one.
_NOTHING = FieldDescription('structure_needs_at_least_one_member', FieldType('uint8'))


def spread_interface(interface: InterfaceDescription) -> dict[str, Fields]:
    """List all structures that an interface stands for, by full name.

    A service has its event beside request and response, an action its two services and its
    feedback message (rosidl_parser.definition); a message is just itself.
    """
    match interface:
        case MessageDescription():
            return {interface.name: interface.fields or (_NOTHING,)}
        case ServiceDescription():
            return dict(
                _spread_service(
                    interface.name,
                    interface.request.fields,
                    interface.response.fields,
                )
            )
        case ActionDescription():
            return dict(_spread_action(interface))


def hash_type(name: str, structures: Mapping[str, Fields]) -> str:
    """Compute the type hash of a structure.

    Args:
        name: its full name.
        structures: the fields of it and of all that it consists of, by full name.

    Returns:
        such as `RIHS01_df66...`.
    """
    used: set[str] = set()
    waiting = [name]
    while waiting:
        for field in structures[waiting.pop()]:
            nested = field.type.nested
            if nested is not None and nested not in used:
                used.add(nested)
                waiting.append(nested)
    text = json.dumps(
        {
            'type_description': _describe(name, structures[name]),
            'referenced_type_descriptions': [_describe(n, structures[n]) for n in sorted(used)],
        }
    )
    return f'RIHS01_{hashlib.sha256(text.encode()).hexdigest()}'


def _describe(name: str, fields: Fields) -> dict[str, object]:
    return {
        'type_name': name,
        'fields': [{'name': field.name, 'type': _describe_type(field.type)} for field in fields],
    }


def _describe_type(field_type: FieldType) -> dict[str, object]:
    type_id = _TYPE_IDS[field_type.kind] + _ARRAY_OFFSETS[field_type.array]
    if field_type.string_bound is not None:
        type_id += _BOUNDED_STRING_OFFSET
    return {
        'type_id': type_id,
        'capacity': field_type.array_bound or 0,
        'string_capacity': field_type.string_bound or 0,
        'nested_type_name': field_type.nested or '',
    }


def _spread_service(name: str, request: Fields, response: Fields) -> Iterator[tuple[str, Fields]]:
    yield f'{name}_Request', request or (_NOTHING,)
    yield f'{name}_Response', response or (_NOTHING,)
    yield (
        f'{name}_Event',
        (
            _message('info', 'service_msgs/msg/ServiceEventInfo'),
            _at_most_one('request', f'{name}_Request'),
            _at_most_one('response', f'{name}_Response'),
        ),
    )
    yield (
        name,
        (
            _message('request_message', f'{name}_Request'),
            _message('response_message', f'{name}_Response'),
            _message('event_message', f'{name}_Event'),
        ),
    )


def _spread_action(action: ActionDescription) -> Iterator[tuple[str, Fields]]:
    name = action.name
    goal_id = _message('goal_id', 'unique_identifier_msgs/msg/UUID')
    for part, message in (
        ('Goal', action.goal),
        ('Result', action.result),
        ('Feedback', action.feedback),
    ):
        yield f'{name}_{part}', message.fields or (_NOTHING,)
    yield from _spread_service(
        f'{name}_SendGoal',
        (goal_id, _message('goal', f'{name}_Goal')),
        (
            FieldDescription('accepted', FieldType('bool')),
            _message('stamp', 'builtin_interfaces/msg/Time'),
        ),
    )
    yield from _spread_service(
        f'{name}_GetResult',
        (goal_id,),
        (
            FieldDescription('status', FieldType('int8')),
            _message('result', f'{name}_Result'),
        ),
    )
    yield f'{name}_FeedbackMessage', (goal_id, _message('feedback', f'{name}_Feedback'))
    yield (
        name,
        (
            _message('goal', f'{name}_Goal'),
            _message('result', f'{name}_Result'),
            _message('feedback', f'{name}_Feedback'),
            _message('send_goal_service', f'{name}_SendGoal'),
            _message('get_result_service', f'{name}_GetResult'),
            _message('feedback_message', f'{name}_FeedbackMessage'),
        ),
    )


def _message(name: str, nested: str) -> FieldDescription:
    return FieldDescription(name, FieldType('message', nested))


def _at_most_one(name: str, nested: str) -> FieldDescription:
    return FieldDescription(name, FieldType('message', nested, array='bounded', array_bound=1))
