"""Plain rclpy nodes, each with the arguments that launch would give its program.

Run with a JSON list: `publishers`, `subscriptions` (topic, type, best effort or not), `parameters`
(name, value) of what the program makes itself, and `arguments` as after `--ros-args`.
"""

import importlib
import json
import sys

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy


def find_type(name):
    package, folder, kind = name.split('/')
    return getattr(importlib.import_module(f'{package}.{folder}'), kind)


def qos(best_effort):
    policy = ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE
    return QoSProfile(depth=10, reliability=policy)


def create(program):
    node = rclpy.create_node(
        program['name'],
        cli_args=['--ros-args', *program['arguments']],
        use_global_arguments=False,
    )
    for topic, kind, best_effort in program['publishers']:
        node.create_publisher(find_type(kind), topic, qos(best_effort))
    for topic, kind, best_effort in program['subscriptions']:
        node.create_subscription(find_type(kind), topic, print, qos(best_effort))
    for name, value in program['parameters'].items():
        node.declare_parameter(name, value)
    return node


def main():
    rclpy.init()
    executor = SingleThreadedExecutor()
    for program in json.loads(sys.argv[1]):
        executor.add_node(create(program))
    print('ready', flush=True)
    executor.spin()


if __name__ == '__main__':
    main()
