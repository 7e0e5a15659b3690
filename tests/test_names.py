"""Names by ROS's rules: what is allowed, what they come to, and what was probably meant."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from composer.names import (
    expand_name,
    expand_namespace,
    find_namespace_problem,
    find_node_name_problem,
    find_parameter_name_problem,
    find_topic_name_problem,
    remap_name,
)

NODE = 'rover'
NAMESPACES = ['/', '/fleet', '/fleet/first']


def is_topic_of_ros(name, namespace):
    """Return whether rclpy takes a name as that of a topic of a node."""
    from rclpy.exceptions import NameValidationException
    from rclpy.expand_topic_name import expand_topic_name
    from rclpy.validate_full_topic_name import validate_full_topic_name
    from rclpy.validate_topic_name import validate_topic_name

    try:
        validate_topic_name(name)
        validate_full_topic_name(expand_topic_name(name, NODE, namespace))
    except (NameValidationException, ValueError):
        return False
    return True


def is_topic_here(name, namespace):
    return not (
        find_topic_name_problem(name)
        or find_topic_name_problem(expand_name(name, NODE, namespace))
    )


def is_valid_of_ros(validate, name):
    from rclpy.exceptions import NameValidationException

    try:
        return validate(name)
    except NameValidationException:
        return False


def agree_on_topic(name, namespace):
    # ROS makes '/fleet/roverx' of '~x'; nobody means that.
    tilde_alone = name[:1] == '~' and name[1:2] not in ('', '/')
    assert is_topic_here(name, namespace) == (is_topic_of_ros(name, namespace) and not tilde_alone)
    if is_topic_here(name, namespace):
        from rclpy.expand_topic_name import expand_topic_name

        assert expand_name(name, NODE, namespace) == expand_topic_name(name, NODE, namespace)


fragments = st.sampled_from(
    ['a', 'B', '_', '1', '/', '/', '~', '~/', '{node}', '{ns}', '{namespace}', '{x}', '{', '}', '-',
     ' ', 'é', '.', '\n']
)  # fmt: skip
generated = st.lists(fragments, max_size=7).map(''.join)


@pytest.mark.ros
@settings(max_examples=150, deadline=None, derandomize=True)
@given(generated, st.sampled_from(NAMESPACES))
@example('a' * 240, '/fleet')
@example('a' * 248, '/')
@example('a__b', '/')
def test_any_topic_is_named_as_rclpy_has_it(name, namespace):
    agree_on_topic(name, namespace)


@pytest.mark.ros
@settings(max_examples=100, deadline=None, derandomize=True)
@given(generated)
@example('a' * 255)
@example('a' * 256)
@example('')
@example('1a')
def test_any_node_is_named_as_rclpy_has_it(name):
    from rclpy.validate_node_name import validate_node_name

    assert (find_node_name_problem(name) is None) == is_valid_of_ros(validate_node_name, name)


@pytest.mark.ros
@settings(max_examples=100, deadline=None, derandomize=True)
@given(generated.map('/{}'.format))
@example('/')
@example('/' + 'a' * 244)
@example('/' + 'a' * 245)
def test_any_namespace_is_as_rclpy_has_it(name):
    from rclpy.validate_namespace import validate_namespace

    assert (find_namespace_problem(name) is None) == is_valid_of_ros(validate_namespace, name)


RULES = [
    [('scan', 'front')],
    [('scan', '/front')],
    [('scan', '~/front')],
    [('/fleet/scan', 'front')],
    [('/scan', '/front')],
    [('~/scan', 'front')],
    [('scan', 'first'), ('scan', 'second')],
    [('scan', '/a'), ('/a', '/b')],
    [('rostopic://scan', 'front')],
    [('rosservice://scan', 'front')],
    [('rostopic:///fleet/scan', 'front')],
    [('rosservice://scan', 'a'), ('scan', 'b')],
    [('other', 'front')],
    [],
]
NAMES = ['scan', '/scan', '/fleet/scan', '~/scan', 'a/scan', '~', '{node}/scan']


@pytest.mark.ros
@pytest.mark.parametrize('rules', RULES, ids=str)
def test_names_are_remapped_as_rclpy_has_it(rules, context):
    import rclpy

    namespace = '/fleet'
    arguments = [part for old, new in rules for part in ('-r', f'{old}:={new}')]
    node = rclpy.create_node(
        NODE,
        namespace=namespace,
        context=context,
        cli_args=['--ros-args', *arguments],
        use_global_arguments=False,
        start_parameter_services=False,
    )
    try:
        for name in NAMES:
            full = expand_name(name, NODE, namespace)
            for scheme, resolve in (
                ('rostopic', node.resolve_topic_name),
                ('rosservice', node.resolve_service_name),
            ):
                assert remap_name(full, rules, NODE, namespace, scheme) == resolve(name)
    finally:
        node.destroy_node()


@pytest.mark.parametrize(
    ('name', 'finding'),
    [
        ('', 'a topic name is not empty'),
        ('a b', "a topic name has only letters, digits, underscores, slashes, and '~/' first"),
        ('a/', 'a topic name does not end with a slash'),
        ('a//b', 'a topic name has no two slashes in a row'),
        ('a/1', 'no part of a topic name begins with a digit'),
        ('a/~', "'~' is only allowed at the start of a topic name, before a slash"),
        ('{node', 'a topic name has a brace without its partner'),
        ('{x}', "'{x}' is no substitution of ROS: {node}, {ns}, {namespace}"),
        ('a' * 248, 'a topic name has at most 247 characters'),
    ],
)
def test_a_wrong_topic_says_what_is_wrong(name, finding):
    assert find_topic_name_problem(name) == finding


@pytest.mark.parametrize(
    ('name', 'finding'),
    [
        ('', 'a node name is not empty'),
        ('a/b', 'a node name has only letters, digits and underscores'),
        ('front-camera', 'a node name has only letters, digits and underscores'),
        ('1a', 'a node name does not begin with a digit'),
        ('a' * 256, 'a node name has at most 255 characters'),
    ],
)
def test_a_wrong_node_says_what_is_wrong(name, finding):
    assert find_node_name_problem(name) == finding


@pytest.mark.parametrize(
    ('name', 'finding'),
    [
        ('a-b', 'a namespace has only letters, digits, underscores and slashes'),
        ('/a/', 'a namespace does not end with a slash'),
        ('a//b', 'a namespace has no two slashes in a row'),
        ('/1a', 'no part of a namespace begins with a digit'),
        ('a' * 245, 'a namespace has at most 245 characters'),
    ],
)
def test_a_wrong_namespace_says_what_is_wrong(name, finding):
    assert find_namespace_problem(name) == finding


@pytest.mark.parametrize(
    ('name', 'finding'),
    [
        ('speed', None),
        ('wheels.front.radius', None),
        ('qos_overrides./scan.depth', None),
        ('', 'a parameter name is not empty'),
        ('a..b', 'a parameter name has no empty part between its dots'),
        ('.a', 'a parameter name has no empty part between its dots'),
        ('a.', 'a parameter name has no empty part between its dots'),
        ('a b', 'a parameter name has no spaces'),
    ],
)
def test_parameters_have_names_in_parts(name, finding):
    assert find_parameter_name_problem(name) == finding


@pytest.mark.parametrize(
    ('namespace', 'default', 'full'),
    [
        ('', '/', '/'),
        ('a', '/', '/a'),
        ('a', '/b', '/b/a'),
        ('/a', '/b', '/a'),
        ('', '/b', '/b'),
    ],
)
def test_a_relative_namespace_lies_in_the_default(namespace, default, full):
    assert expand_namespace(namespace, default) == full
