"""Expressions that make messages of others, before there are any."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  filter:
    publishers: {{out: {{type: geometry_msgs/msg/TwistStamped, external: true}}}}
    subscriptions:
      heard:
        type: {heard}
        external: true
        behaviour: behaviours.topics:transform
        publish: out
        with:
          fields:
            {fields}
"""


def findings(fields, heard='nav_msgs/msg/Odometry'):
    text = SYSTEM.format(fields=fields, heard=heard).lstrip()
    return [
        (each.rule, each.span.text, each.message, each.help)
        for each in check_system(load_system_text(text), InterfaceCatalogue())
    ]


@pytest.mark.parametrize(
    ('fields', 'rule', 'part', 'message', 'help_text'),
    [
        (
            'header.frme_id: child_frame_id',
            'unknown-field',
            'header.frme_id',
            "std_msgs/msg/Header has no field 'frme_id'",
            "did you mean 'frame_id'? its fields are stamp, frame_id",
        ),
        (
            'twist.linear.x.y: 1',
            'unknown-field',
            'twist.linear.x.y',
            "'x' of geometry_msgs/msg/Vector3 is float64, and has no fields",
            None,
        ),
        (
            'twist.linear.x: psoe.pose.position.x',
            'undefined-name',
            'psoe',
            "'psoe' is not defined",
            "did you mean 'pose'?",
        ),
        (
            'twist.linear.x: -message.pose.pose.positon.x',
            'unknown-field',
            'positon',
            "geometry_msgs/msg/Pose has no field 'positon'",
            "did you mean 'position'? its fields are position, orientation",
        ),
        (
            'twist.linear.x: message.SOME_CONSTANT',
            'unknown-field',
            'SOME_CONSTANT',
            "nav_msgs/msg/Odometry has no field 'SOME_CONSTANT'",
            'its fields are header, child_frame_id, pose, twist',
        ),
        (
            'twist.linear.x: "[pose.covariance[0] | rond(2), 1] | max"',
            'bad-expression',
            'rond',
            "there is no filter 'rond'",
            "did you mean 'round'?",
        ),
        (
            'twist.linear.x: child_frame_id',
            'field-type',
            'child_frame_id',
            'geometry_msgs/msg/Vector3: x: expected float64, got string',
            None,
        ),
        (
            'twist.linear: pose.pose.orientation',
            'field-type',
            'pose.pose.orientation',
            'geometry_msgs/msg/Twist: linear: expected geometry_msgs/msg/Vector3, got '
            'geometry_msgs/msg/Quaternion',
            None,
        ),
        (
            'header.stamp.nanosec: 5000000000',
            'field-range',
            '5000000000',
            'builtin_interfaces/msg/Time: nanosec: expected uint32 (0 to 4294967295), got int '
            '5000000000',
            None,
        ),
    ],
)
def test_what_cannot_work_is_a_finding(fields, rule, part, message, help_text):
    assert findings(fields) == [(rule, part, message, help_text)]


@pytest.mark.parametrize(
    'fields',
    [
        'header: header',
        'twist: twist.twist',
        'twist.linear.x: 2',
        'twist.linear.x: nothing | default(0)',
        'twist.linear.x: 1 if nothing is defined else 2',
        'header.frame_id: child_frame_id.upper()',
        'twist.linear: twist.twist.angular',
        'header.stamp: header.stamp',
        'header.stamp.sec: header.stamp.nanosec * 1000',
        'header.frame_id: header.frame_id ~ header.stamp.sec',
        'header.frame_id: child_frame_id.split("/")[3] or "odom"',
        'twist.linear.x: (pose.covariance * 2) | sum',
        'twist.linear.x: "([pose.pose, twist.twist] | map(attribute=\'position\') | first).x"',
        'twist.linear.x: (child_frame_id and pose.pose.position.x) or 0',
    ],
)
def test_what_may_work_has_no_finding(fields):
    assert findings(fields) == []


@pytest.mark.parametrize(
    ('name', 'help_text'),
    [
        ('STATUS_FIX', None),
        ('STATUS_FXI', "did you mean 'STATUS_FIX'?"),
        ('SERVICE', "did you mean 'service'?"),
    ],
)
def test_constants_are_known_by_their_names(name, help_text):
    found = findings(f'header.stamp.sec: message.{name}', 'sensor_msgs/msg/NavSatStatus')
    assert [each[3] for each in found] == [help_text] * (help_text is not None)
