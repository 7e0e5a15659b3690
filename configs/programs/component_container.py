"""A container of components in Python, in place of `component_container`, with two to load.

- `cell::Thermometer` publishes `temperature`, its parameter.
- `cell::Gripper` has a lifecycle.
"""

import sys
from contextlib import suppress
from typing import Any

import rclpy
from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import Temperature


class Thermometer(Node):
    """Publishes what its parameter `temperature` says (°C)."""

    def __init__(self, name: str, **options: Any) -> None:
        """Start measuring."""
        super().__init__(name, **options)
        self._temperature = self.declare_parameter('temperature', 20.0).value
        self._publisher = self.create_publisher(Temperature, 'temperature', 10)
        self.create_timer(0.1, self._measure)

    def _measure(self) -> None:
        self._publisher.publish(Temperature(temperature=self._temperature))


class Gripper(LifecycleNode):
    """Does nothing, in each of its states."""


class Container(Node):
    """Serves `load_node`, `unload_node` and `list_nodes`, with the words of rclcpp_components.

    Args:
        executor: Spins the components.
        classes: What can be loaded, by the names of plugins.
    """

    def __init__(self, executor: Executor, classes: dict[str, type[Node]]) -> None:
        """Serve requests, one at a time; ids are unique and count up from 1."""
        super().__init__('ComponentManager')
        self.loaded: dict[int, Node] = {}
        self.last = 0
        self.spinner = executor
        self.classes = classes
        self.servers = [
            self.create_service(LoadNode, '~/_container/load_node', self.load),
            self.create_service(UnloadNode, '~/_container/unload_node', self.unload),
            self.create_service(ListNodes, '~/_container/list_nodes', self.list),
        ]

    def load(self, request: LoadNode.Request, response: LoadNode.Response) -> LoadNode.Response:
        """Create a node."""
        kind = self.classes.get(request.plugin_name)
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

    def create(self, kind: Any, request: LoadNode.Request) -> Node:
        """Return a new node as a request wants it."""
        arguments = ['--ros-args']
        for rule in request.remap_rules:
            arguments += ['-r', rule]
        extra = {each.name: each.value.bool_value for each in request.extra_arguments}
        self.get_logger().info(f'extra {request.node_name} {sorted(extra)}')
        node: Node = kind(
            request.node_name or kind.__name__.lower(),
            namespace=request.node_namespace,
            cli_args=arguments,
            use_global_arguments=False,
            parameter_overrides=[Parameter.from_parameter_msg(p) for p in request.parameters],
        )
        return node

    def unload(
        self, request: UnloadNode.Request, response: UnloadNode.Response
    ) -> UnloadNode.Response:
        """Destroy a node."""
        node = self.loaded.pop(request.unique_id, None)
        if node is None:
            response.error_message = f'No node found with unique_id: {request.unique_id}'
        else:
            self.spinner.remove_node(node)
            self.get_logger().info(f'unloaded {node.get_name()}')
            node.destroy_node()
            response.success = True
        return response

    def list(
        self, _request: ListNodes.Request, response: ListNodes.Response
    ) -> ListNodes.Response:
        """List the nodes."""
        response.unique_ids = list(self.loaded)
        response.full_node_names = [
            each.get_fully_qualified_name() for each in self.loaded.values()
        ]
        return response


def run(classes: dict[str, type[Node]]) -> None:
    """Run a container until a signal comes."""
    rclpy.init(args=sys.argv)
    executor = SingleThreadedExecutor()
    container = Container(executor, classes)
    executor.add_node(container)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()
    for node in container.loaded.values():
        node.destroy_node()
    container.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    run({'cell::Thermometer': Thermometer, 'cell::Gripper': Gripper})
