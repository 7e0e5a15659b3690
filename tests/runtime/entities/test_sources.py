"""Sources: threads of their own call what blocks, publish what it gives, and end with their node."""

import json

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import Transition
from std_msgs.msg import String

pytestmark = pytest.mark.ros

# A pipe stands for a port: who reads it waits until somebody writes.
PARTS = """
import os


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


def feed(node, message):
    os.write(node.state.writing, message.data.encode())


def tick(node):
    node.sleep(0.05)
    node.logger.info('ticks')
"""
_STRING = 'std_msgs/msg/String'


def driver(**source):
    """Return a node with a source that reads a port."""
    return {
        'state': {'reading': 0, 'writing': 0},
        'publishers': {
            name: {'type': _STRING, 'topic': f'~/{name}', 'external': True}
            for name in ('raw', 'other')
        },
        'on_start': 'parts:begin',
        'subscriptions': {
            'feed': {
                'type': _STRING,
                'topic': '~/feed',
                'behaviour': 'parts:feed',
                'external': True,
            },
        },
        'sources': {'port': {'publish': 'raw', 'cancel': 'parts:cancel', **source}},
    }


def ear(*names):
    """Return a node that hears what others publish."""
    return {
        'subscriptions': {
            name: {'type': _STRING, 'topic': f'/{name}/raw', 'behaviour': 'parts:hear'}
            for name in names
        }
    }


def render(nodes):
    return json.dumps({'version': 1, 'executor': {'shutdown_timeout': 20}, 'nodes': nodes})


def heard(child, *texts):
    return [
        text
        for line in child.matching('heard ')
        if (text := line.rpartition('heard ')[2]) in texts
    ]


def connect(peer, name):
    """Return a function that writes to the port of a driver."""
    publisher = peer.advertise(String, f'/{name}/feed')
    return lambda text: publisher.publish(String(data=text))


def test_what_sources_give_is_published_and_they_rest_with_their_nodes(compose, peer):
    nodes = {
        'reads': driver(behaviour='parts:read'),
        'ends': driver(behaviour='parts:few'),
        'fails': driver(behaviour='parts:steps'),
        'rests': {
            'lifecycle': {'start': 'inactive'},
            'sources': {'tick': {'behaviour': 'parts:tick'}},
        },
        'ear': ear('reads', 'ends', 'fails'),
    }
    child = compose(render(nodes), PARTS)
    child.wait_until_ready()

    feed = connect(peer, 'reads')
    for text in ('a', '.', 'b'):
        feed(text)
        child.wait_for_line(f'read {text}')
    child.wait_for_line('heard b')
    assert heard(child, 'a', 'b', '.') == ['a', 'b']

    # A generator ends where it returns.
    child.wait_for_line('heard last')
    assert heard(child, 'one', 'last') == ['one', 'last']

    # After an error it begins again, and health tells.
    feed = connect(peer, 'fails')
    feed('!')
    child.wait_for_line("source 'port'")
    assert child.matching('unplugged')
    assert child.matching('closed step 1')
    feed('a')
    child.wait_for_line('heard step 1')

    for _ in range(2):
        before = len(child.matching('ticks'))
        peer.change_state('/rests', Transition.TRANSITION_ACTIVATE)
        child.wait_for_line('ticks', times=before + 2)
        peer.change_state('/rests', Transition.TRANSITION_DEACTIVATE)
    assert child.stop() == 0, child.output
    assert len(child.matching('closed step ')) == 2
    assert heard(child, 'one', 'last') == ['one', 'last']


def test_edits_end_what_blocks_and_begin_it_anew(compose, peer):
    reloads = 0

    def edit(**source):
        nonlocal reloads
        names = ('read', 'steps')
        nodes = {name: driver(behaviour=f'parts:{name}', **source) for name in names}
        if not source:
            for node in nodes.values():
                del node['sources']
        (compose.folder / 'new').write_text(render(nodes | {'ear': ear(*names)}))
        (compose.folder / 'new').replace(compose.folder / 'system.yaml')
        if reloads:
            child.wait_for_line('reloaded in', times=reloads)
        reloads += 1

    (compose.folder / 'parts.py').write_text(PARTS)
    edit(publish='raw')
    child = compose.run('system.yaml', '--watch')
    child.wait_until_ready()
    feeds = [connect(peer, name) for name in ('read', 'steps')]
    for number in range(3):
        edit(**{'with': {'word': f'w{number}'}})
    # What is published by another one is no reason to begin anew.
    edit(publish='other', **{'with': {'word': 'w2'}})
    assert len(child.matching('closed')) == 3
    edit(**{'with': {'word': 'w2'}})
    for feed in feeds:
        feed('a')
    child.wait_for_line('[read]: w2 a')
    child.wait_for_line('heard w2 1')
    assert len(child.matching('closed')) == 3
    edit()
    assert child.stop() == 0, child.output


def test_an_async_function_is_refused(compose):
    text = "version: 1\nnodes: {driver: {sources: {port: {behaviour: 'parts:late'}}}}\n"
    child = compose(text, 'async def late(node):\n    pass\n')
    assert child.wait() == 1
    assert child.matching('is async'), child.output
