"""Parameters of a running node become those that the files declare now."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.exceptions import ParameterException

from composer.errors import ComposerError, StartError
from composer.planning.plan import Action
from composer.runtime.entities.parameters import (
    create_descriptor,
    find_refusal,
    loosen_parameter,
    type_of,
)

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
        value, was_set = node.behaviour_node.parameters[name], name in parameters.set_live

        kept = node.ros.copy_parameter(name)

        def put_back() -> None:
            # Nobody is asked: it has had this value.
            node.ros.put_parameter(*kept)
            parameters.specs[name] = before
            if was_set:
                parameters.set_live.add(name)

        given = node.ros.find_override(name)
        # rclpy does not unset a parameter that has a type.
        is_unset = not was_set and after is not None and after.value is None and given is None
        try:
            if after is None or operation.action is Action.RECREATE or is_unset:
                parameters.undeclare(name)
                if after is not None:
                    parameters.declare(after)
            else:
                self._change(after, value if was_set else after.value if given is None else given)
        except ComposerError:
            put_back()
            raise
        return put_back

    def _change(self, spec: ParameterSpec, value: Any) -> None:
        """Change the descriptor of a parameter, and its value; `None` leaves that as it is."""
        ros, parameters = self._node.ros, self._node.parameters
        assert parameters is not None  # noqa: S101 - see above
        # The old limits may not fit the new value, and nobody sets what is read-only.
        loosen_parameter(ros, spec.name)
        parameters.specs[spec.name] = spec
        # `1` and `1.0` are equal, and not the same.
        if value is not None and repr(value) != repr(ros.get_parameter(spec.name).value):
            parameters.set(spec, value)
        descriptor = create_descriptor(spec)
        descriptor.type = type_of(spec).value
        reason = find_refusal(spec, ros.get_parameter(spec.name).value)
        try:
            ros.set_descriptor(spec.name, descriptor)
        except ParameterException as error:
            reason = str(error).removesuffix(f': {spec.name}')
        if reason:
            message = f"parameter '{spec.name}' of '{self._node.spec.key}': {reason}"
            raise StartError(message, help='its value was set while the system ran')
