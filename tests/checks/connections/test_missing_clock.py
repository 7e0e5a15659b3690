"""Nodes with `use_sim_time` in a system where nothing can publish `/clock`."""

import pytest

SIMULATED = '  n: {use_sim_time: true, on_start: parts:begin%s}\n'
CLOCK = 'rosgraph_msgs/msg/Clock'


@pytest.mark.ros
@pytest.mark.parametrize(
    ('keys', 'others', 'code', 'is_missing'),
    [
        ('', '', 'pass', True),
        ('', f'  m: {{publishers: {{/clock: {CLOCK}}}, on_start: parts:say}}\n', 'pass', False),
        ('', f'  m: {{publishers: {{clock: {CLOCK}}}, namespace: a, on_start: parts:say}}\n', 'pass', True),
        ('', 'processes: {sim: {command: [sleep, "1"]}}\n', 'pass', False),
        ('', 'processes: {sim: {command: [sleep, "1"], when: false}}\n', 'pass', False),
        (', wait_for: {topic: /clock}', '', 'pass', False),
        ('', '', f"node.create_publisher('{CLOCK}', '/clock')", False),
        ('', '', "node.create_publisher('std_msgs/msg/String', node.state.topic)", True),
    ],
)  # fmt: skip
def test_a_clock_that_nobody_publishes_is_found_where_that_is_certain(
    check, tmp_path, keys, others, code, is_missing
):
    (tmp_path / 'no_time.yaml').write_text('n: {ros__parameters: {use_sim_time: false}}')
    code = f'def begin(node):\n    {code}\n\n\ndef say(node):\n    node.publish("clock", {{}})\n'
    found = check(SIMULATED % keys + others, code, rule='no-clock')
    assert len(found) == is_missing
