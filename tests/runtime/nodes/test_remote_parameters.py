"""Parameters of other nodes, of this process and of others."""

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


def test_parameters_of_nodes_here_and_elsewhere_are_set_and_read_or_refused(compose, peer):
    for name in ('limit', 'fixed'):
        peer.node.declare_parameter(name, 3)
    peer.node.add_on_set_parameters_callback(
        lambda changes: SetParametersResult(successful=changes[0].name != 'fixed', reason='no')
    )
    timers = {
        'own': ('change', '{of: server, values: {speed: 1, mode: fast, names: []}}'),
        'external': ('change', '{of: /peer, values: {limit: 4}}'),
        'peer': ('change_and_tell', '{of: /peer, values: {fixed: 4}}'),
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

    child.wait_for_line("now: {'speed': 1.0, 'mode': 'fast', 'names': []}")
    child.wait_for_line("now: {'limit': 4}")
    assert child.wait_for_line("node '/peer' refused").endswith(
        "ParametersRefusedError: node '/peer' refused 'fixed': no"
    )
    assert peer.node.get_parameter('limit').value == 4
    assert peer.node.get_parameter('fixed').value == 3
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
    text = (
        'version: 1\nnodes: {client: {timers: {t: {period: 0.02, behaviour: parts:wait_long}}}}\n'
    )
    child = compose(text, CODE)
    child.wait_for_line('asking')

    assert child.stop() == 0
    assert 'rror' not in child.output
