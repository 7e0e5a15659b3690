"""Shows the nodes of a system to tools that know containers, as `ros2 component list`.

These look for a node that is not hidden and has all three services of a container. What the
system has is what its files say, so to load and unload is refused.
Source: `find_container_node_names` in ros2cli (`ros2component/ros2component/api/__init__.py`).
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter

from composer.runtime.control.protocol import container_name

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.context import Context

_REFUSAL = "the nodes of a system are those of its file: edit it, then 'composer reload {}'"


class ComponentListing:
    """The node of a system that says which nodes are in its process.

    Args:
        list_nodes: Returns their full names.

    Attributes:
        node: The rclpy node.
    """

    def __init__(self, context: Context, system: str, list_nodes: Callable[[], list[str]]) -> None:
        from composition_interfaces.srv import ListNodes, LoadNode, UnloadNode

        self._list_nodes = list_nodes
        self._refusal = _REFUSAL.format(system)
        self._numbers = itertools.count(1)
        self._ids: dict[str, int] = {}
        self.node = RosNode(
            container_name(system),
            context=context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter('start_type_description_service', value=False)],
        )
        for kind, name, answer in (
            (LoadNode, 'load_node', self._refuse),
            (UnloadNode, 'unload_node', self._refuse),
            (ListNodes, 'list_nodes', self._list),
        ):
            self.node.create_service(kind, f'~/_container/{name}', answer)

    def _refuse(self, _request: Any, response: Any) -> Any:
        response.success, response.error_message = False, self._refusal
        return response

    def _list(self, _request: Any, response: Any) -> Any:
        names = self._list_nodes()
        for name in names:
            if name not in self._ids:
                self._ids[name] = next(self._numbers)
        response.full_node_names = names
        response.unique_ids = [self._ids[name] for name in names]
        return response
