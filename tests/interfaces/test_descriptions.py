import pytest

from composer.interfaces.descriptions import FieldDescription, FieldType, MessageDescription


@pytest.mark.parametrize(
    ('field_type', 'text'),
    [
        (FieldType('bool'), 'bool'),
        (FieldType('float64', array='fixed', array_bound=36), 'float64[36]'),
        (FieldType('uint8', array='unbounded'), 'uint8[]'),
        (FieldType('int8', array='bounded', array_bound=3), 'int8[<=3]'),
        (FieldType('string', string_bound=10), 'string<=10'),
        (
            FieldType('string', string_bound=10, array='bounded', array_bound=3),
            'string<=10[<=3]',
        ),
        (
            FieldType('message', nested='geometry_msgs/msg/Point', array='unbounded'),
            'geometry_msgs/msg/Point[]',
        ),
    ],
)
def test_a_type_is_written_as_in_a_definition(field_type: FieldType, text: str) -> None:
    assert str(field_type) == text


def test_an_item_of_an_array_has_its_type_without_the_array() -> None:
    names = FieldType('string', string_bound=10, array='bounded', array_bound=3)
    assert names.item == FieldType('string', string_bound=10)
    assert names.item.item == names.item


def test_fields_are_found_by_name() -> None:
    x = FieldDescription('x', FieldType('float64'))
    y = FieldDescription('y', FieldType('float64'), default=1.0)
    point = MessageDescription('my_msgs/msg/Point', (x, y))
    assert point.field('y') is y
    assert point.field('z') is None
