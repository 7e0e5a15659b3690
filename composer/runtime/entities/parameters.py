"""Parameters: declared with descriptors, checked live, with a behaviour heard before a change."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from time import sleep
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter

from composer.errors import StartError
from composer.python_source.modules import FunctionKind
from composer.ros_parameters.parameter_types import INT64_MAX, INT64_MIN
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.calls import Owner

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import BehaviourSpec, ParameterSpec
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.ros_node import ComposedRosNode

_FLOAT_MAX = 1.7976931348623157e308
_POLL_SEC = 0.001


def create_parameters(node: LiveNode) -> None:
    """Declare the node's parameters.

    Raises:
        StartError: The command line or a parameter file gives one a value that its declaration
            refuses.
    """
    refusing = partial(_refuse_unless_chosen, node.spec.parameters)
    node.ros.add_on_set_parameters_callback(refusing)
    for spec in node.spec.parameters.values():
        try:
            _declare(node.ros, spec)
        except ParameterException as error:
            reason = str(error).removesuffix(f': {spec.name}')
            message = f"parameter '{spec.name}' from {_origin(node.ros, spec.name)}: {reason}"
            raise StartError(message) from error
    if node.spec.on_parameters:
        # rclpy asks the callback first that was added last, and a behaviour need not hear of what
        # is refused anyway.
        node.ros.remove_on_set_parameters_callback(refusing)
        hear = _BehaviourHearing(node, node.spec.on_parameters)
        node.ros.add_on_set_parameters_callback(hear)
        node.ros.add_on_set_parameters_callback(refusing)


def create_descriptor(spec: ParameterSpec) -> ParameterDescriptor:
    """Return the descriptor that ROS 2 tools show, and whose range rclpy enforces."""
    descriptor = ParameterDescriptor(
        name=spec.name, description=spec.description, read_only=spec.read_only
    )
    if spec.choices is not None:
        descriptor.additional_constraints = f'one of {", ".join(map(str, spec.choices))}'
    if spec.minimum is None and spec.maximum is None:
        return descriptor
    if spec.type == 'integer':
        descriptor.integer_range = [
            IntegerRange(
                from_value=INT64_MIN if spec.minimum is None else int(spec.minimum),
                to_value=INT64_MAX if spec.maximum is None else int(spec.maximum),
                step=int(spec.step or 0),
            )
        ]
    else:
        descriptor.floating_point_range = [
            FloatingPointRange(
                from_value=-_FLOAT_MAX if spec.minimum is None else float(spec.minimum),
                to_value=_FLOAT_MAX if spec.maximum is None else float(spec.maximum),
                step=float(spec.step or 0.0),
            )
        ]
    return descriptor


def _origin(ros: ComposedRosNode, name: str) -> str:
    entry = ros.from_files.get(name)
    return str(entry.value_span) if entry else 'the command line'


def _declare(ros: ComposedRosNode, spec: ParameterSpec) -> None:
    kind = Parameter.Type[(spec.type or '').upper()]
    descriptor = create_descriptor(spec)
    entry = ros.from_files.get(spec.name)
    if entry is not None and entry.value == [] and not kind.name.endswith('_ARRAY'):
        message = f"parameter '{spec.name}' from {entry.value_span}: {kind.name} is no list"
        raise StartError(message)
    if spec.value == [] or (entry is not None and entry.value == []):
        # To rclpy every empty list is one of bytes, so it is set when the type is known already.
        # The empty list of a parameter file has no type, and would leave the parameter unset.
        declared = ros.declare_parameter(spec.name, kind)
        if declared.type_ is Parameter.Type.NOT_SET:
            ros.set_parameters([Parameter(spec.name, kind, [])])
        descriptor.type = kind.value
        ros.set_descriptor(spec.name, descriptor)
    elif spec.value is None:
        ros.declare_parameter(spec.name, kind, descriptor)
    elif kind is Parameter.Type.BYTE_ARRAY:
        ros.declare_parameter(spec.name, [bytes([item]) for item in spec.value], descriptor)
    else:
        ros.declare_parameter(spec.name, spec.value, descriptor)


def _refuse_unless_chosen(
    specs: Mapping[str, ParameterSpec], changes: list[Parameter]
) -> SetParametersResult:
    for change in changes:
        spec = specs.get(change.name)
        if spec and spec.choices is not None and change.value not in spec.choices:
            options = ', '.join(map(str, spec.choices))
            reason = f"'{change.value}' is not one of {options}"
            return SetParametersResult(successful=False, reason=reason)
    return SetParametersResult(successful=True)


class _BehaviourHearing:
    """Asks `on_parameters` whether a change is accepted."""

    def __init__(self, node: LiveNode, spec: BehaviourSpec) -> None:
        self._node = node
        self._spec = spec
        self._kind = kind_of(node.function(spec))

    def __call__(self, changes: list[Parameter]) -> SetParametersResult:
        """Return the result that ROS gives to whoever asked for the change."""
        new_values = {change.name: change.value for change in changes}
        answers: list[Any] = []
        function = partial(
            self._node.function(self._spec), self._node.behaviour_node, **self._spec.arguments
        )
        call = self._node.call(Owner('on_parameters'), self._spec.path, function)
        call = call.delivering(answers.append)
        if self._kind is FunctionKind.COROUTINE:
            self._await(call.as_callback(self._kind), new_values)
        else:
            call.run(new_values)
        reason = answers[0] if answers else 'the behaviour that decides on it raised an error'
        return SetParametersResult(successful=reason is None, reason=str(reason or ''))

    def _await(self, callback: Any, new_values: dict[str, Any]) -> None:
        # rclpy wants the answer when this returns, on a thread that the executor may not have
        # twice: so the coroutine is resumed here until it ends, not given to the executor.
        coroutine = callback(new_values)
        with suppress(StopIteration):
            while True:
                coroutine.send(None)
                sleep(_POLL_SEC)
