"""The logger of a node takes any level and options from one line of code."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
nodes: {talker: {on_start: 'parts:begin'}}
"""
CODE = """\
from composer import Node

TEXT = 'a\\x1b[31mred\\x1b]52;c;eA==\\x07\\x9b2J\\u202e\\ud800\\n[ERROR] [1.0] [other]: forged\\n\\tb\\r\\n\\nc'
LEVELS = 'debug', 'info', 'warning', 'warn', 'error', 'fatal'


def say(log, text, **options):
    log(text, **options)


def begin(node: Node) -> None:
    for logger in (node.logger, node.ros.get_logger(), node.logger.get_child('part')):
        logger.error(TEXT)
        for round in range(2):
            for level in LEVELS:
                say(getattr(logger, level), f'{logger.name} {level} {round}')
            for severity in (20, 30):
                logger.log(f'{logger.name} severity {severity} {round}', severity)
    for round in range(3):
        for options in ({'once': True}, {'skip_first': True}, {'throttle_duration_sec': 99}, {}):
            say(node.logger.info, f'with {list(options)} {round}', **options)
"""


def test_levels_and_options_may_change_from_call_to_call(compose):
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    for name in ('talker', 'talker.part'):
        for text in ('info', 'warning', 'warn', 'error', 'fatal', 'severity 20', 'severity 30'):
            for number in range(2):
                assert child.matching(f'[{name}]: {name} {text} {number}'), child.output
    assert not child.matching('debug')
    for option, heard in (
        ("'once'", [0]),
        ("'skip_first'", [1, 2]),
        ("'throttle_duration_sec'", [0]),
        ('', [0, 1, 2]),
    ):
        for number in range(3):
            lines = child.matching(f'with [{option}] {number}')
            assert len(lines) == (number in heard), child.output
    # A text forges no line, and of it a terminal obeys colours only.
    shown = 'a\x1b[31mred\\x1b]52;c;eA==\\x07\\x9b2J\\u202e\\ud800\x1b[0m'
    rest = '\n  [ERROR] [1.0] [other]: forged\n  \tb\\r\n\n  c\n'
    for name in ('talker', 'talker.part'):
        assert f'[{name}]: {shown}{rest}' in child.output
    assert child.stop() == 0
