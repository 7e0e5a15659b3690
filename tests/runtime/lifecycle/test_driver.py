"""`lifecycle: active` of an external process: its nodes are brought there, whenever it starts."""

import os
import signal
import sys

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.srv import GetState

from tests.running import ROOT

pytestmark = pytest.mark.ros

PROGRAM = ROOT / 'tests/runtime/lifecycle/managed_program.py'


def process(name, *outcomes, **keys):
    command = [sys.executable, str(PROGRAM), name, *outcomes]
    return {'command': command, 'name': name, 'lifecycle': 'active', **keys}


def system(**processes):
    return str({'version': 1, 'processes': processes})


def state_of(peer, node):
    return peer.call(GetState, f'{node}/get_state').current_state.label


def test_nodes_are_driven_in_order_and_again_after_a_restart(compose, peer, wait_for):
    text = system(
        lidar=process('lidar', restart={'delay': 0}),
        camera=process(
            'camera', wait_for={'node': '/lidar', 'state': 'active'}, lifecycle='inactive'
        ),
    )
    child = compose(text)
    child.wait_for_line("process 'camera': node '/camera' is inactive")
    # What a process prints comes another way.
    child.wait_for_line('[camera] on_configure')
    assert child.output.index("node '/lidar' is active") < child.output.index(
        '[camera] on_configure'
    )
    assert not child.matching('[camera] on_activate')
    line = child.matching('pid ')[0]
    os.kill(int(line.rpartition(' ')[2]), signal.SIGKILL)
    child.wait_for_line("process 'lidar': node '/lidar' is active", times=2)
    assert state_of(peer, 'lidar') == 'active'
    assert child.stop() == 0


def test_a_node_that_refuses_fails_its_process_and_is_left_as_it_is_without_a_rule(compose):
    strict = process(
        'lidar',
        'on_activate=error',
        on_exit='shutdown',
        wait_for={'node': '/camera', 'state': 'inactive'},
    )
    child = compose(system(camera=process('camera', 'on_activate=failure'), lidar=strict))
    child.wait_for_line("node '/camera' refused to activate: it is inactive")
    child.wait_for_line(
        "[ERROR] [composer]: process 'lidar': node '/lidar' refused to activate: "
        'it is unconfigured'
    )
    assert child.wait() == 1
