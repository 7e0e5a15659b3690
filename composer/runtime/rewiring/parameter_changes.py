"""Parameters of a running node become those that the files declare now."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter

from composer.errors import ComposerError, StartError
from composer.planning.plan import Action
from composer.runtime.entities.parameters import create_descriptor, loosen_parameter

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.language.specs import NodeSpec, ParameterSpec
    from composer.planning.plan import Operation
    from composer.runtime.nodes.live_node import LiveNode


class ParameterChange:
    """Changes of the parameters of one node.

    Args:
        before: What the node was declared as.
        after: What it is declared as now.
    """

    def __init__(self, node: LiveNode, before: NodeSpec, after: NodeSpec) -> None:
        self._node = node
        self._before, self._after = before, after

    def apply(self, operation: Operation) -> Callable[[], None]:
        """Add, change or remove a parameter; return what undoes it.

        A value that somebody set while the system ran stays, unless the parameter is recreated.

        Raises:
            StartError: The node refuses the value: its declaration, or its `on_parameters`.
        """
        name = operation.target[2]
        before, after = self._before.parameters.get(name), self._after.parameters.get(name)
        node, parameters = self._node, self._node.parameters
        assert parameters is not None  # noqa: S101 - its entities have been created
        if before is None:
            parameters.declare(self._after.parameters[name])
            return lambda: parameters.undeclare(name)
        value = node.behaviour_node.parameters[name]

        def put_back() -> None:
            if node.ros.has_parameter(name):
                parameters.undeclare(name)
            parameters.declare(before)
            self._set(before, value)

        try:
            if after is None or operation.action is Action.RECREATE:
                parameters.undeclare(name)
                if after is not None:
                    parameters.declare(after)
            else:
                self._change(after, operation, value)
        except ComposerError:
            put_back()
            raise
        return put_back

    def _change(self, spec: ParameterSpec, operation: Operation, value: Any) -> None:
        """Change the descriptor of a parameter, and its value if nobody has set it."""
        ros = self._node.ros
        changes = {each.key: each for each in operation.changes}
        told = changes.get('value') or changes.get('default')
        # The old limits may not fit the new value.
        loosen_parameter(ros, spec.name)
        if told is not None:
            # Without a value in a parameter file, it is the default.
            old, new = (
                each if each is not None else record.value
                for each, record in (
                    (told.old, self._before.parameters[spec.name]),
                    (told.new, spec),
                )
            )
            if value == old:
                self._set(spec, new)
        descriptor = create_descriptor(spec)
        descriptor.type = _type_of(spec).value
        try:
            ros.set_descriptor(spec.name, descriptor)
        except ParameterException as error:
            message = f"parameter '{spec.name}' of '{self._node.spec.key}': {error}"
            raise StartError(message, help='its value was set while the system ran') from error

    def _set(self, spec: ParameterSpec, value: Any) -> None:
        if value is None:
            return
        (result,) = self._node.ros.set_parameters([Parameter(spec.name, _type_of(spec), value)])
        if not result.successful:
            message = f"parameter '{spec.name}' of '{self._node.spec.key}': {result.reason}"
            raise StartError(message)


def _type_of(spec: ParameterSpec) -> Parameter.Type:
    return Parameter.Type[(spec.type or '').upper()]
