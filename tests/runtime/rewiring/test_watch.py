"""`composer up --watch`: what edits do to a system that runs, as its user sees it."""

import signal
import time

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import Int64

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
executor: {shutdown_timeout: 1}
nodes:
  counter:
    parameters: {step: 1}
    state: {count: 0}
    publishers: {count: {type: std_msgs/msg/Int64, external: true}}
    timers:
      tick: {period: 0.02, behaviour: parts:tick, publish: count}
  talker:
    publishers: {words: std_msgs/msg/String}
    timers:
      say: {period: 0.05, behaviour: parts:say, publish: words}
  listener:
    subscriptions:
      words: {type: std_msgs/msg/String, behaviour: parts:hear}
"""
CODE = """\
import time

WORD = 'one'


def tick(node):
    node.state.count += node.parameters.step
    return node.state.count


def say(node):
    node.own_state['said'] = node.own_state.get('said', 0) + 1
    return f'{WORD} {node.own_state["said"]}'


def hear(node, message):
    node.logger.info(f'heard {message.data}')


def fail(node):
    raise OSError('no such device')


def hang(node):
    time.sleep(100)
"""


@pytest.fixture
def running(compose):
    child = compose(SYSTEM, CODE, '--watch')
    child.wait_until_ready()
    return Edited(compose.folder, child)


class Edited:
    """A running system, and edits of its files."""

    def __init__(self, folder, child):
        self.folder = folder
        self.child = child
        self._reloads = 0

    def edit(self, old, new, name='system.yaml'):
        """Replace a text in a file, as editors do: write beside it, and rename."""
        path = self.folder / name
        text = path.read_text()
        assert old in text
        beside = path.with_suffix('.new')
        beside.write_text(text.replace(old, new))
        beside.replace(path)

    def reloaded(self):
        self._reloads += 1
        return self.child.wait_for_line('reloaded in ', times=self._reloads)


def count_of(peer):
    """Return a list that grows by each number on `/count`."""
    counts = []

    def count(message):
        counts.append(message.data)

    peer.run(peer.node.create_subscription, Int64, '/count', count, 1000)
    return counts


def test_edits_change_just_what_they_say(running, peer, wait_for):
    counts = count_of(peer)
    wait_for(lambda: counts, 'a count')

    def gids():
        found = peer.node.get_publishers_info_by_topic('/count')
        return [bytes(each.endpoint_gid) for each in found]

    before = gids()
    edits = (
        ('period: 0.05', 'period: 0.1', 'system.yaml', '~1 timer', 'heard one '),
        ("WORD = 'one'", "WORD = 'two'", 'parts.py', '~2 timers, ~1 subscription', 'heard two '),
        (
            'behaviour: parts:hear}',
            'behaviour: parts:hear, qos: {depth: 3}}',
            'system.yaml',
            '±1 subscription',
            'heard two ',
        ),
        (
            '  listener:',
            '  other:\n    subscriptions:\n      words: '
            '{type: std_msgs/msg/String, behaviour: parts:hear}\n  listener:',
            'system.yaml',
            '+1 node',
            '[other]: heard two ',
        ),
        (
            'state: {count: 0}',
            'state: {count: 5, more: []}',
            'system.yaml',
            '~1 node',
            'heard two',
        ),
    )
    for old, new, name, summary, heard in edits:
        running.edit(old, new, name)
        assert running.reloaded().endswith(summary)
        running.child.wait_for_line(heard, times=len(running.child.matching(heard)) + 1)
    # The counter's node was named by edits of its code and state, but nothing of it was lost.
    wait_for(lambda: len(counts) > 50, 'more counts')
    assert counts == list(range(counts[0], counts[0] + len(counts)))
    assert gids() == before
    heard = [line.split()[-1] for line in running.child.matching('[listener]: heard')]
    assert heard == [str(number) for number in range(int(heard[0]), int(heard[0]) + len(heard))]


def test_what_cannot_be_applied_changes_nothing(running):
    edits = (
        ('system.yaml', 'period: 0.05', 'perid: 0.05', "did you mean 'period'?"),
        ('system.yaml', 'timers:\n      say:', 'timers: [', 'error['),
        ('parts.py', 'import time\n', 'import time\n1 / 0\n', 'ZeroDivisionError'),
        (
            'system.yaml',
            '  listener:',
            '  late:\n    on_start: parts:fail\n  listener:',
            'on_start raised OSError',
        ),
    )
    for number, (name, old, new, told) in enumerate(edits, 1):
        running.edit(old, new, name)
        running.child.wait_for_line('not reloaded: ', times=number)
        assert running.child.matching(told), running.child.output
        said = len(running.child.matching('heard one'))
        running.child.wait_for_line('heard one', times=said + 2)
        running.edit(new, old, name)
        # What is as it was needs no reload.
        time.sleep(0.2)
    assert not running.child.matching('reloaded in')
    assert 'Traceback' not in running.child.output.replace('Traceback', '', 1)


def test_what_was_told_is_not_told_again(running):
    child = running.child
    running.edit(
        '{words: std_msgs/msg/String}',
        '{words: std_msgs/msg/String, more: {type: std_msgs/msg/String, external: true}}',
    )
    running.reloaded()
    # The warning stays, in another line.
    running.edit('nodes:', '# A comment.\nnodes:')
    running.edit('{step: 1}', '{step: 2}')
    running.reloaded()
    running.edit('parts:hear', 'parts:her')
    child.wait_for_line('not reloaded: ')
    # The error stays, too, until there is another one.
    running.edit('# A comment.', '# Another comment.')
    time.sleep(0.5)
    running.edit('{step: 2}', '{stepp: 2')
    child.wait_for_line('not reloaded: ', times=2)
    running.edit('{stepp: 2', '{step: 2}')
    child.wait_for_line('not reloaded: ', times=3)
    running.edit('parts:her', 'parts:hear')
    child.wait_for_line('the files have no errors any more, and nothing has changed')
    told = ('unused-publisher', 'unknown-behaviour', 'yaml-syntax')
    assert [len(child.matching(each)) for each in told] == [1, 2, 1]


def test_a_save_that_changes_nothing_says_so_once(running):
    said = 'the files were read again, and nothing has changed'
    path = running.folder / 'system.yaml'
    (running.folder / 'other.yaml').write_text('no part of the system')
    path.write_text(path.read_text())
    running.child.wait_for_line(said)
    # An edit that is due at once is no save of its own.
    path.write_text(path.read_text())
    path.write_text(path.read_text())
    running.edit('{step: 1}', '{step: 2}')
    running.reloaded()
    assert len(running.child.matching(said)) == 1


def test_what_hangs_is_left_for_the_next_edit(running):
    good, hang = "WORD = 'one'\n", 'while True:\n    pass\n'
    running.edit(good, good + hang, 'parts.py')
    said = len(running.child.matching('heard'))
    running.child.wait_for_line('heard', times=said + 20)
    running.edit(good + hang, "WORD = 'two'\n", 'parts.py')
    running.child.wait_for_line('heard two ')
    late = '  late:\n    on_start: parts:hang\n  listener:'
    running.edit('  listener:', late)
    running.edit('{step: 1}', '{step: 2}')
    time.sleep(0.3)
    running.edit(late, '  listener:')
    running.child.wait_for_line('~1 parameter')
    assert not running.child.matching('not reloaded')
    # As for any behaviour that does not end.
    assert running.child.stop() == 1
    assert not running.child.matching('did not end in time')


def test_nodes_that_hang_in_on_stop_make_way(running):
    running.edit('  listener:', '  brief:\n    on_stop: parts:hang\n  listener:')
    running.reloaded()
    running.edit('  brief:\n', '  brief:\n    rosout: false\n')
    assert '±1 node; rebuilt: ' in running.reloaded()
    running.edit('  brief:\n    rosout: false\n    on_stop: parts:hang\n', '')
    assert running.reloaded().endswith('-1 node')
    assert len(running.child.matching("node 'brief' hangs, and is removed: on_stop")) == 2
    assert running.child.stop() == 1
    assert not running.child.matching('did not end in time')


def test_a_signal_during_a_reload_leaves_nothing(compose):
    # On a crowded machine, behaviours need longer to end.
    child = compose(SYSTEM.replace('shutdown_timeout: 1', 'shutdown_timeout: 5'), CODE, '--watch')
    child.wait_until_ready()
    running = Edited(compose.folder, child)
    running.edit('  listener:', '  slow:\n    on_start: parts:hang\n  listener:')
    time.sleep(0.3)
    assert running.child.stop(signal.SIGINT) == 0
