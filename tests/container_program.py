"""A container as rclcpp_components has it, in Python: a program for tests to run.

It serves load_node, unload_node and list_nodes as `ComponentManager` does: one request at a time,
unique ids that count up from 1, and the same words in its errors. Its classes are those of the
package `stand_in`, and of any other there are none:

- `stand_in::Talker` publishes its parameter `word` on `chatter`.
- `stand_in::Slow` takes as long as a file `slow` is there.
- `stand_in::Broken` raises in its constructor; with a file `mended` it does not.
- `stand_in::Managed` has a lifecycle.
- `stand_in::Deadly` ends the process while it is loaded, unless there is a file `mended`.
"""

import os
import sys
import time
from pathlib import Path

import rclpy
from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String


class Talker(Node):
    def __init__(self, name, **options):
        super().__init__(name, automatically_declare_parameters_from_overrides=True, **options)
        self.publisher = self.create_publisher(String, 'chatter', 10)
        self.timer = self.create_timer(0.05, self.say)

    def say(self):
        word = self.get_parameter_or('word', Parameter('word', value='hello')).value
        self.publisher.publish(String(data=str(word)))


class Slow(Talker):
    def __init__(self, name, **options):
        while Path('slow').exists():
            time.sleep(0.02)
        super().__init__(name, **options)


class Broken(Talker):
    def __init__(self, name, **options):
        if not Path('mended').exists():
            message = 'no such device'
            raise RuntimeError(message)
        super().__init__(name, **options)


class Deadly(Talker):
    def __init__(self, name, **options):
        if not Path('mended').exists():
            os._exit(7)
        super().__init__(name, **options)


class Managed(LifecycleNode):
    pass


KINDS = (Talker, Slow, Broken, Deadly, Managed)
CLASSES = {f'stand_in::{each.__name__}': each for each in KINDS}
CLASSES['composition::Talker'] = Talker


class Container(Node):
    def __init__(self, executor):
        super().__init__('ComponentManager')
        self.loaded = {}
        self.last = 0
        self.spinner = executor
        self.servers = [
            self.create_service(LoadNode, '~/_container/load_node', self.load),
            self.create_service(UnloadNode, '~/_container/unload_node', self.unload),
            self.create_service(ListNodes, '~/_container/list_nodes', self.list),
        ]

    def load(self, request, response):
        kind = CLASSES.get(request.plugin_name)
        if request.package_name != request.plugin_name.partition('::')[0]:
            response.error_message = 'Could not find requested resource in ament index'
        elif kind is None:
            response.error_message = 'Failed to find class with the requested plugin name.'
        else:
            try:
                node = self.create(kind, request)
            except RuntimeError as error:
                response.error_message = f'Component constructor threw an exception: {error}'
                return response
            self.last += 1
            self.loaded[self.last] = node
            self.spinner.add_node(node)
            response.success = True
            response.unique_id = self.last
            response.full_node_name = node.get_fully_qualified_name()
        return response

    def create(self, kind, request):
        arguments = ['--ros-args']
        for rule in request.remap_rules:
            arguments += ['-r', rule]
        extra = {each.name: each.value.bool_value for each in request.extra_arguments}
        print('extra', request.node_name, sorted(extra), flush=True)
        return kind(
            request.node_name,
            namespace=request.node_namespace,
            cli_args=arguments,
            use_global_arguments=False,
            parameter_overrides=[Parameter.from_parameter_msg(p) for p in request.parameters],
            enable_logger_service=extra.get('enable_logger_service', False),
        )

    def unload(self, request, response):
        node = self.loaded.pop(request.unique_id, None)
        if node is None:
            response.error_message = f'No node found with unique_id: {request.unique_id}'
        else:
            self.spinner.remove_node(node)
            print('unloaded', node.get_name(), flush=True)
            node.destroy_node()
            response.success = True
        return response

    def list(self, _request, response):
        response.unique_ids = list(self.loaded)
        response.full_node_names = [
            each.get_fully_qualified_name() for each in self.loaded.values()
        ]
        return response


def main():
    rclpy.init(args=sys.argv)
    executor = SingleThreadedExecutor()
    container = Container(executor)
    executor.add_node(container)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        for node in container.loaded.values():
            node.destroy_node()
        container.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
