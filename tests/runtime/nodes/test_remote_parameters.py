"""Parameters of other nodes, of this process and of others."""

import signal

import pytest

pytest.importorskip('rclpy')

from rcl_interfaces.msg import SetParametersResult

pytestmark = pytest.mark.ros

CODE = """
from composer import CallError, ParametersRefusedError

def change(node, of, values):
    node.set_parameters(of, values, timeout=30)
    got = node.get_parameters(of, list(values), timeout=30)
    node.logger.info(f'now: {got}')
    yield

def change_and_tell(node, of, values, timeout=30):  # composer: ignore[refused-parameter]
    try:
        node.set_parameters(of, values, timeout=timeout)
    except (CallError, ParametersRefusedError) as error:
        node.logger.info(f'{type(error).__name__}: {error}')
    yield

def get_and_tell(node, of, names, timeout=30):
    try:
        node.logger.info(f'got: {node.get_parameters(of, names, timeout=timeout)}')
    except (CallError, ParametersRefusedError) as error:
        node.logger.info(f'{type(error).__name__}: {error}')
    yield

def wait_long(node):
    node.logger.info('asking')
    node.get_parameters('nobody', ['x'], timeout=None)
"""

SERVER = """
          server:
            namespace: /robot
            parameters:
              speed: {default: 0.5, maximum: 2.0}
              mode: slow
              names: [one, two]
"""


def asking(behaviour, arguments, *, server=SERVER, namespace='/robot'):
    """Return a system whose client does this once."""
    return f"""
        version: 1
        nodes:
          client:
            namespace: {namespace}
            timers: {{tick: {{period: 0.02, behaviour: 'parts:{behaviour}', with: {arguments}}}}}
{server}"""


def test_parameters_of_a_node_of_this_process_are_set_and_read(compose):
    arguments = '{of: robot/server, values: {speed: 1, mode: fast, names: []}}'
    child = compose(asking('change', arguments, namespace='/'), CODE)

    assert child.wait_for_line('now: ').endswith(
        "now: {'speed': 1.0, 'mode': 'fast', 'names': []}"
    )
    assert child.stop() == 0


def test_parameters_of_an_external_node_are_set_and_read(compose, peer):
    peer.node.declare_parameter('limit', 3)
    arguments = '{of: /peer, values: {limit: 4}}'
    child = compose(asking('change', arguments, server=''), CODE)

    assert child.wait_for_line('now: ').endswith("now: {'limit': 4}")
    assert peer.node.get_parameter('limit').value == 4
    assert child.stop() == 0


def test_what_cannot_be_asked_is_an_error_with_its_reason(compose, peer):
    peer.node.declare_parameter('limit', 3)
    peer.node.add_on_set_parameters_callback(
        lambda _changes: SetParametersResult(successful=False, reason='not now')
    )
    timers = {
        'peer': ('change_and_tell', '{of: /peer, values: {limit: 4}}'),
        'here': ('change_and_tell', '{of: server, values: {mode: fast, speed: 2.5}}'),
        'nobody': ('change_and_tell', '{of: nobody, values: {mode: fast}, timeout: 0.2}'),
        'unknown': ('get_and_tell', '{of: /peer, names: [lmit]}'),
    }
    lines = '\n'.join(
        f"              {name}: {{period: 0.02, behaviour: 'parts:{does}', with: {arguments}}}"
        for name, (does, arguments) in timers.items()
    )
    text = f"""
        version: 1
        nodes:
          client:
            namespace: /robot
            timers:
{lines}
{SERVER}"""
    child = compose(text, CODE)

    assert child.wait_for_line("node '/peer' refused").endswith(
        "ParametersRefusedError: node '/peer' refused 'limit': not now"
    )
    assert peer.node.get_parameter('limit').value == 3
    line = child.wait_for_line("ParametersRefusedError: node 'server' refused 'speed': ")
    assert "'mode'" not in line
    assert child.wait_for_line("node '/robot/nobody'").endswith(
        "ServiceNotAvailableError: no node '/robot/nobody' with parameter services appeared "
        'within 0.2 s'
    )
    assert child.wait_for_line('does not have').endswith(
        "ParametersRefusedError: node '/peer' does not have all of lmit"
    )
    assert child.stop() == 0


def test_a_signal_ends_a_behaviour_that_waits_for_a_node(compose):
    child = compose(asking('wait_long', '{}'), CODE)
    child.wait_for_line('asking')

    assert child.stop(signal.SIGINT) == 0
    assert 'rror' not in child.output
