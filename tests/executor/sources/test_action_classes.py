"""Actions are told from other entities, and cost nothing where there are none."""

import subprocess
import sys

import pytest

pytest.importorskip('rclpy')

from composer.executor.sources.action_classes import (
    is_action_client,
    is_action_server,
    is_half_made,
)


def test_what_workers_and_systems_need_at_their_start_has_neither_actions_nor_numpy():
    code = (
        # Newer versions of rclpy import NumPy themselves.
        'import sys, rclpy.executors, rclpy.node; before = set(sys.modules);'
        'import composer.runtime.run, composer.runtime.workers.worker_process;'
        "print(sorted({'numpy', 'rclpy.action'} & (sys.modules.keys() - before)))"
    )
    assert subprocess.check_output([sys.executable, '-c', code], text=True) == '[]\n'


@pytest.mark.ros
def test_actions_are_told_apart(context):
    from rclpy.action import ActionClient, ActionServer
    from rclpy.node import Node
    from test_msgs.action import Fibonacci

    node = Node('n', context=context)
    client, server = ActionClient(node, Fibonacci, 'a'), ActionServer(node, Fibonacci, 'a', print)
    timer = node.create_timer(1.0, lambda: None)
    found = [(is_action_client(each), is_action_server(each)) for each in (client, server, timer)]
    assert found == [(True, False), (False, True), (False, False)]
    assert not any(map(is_half_made, (client, server, timer)))
    server.destroy()
    client.destroy()
    node.destroy_node()
