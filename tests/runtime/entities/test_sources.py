"""Sources: threads of their own call what blocks, publish what it gives, and end with their node."""

import json
import re

import pytest

pytest.importorskip('rclpy')

from tests.running import wait_for

pytestmark = pytest.mark.ros

# A pipe stands for a port: who reads it waits until somebody writes.
PARTS = """
import os

import port


def begin(node):
    node.state.reading, node.state.writing = os.pipe()


def write(node):
    os.write(node.state.writing, b'x')


def read(node, word='read'):
    got = os.read(node.state.reading, 1).decode()
    node.logger.info(f'{word} {got}')
    return None if got == '.' else got


def steps(node, word='step'):
    number = 0
    try:
        while True:
            number += 1
            got = os.read(node.state.reading, 1).decode()
            if got == '!':
                raise OSError('unplugged')
            yield f'{word} {number}'
    finally:
        node.logger.info(f'closed {word} {number}')


def few(node):
    yield 'one'
    return 'last'


def cancel(node):
    os.write(node.state.writing, b'.')


async def late(node):
    pass


def hear(node, message):
    node.logger.info(f'heard {message.data}')
"""
SYSTEM = {
    'version': 1,
    'executor': {'shutdown_timeout': 20},
    'nodes': {
        'driver': {
            'state': {'reading': 0, 'writing': 0},
            'publishers': {'raw': 'std_msgs/msg/String', 'other': 'std_msgs/msg/String'},
            'on_start': 'parts:begin',
            'subscriptions': {
                'feed': {'type': 'std_msgs/msg/String', 'behaviour': 'parts:feed'},
            },
            'sources': {},
        },
        'ear': {
            'subscriptions': {
                'raw': {'type': 'std_msgs/msg/String', 'behaviour': 'parts:hear'},
            },
        },
    },
}
FEED = """

def feed(node, message):
    os.write(node.state.writing, message.data.encode())
"""


@pytest.fixture
def run(compose):
    """Return a function that runs the system with a source, and one that writes another."""

    def write(**source):
        data = json.loads(json.dumps(SYSTEM))
        data['nodes']['driver']['sources'] = {'port': source} if source else {}
        data['nodes']['driver']['subscriptions']['feed']['external'] = True
        path = compose.folder / 'system.yaml'
        (compose.folder / 'new').write_text(json.dumps(data))
        (compose.folder / 'new').replace(path)

    def start(*options, **source):
        write(**source)
        (compose.folder / 'parts.py').write_text(PARTS.replace('\nimport port\n', '') + FEED)
        child = compose.run('system.yaml', *options)
        child.wait_until_ready()
        return child, write

    return start


def publish(peer):
    from std_msgs.msg import String

    publisher = peer.advertise(String, '/feed')
    return lambda text: publisher.publish(String(data=text))


def test_what_is_read_is_published(run, peer):
    child, _ = run(behaviour='parts:read', publish='raw', cancel='parts:cancel')
    feed = publish(peer)
    for text in ('a', '.', 'b'):
        feed(text)
        child.wait_for_line(f'read {text}')
    child.wait_for_line('heard b')
    assert child.stop() == 0, child.output
    heard = [line.rpartition(' ')[2] for line in child.matching('heard')]
    assert heard == ['a', 'b']


def test_a_generator_ends_where_it_returns(run):
    child, _ = run(behaviour='parts:few', publish='raw')
    child.wait_for_line('heard last')
    assert child.stop() == 0, child.output
    assert [re.search('heard .*', line)[0] for line in child.matching('heard')] == [
        'heard one',
        'heard last',
    ]


def test_after_an_error_it_begins_again_and_health_tells(run, peer, compose):
    child, _ = run(behaviour='parts:steps', publish='raw', cancel='parts:cancel')
    feed = publish(peer)
    feed('!')
    child.wait_for_line("source 'port'")
    assert child.matching('unplugged')
    assert child.matching('closed step 1')
    feed('a')
    child.wait_for_line('heard step 1')
    assert child.stop() == 0, child.output
    assert len(child.matching('closed step ')) == 2


@pytest.mark.parametrize('behaviour', ['parts:read', 'parts:steps'])
def test_edits_end_what_blocks_and_begin_it_anew(run, peer, behaviour):
    source = {'behaviour': behaviour, 'publish': 'raw', 'cancel': 'parts:cancel'}
    child, write = run('--watch', **source)
    feed = publish(peer)
    for number in range(20):
        write(**source, **{'with': {'word': f'w{number}'}})
        child.wait_for_line('reloaded in', times=number + 1)
    # What is published by another one is no reason to begin anew.
    write(**source | {'publish': 'other'}, **{'with': {'word': 'w19'}})
    child.wait_for_line('reloaded in', times=21)
    closed = len(child.matching('closed'))
    assert closed in (0, 20)
    write(**source, **{'with': {'word': 'w19'}})
    child.wait_for_line('reloaded in', times=22)
    feed('a')
    child.wait_for_line('w19')
    assert len(child.matching('closed')) == closed
    write()
    child.wait_for_line('reloaded in', times=23)
    assert child.stop() == 0, child.output


def test_it_rests_with_its_node(compose, peer):
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    code = 'def tick(node):\n    node.sleep(0.05)\n    node.logger.info("ticks")\n'
    text = """
version: 1
nodes: {driver: {lifecycle: {start: inactive}, sources: {tick: {behaviour: 'parts:tick'}}}}
"""
    child = compose(text, code)
    child.wait_until_ready()

    def change(transition):
        fields = {'transition': Transition(id=transition)}
        assert peer.call(ChangeState, '/driver/change_state', **fields).success

    for _ in range(2):
        before = len(child.matching('ticks'))
        change(Transition.TRANSITION_ACTIVATE)
        wait_for(lambda n=before: len(child.matching('ticks')) > n + 1, child)
        change(Transition.TRANSITION_DEACTIVATE)
    assert child.stop() == 0, child.output


def test_an_async_function_is_refused(compose):
    text = "version: 1\nnodes: {driver: {sources: {port: {behaviour: 'parts:late'}}}}\n"
    child = compose(text, 'async def late(node):\n    pass\n')
    assert child.wait() == 1
    assert child.matching('is async'), child.output
