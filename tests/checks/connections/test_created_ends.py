"""What behaviours create counts as an end where the code shows it, and may be one where not."""

import pytest

NODES = """\
  maker:
    parameters: {source: far}
    on_start: parts:begin
  other:
    subscriptions:
      words: {type: std_msgs/msg/String, behaviour: 'parts:hear'}
    publishers: {replies: std_msgs/msg/String}
    timers: {say: {rate: 1, publish: replies, message: {data: x}}}
"""


@pytest.mark.parametrize(
    ('lines', 'found'),
    [
        ('pass', [(7, 'no-publisher'), (8, 'no-subscription')]),
        ("node.create_publisher(String, 'words')", [(8, 'no-subscription')]),
        ("node.create_subscription(String, 'replies', hear)", [(7, 'no-publisher')]),
        (
            'node.create_publisher(String, node.parameters.source, name="out")\n'
            '    node.publish("out", "x")',
            [(8, 'no-subscription')],
        ),
        (
            'for i in range(3):\n        node.create_publisher(String, compute(i))',
            [(8, 'no-subscription')],
        ),
        (
            "node.create_publisher('words')",
            [(7, 'no-publisher'), (8, 'no-subscription'), (8, 'bad-call')],
        ),
    ],
)
def test_created_ends(check, lines, found):
    code = f"""\
from std_msgs.msg import Int32, String
import time


def compute(number):
    return f'{{time.time()}}{{number}}'


def begin(node):
    {lines}


def hear(node, message):
    pass
"""
    assert sorted(rule for _, rule in check(NODES, code) if rule != 'unused-parameter') == sorted(
        rule for _, rule in found
    )
