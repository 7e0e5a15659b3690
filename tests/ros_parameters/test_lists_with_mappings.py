"""A mapping in a list of a parameter file is read as rcl reads it."""

import pytest

from composer.ros_parameters.file_reader import parse_parameter_file

READ = {
    '[{x: 1}]': {'l.x': [1]},
    '[{x: 1}, {y: 2}]': {'l.x.y': [1, 2]},
    '[1, {x: 2}, 3]': {'l.x': [1, 2, 3]},
    '[{x: {y: 1}}]': {'l.x.y': [1]},
    '[{x.q: a}, "b"]': {'l.x.q': ['a', 'b']},
}
REFUSED = [
    *('[{x: 1, y: 2}]', '[{}]', '[{x: 1}, a]', '[{x: }]'),
    # rcl takes these, and loses a part.
    *('[{x: [1]}, {y: [2]}]', '[[{x: a}], b]'),
]
TEXT = 'a:\n  ros__parameters:\n    l: {}\n    after: 3\n'


@pytest.mark.parametrize('text', READ)
def test_what_rcl_reads_is_a_warning(text):
    file = parse_parameter_file(TEXT.format(text), 'p.yaml')
    assert {entry.name: entry.value for entry in file.entries} == READ[text] | {'after': 3}
    assert [finding.rule for finding in file.findings] == ['misread-list']


@pytest.mark.parametrize('text', REFUSED)
def test_what_rcl_refuses_is_an_error(text):
    file = parse_parameter_file(TEXT.format(text), 'p.yaml')
    assert [finding.rule for finding in file.findings] == ['bad-parameter-file']


@pytest.mark.ros
@pytest.mark.usefixtures('domain_id')
@pytest.mark.parametrize('text', READ)
def test_rcl_reads_the_same(tmp_path, text):
    import rclpy

    path = tmp_path / 'p.yaml'
    path.write_text(TEXT.format(text))
    context = rclpy.Context()
    rclpy.init(args=['--ros-args', '--params-file', str(path)], context=context)
    try:
        node = rclpy.create_node(
            'a', context=context, automatically_declare_parameters_from_overrides=True
        )
        read = {name: node.get_parameter(name).value for name in (*READ[text], 'after')}
        node.destroy_node()
    finally:
        context.try_shutdown()
    assert read == READ[text] | {'after': 3}


@pytest.mark.ros
@pytest.mark.parametrize('text', REFUSED[:4])
def test_rcl_refuses_the_same(tmp_path, text):
    import rclpy
    from rclpy._rclpy_pybind11 import RCLError

    path = tmp_path / 'p.yaml'
    path.write_text(TEXT.format(text))
    with pytest.raises(RCLError, match="Couldn't parse params file"):
        rclpy.init(args=['--ros-args', '--params-file', str(path)], context=rclpy.Context())
