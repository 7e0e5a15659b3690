"""A call whose server's behaviour raises has an error at once, wherever the two of them run."""

import pytest

pytest.importorskip('rclpy')

pytestmark = pytest.mark.ros

CODE = """
import composer
from std_srvs.srv import SetBool

SERVICES = ('plain', 'awaited', 'unfit', 'bare')

def fail(node, request):
    raise OSError('no such device')

async def fail_async(node, request):
    raise OSError('no such device')

def answer_badly(node, request):
    return {f'not_{node.name}': True}

def begin(node):
    node.ros.create_service(SetBool, 'bare', lambda request, response: response.nothing)

def ask_all(node):
    for name in SERVICES:
        try:
            node.call(name, True, timeout=None)
        except composer.ServiceFailedError as error:
            node.logger.info(f'asked: {error}')

def ask_once(node):
    ask_all(node)
    yield

async def ask_all_async(node):
    for name in SERVICES:
        try:
            await node.call_async(name, True, timeout=None)
        except composer.ServiceFailedError as error:
            node.logger.info(f'awaited: {error}')
    yield
"""
SERVER = """
  server:
    worker: left
    on_start: parts:begin
    services:
      plain: {type: std_srvs/srv/SetBool, behaviour: 'parts:fail'}
      awaited: {type: std_srvs/srv/SetBool, behaviour: 'parts:fail_async'}
      unfit: {type: std_srvs/srv/SetBool, behaviour: 'parts:answer_badly'}
"""
SERVICES = ('plain', 'awaited', 'unfit', 'bare')


def client(name, place, option=''):
    """Return a node that calls each of the services in three ways."""
    clients = ', '.join(
        f'{each}: {{type: std_srvs/srv/SetBool, external: true{option}}}' for each in SERVICES
    )
    return f"""
  {name}:
    {place}
    on_start: parts:ask_all
    service_clients: {{{clients}}}
    timers:
      ask: {{period: 0.05, behaviour: 'parts:ask_once'}}
      await: {{period: 0.05, behaviour: 'parts:ask_all_async', group: reentrant}}
"""


def test_a_behaviour_that_raises_ends_the_call_without_a_timeout_too(compose):
    clients = {
        'beside': client('beside', 'worker: left'),
        'far': client('far', 'worker: right'),
        # Sent by the middleware, though it could be handed over.
        'seen': client('seen', 'worker: left', ', introspection: metadata'),
    }
    child = compose(f'version: 1\nnodes:{SERVER}{"".join(clients.values())}', CODE)
    child.wait_until_ready()
    for name in clients:
        for service in SERVICES:
            error = f"'/{service}' did not answer: its behaviour raised an error"
            child.wait_for_line(f'[{name}]: asked: {error}', times=2)
            child.wait_for_line(f'[{name}]: awaited: {error}')
    assert child.stop() == 0
    assert not child.matching('CallTimeoutError')
