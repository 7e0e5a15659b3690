from typing import Any

import pytest

from composer.interfaces.descriptions import (
    ActionDescription,
    FieldDescription,
    FieldType,
    MessageDescription,
    ServiceDescription,
)
from composer.interfaces.type_descriptions import TypeDescriptionError, parse_type_description


def field(name: str, number: int, **others: Any) -> dict[str, Any]:
    default = others.pop('default', '')
    described = {'type_id': number, 'capacity': 0, 'string_capacity': 0, 'nested_type_name': ''}
    return {'name': name, 'type': {**described, **others}, 'default_value': default}


def document(name: str, *fields: dict[str, Any], parts: tuple[str, ...] = ()) -> dict[str, Any]:
    return {
        'type_description_msg': {
            'type_description': {'type_name': name, 'fields': list(fields)},
            'referenced_type_descriptions': [
                {'type_name': f'{name}_{part}', 'fields': [field(part.lower(), 6)]}
                for part in parts
            ],
        },
    }


def types_of(*fields: dict[str, Any]) -> list[str]:
    described = parse_type_description(document('my_msgs/msg/All', *fields))
    assert isinstance(described, MessageDescription)
    return [str(each.type) for each in described.fields]


def test_every_number_of_a_single_value_has_its_name() -> None:
    assert types_of(*(field('f', number) for number in (*range(2, 12), 15, 16, 17, 18))) == [
        'int8',
        'uint8',
        'int16',
        'uint16',
        'int32',
        'uint32',
        'int64',
        'uint64',
        'float32',
        'float64',
        'bool',
        'byte',
        'string',
        'wstring',
    ]


def test_bounds_and_arrays_are_read() -> None:
    assert types_of(
        field('a', 21, string_capacity=10),
        field('b', 22, string_capacity=10),
        field('c', 11 + 48, capacity=36),
        field('d', 21 + 96, capacity=3, string_capacity=10),
        field('e', 3 + 144),
        field('f', 1 + 144, nested_type_name='geometry_msgs/msg/Point'),
    ) == [
        'string<=10',
        'wstring<=10',
        'float64[36]',
        'string<=10[<=3]',
        'uint8[]',
        'geometry_msgs/msg/Point[]',
    ]


@pytest.mark.parametrize(
    ('described', 'default'),
    [
        (field('f', 17, default='007'), '007'),
        (field('f', 17), None),
        (field('f', 6, default='-50'), -50),
        (field('f', 11, default='1.125'), 1.125),
        (field('f', 15, default='True'), True),
        (field('f', 50, capacity=3, default='(0, 127, -128)'), (0, 127, -128)),
        (field('f', 161, default="('', 'max value')"), ('', 'max value')),
    ],
)
def test_default_values_are_python_values(described: dict[str, Any], default: object) -> None:
    message = parse_type_description(document('my_msgs/msg/All', described))
    assert isinstance(message, MessageDescription)
    assert message.fields[0].default == default
    assert type(message.fields[0].default) is type(default)


def test_the_placeholder_of_an_empty_message_is_no_field() -> None:
    placeholder = field('structure_needs_at_least_one_member', 3)
    described = parse_type_description(document('my_msgs/msg/Empty', placeholder))
    assert described == MessageDescription('my_msgs/msg/Empty', ())


def test_services_and_actions_have_their_parts() -> None:
    def part(name: str, field_name: str) -> MessageDescription:
        return MessageDescription(name, (FieldDescription(field_name, FieldType('int32')),))

    service = document('my_msgs/srv/Ask', parts=('Request', 'Response', 'Event'))
    assert parse_type_description(service) == ServiceDescription(
        'my_msgs/srv/Ask',
        part('my_msgs/srv/Ask_Request', 'request'),
        part('my_msgs/srv/Ask_Response', 'response'),
    )
    action = document('my_msgs/action/Go', parts=('Goal', 'Result', 'Feedback', 'SendGoal'))
    assert parse_type_description(action) == ActionDescription(
        'my_msgs/action/Go',
        part('my_msgs/action/Go_Goal', 'goal'),
        part('my_msgs/action/Go_Result', 'result'),
        part('my_msgs/action/Go_Feedback', 'feedback'),
    )


@pytest.mark.parametrize('number', [0, 13, 20, 48, 14 + 144, 3 + 192])
def test_a_type_that_definitions_do_not_have_is_refused(number: int) -> None:
    with pytest.raises(TypeDescriptionError):
        types_of(field('f', number))


@pytest.mark.parametrize(
    'content',
    [
        {},
        {'type_description_msg': []},
        {'type_description_msg': {'type_description': {'type_name': 5, 'fields': []}}},
        document('Nameless'),
        document('my_msgs/srv/Ask', parts=('Request',)),
        document('my_msgs/msg/All', field('f', 6, default='not a number (')),
    ],
)
def test_a_document_of_another_shape_is_refused(content: dict[str, Any]) -> None:
    with pytest.raises(TypeDescriptionError):
        parse_type_description(content)
