"""Findings in plain data, found without ROS: the descriptions are written out here."""

import pytest

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.descriptions import FieldDescription, FieldType, MessageDescription
from composer.interfaces.payload_checks import FieldFinding, check_payload

VECTOR = MessageDescription(
    'my_msgs/msg/Vector',
    (FieldDescription('x', FieldType('float64')), FieldDescription('y', FieldType('float64'))),
)
TEXT = MessageDescription('my_msgs/msg/Text', (FieldDescription('data', FieldType('string')),))
EMPTY = MessageDescription('my_msgs/msg/Empty', ())
PATH = MessageDescription(
    'my_msgs/msg/Path',
    (
        FieldDescription(
            'points',
            FieldType('message', nested='my_msgs/msg/Vector', array='unbounded'),
        ),
    ),
)
THING = MessageDescription(
    'my_msgs/msg/Thing',
    (
        FieldDescription('name', FieldType('message', nested='my_msgs/msg/Text')),
        FieldDescription('path', FieldType('message', nested='my_msgs/msg/Path')),
        FieldDescription('level', FieldType('uint8')),
        FieldDescription('limits', FieldType('int8', array='fixed', array_bound=2)),
        FieldDescription('other', FieldType('message', nested='your_msgs/msg/Unknown')),
    ),
)


@pytest.fixture
def catalogue() -> InterfaceCatalogue:
    catalogue = InterfaceCatalogue([])
    for description in (VECTOR, TEXT, PATH):
        catalogue.add(description)
    return catalogue


def test_right_data_has_no_findings(catalogue: InterfaceCatalogue) -> None:
    data = {
        'name': 'a thing',
        'path': [{'x': 1}, {'y': 2.5}, {}],
        'level': 255,
        'limits': [-128, 127],
    }
    assert list(check_payload(THING, data, catalogue)) == []
    assert list(check_payload(THING, {}, catalogue)) == []
    assert list(check_payload(EMPTY, None, catalogue)) == []
    assert list(check_payload(EMPTY, {}, catalogue)) == []


def test_every_finding_is_found_at_its_place_in_the_data(catalogue: InterfaceCatalogue) -> None:
    data = {
        'name': 5,
        'path': {'points': [{'x': 'far'}, 3, {'z': 1, 'y': True}]},
        'levle': 3,
        'level': 256,
        'limits': [1, 128, 2.0],
    }
    assert list(check_payload(THING, data, catalogue)) == [
        FieldFinding(
            ('name',),
            'my_msgs/msg/Thing: name.data: expected string, got int 5',
            'put it in quotes',
            'field-type',
        ),
        FieldFinding(
            ('path', 'points', 0, 'x'),
            "my_msgs/msg/Thing: path.points[0].x: expected float64, got str 'far'",
            None,
            'field-type',
        ),
        FieldFinding(
            ('path', 'points', 1),
            'my_msgs/msg/Thing: path.points[1]: expected my_msgs/msg/Vector, got int 3',
            'give its fields by name: x, y',
            'field-type',
        ),
        FieldFinding(
            ('path', 'points', 2, 'z'),
            "my_msgs/msg/Thing: path.points[2]: my_msgs/msg/Vector has no field 'z'",
            'its fields are x, y',
            'unknown-field',
        ),
        FieldFinding(
            ('path', 'points', 2, 'y'),
            'my_msgs/msg/Thing: path.points[2].y: expected float64, got bool True',
            None,
            'field-type',
        ),
        FieldFinding(
            ('levle',),
            "my_msgs/msg/Thing has no field 'levle'",
            "did you mean 'level'? its fields are name, path, level, limits, other",
            'unknown-field',
        ),
        FieldFinding(
            ('level',),
            'my_msgs/msg/Thing: level: expected uint8 (0 to 255), got int 256',
            None,
            'field-range',
        ),
        FieldFinding(
            ('limits',),
            'my_msgs/msg/Thing: limits: expected int8[2], got 3 items',
            None,
            'field-length',
        ),
        FieldFinding(
            ('limits', 1),
            'my_msgs/msg/Thing: limits[1]: expected int8 (-128 to 127), got int 128',
            None,
            'field-range',
        ),
        FieldFinding(
            ('limits', 2),
            'my_msgs/msg/Thing: limits[2]: expected int8, got float 2.0',
            'write 2',
            'field-type',
        ),
    ]


def test_what_the_catalogue_does_not_describe_is_taken_as_right(
    catalogue: InterfaceCatalogue,
) -> None:
    assert list(check_payload(THING, {'other': {'anything': 1}}, catalogue)) == []
