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

    from composer.language.specs import ParameterSpec
    from composer.planning.plan import Operation
    from composer.planning.snapshot import Snapshot
    from composer.ros_parameters.file_reader import ParameterEntry
    from composer.runtime.nodes.live_node import LiveNode


class ParameterChange:
    """Changes of the parameters of one node.

    Args:
        old: What the system was read as.
        new: What it is read as now.
    """

    def __init__(self, node: LiveNode, old: Snapshot, new: Snapshot) -> None:
        self._node = node
        self._old, self._new = old, new

    def apply(self, operation: Operation) -> Callable[[], None]:
        """Add, change or remove a parameter; return what undoes it.

        A value that somebody set while the system ran stays, unless the parameter is recreated.

        Raises:
            StartError: The node refuses the value: its declaration, or its `on_parameters`.
        """
        full_name, _, name = operation.target
        before, old_entry = _find(self._old, full_name, name)
        after, new_entry = _find(self._new, full_name, name)
        node, parameters = self._node, self._node.parameters
        assert parameters is not None  # noqa: S101 - its entities have been created
        node.ros.override(name, new_entry)
        if before is None and after is not None:
            parameters.declare(after)
            return lambda: parameters.undeclare(name)
        assert before is not None  # noqa: S101 - there is no such operation
        value = node.behaviour_node.parameters[name]
        kept = node.ros.copy_parameter(name)

        def put_back() -> None:
            node.ros.override(name, old_entry)
            node.ros.put_parameter(*kept)

        was, becomes = _initial_value(before, old_entry), _initial_value(after, new_entry)
        # rclpy does not unset a parameter that has a type.
        is_unset = becomes is None and value == was
        try:
            if after is None or operation.action is Action.RECREATE or is_unset:
                parameters.undeclare(name)
                if after is not None:
                    parameters.declare(after)
            else:
                self._change(after, becomes if value == was else value)
        except ComposerError:
            put_back()
            raise
        return put_back

    def _change(self, spec: ParameterSpec, value: Any) -> None:
        """Give a parameter another descriptor, and a value."""
        ros = self._node.ros
        # The old limits may not fit the new value.
        loosen_parameter(ros, spec.name)
        if value != self._node.behaviour_node.parameters[spec.name]:
            self._set(spec, value)
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


def _find(
    snapshot: Snapshot, full_name: str, name: str
) -> tuple[ParameterSpec | None, ParameterEntry | None]:
    """Return the declaration of a parameter, and what parameter files say of it."""
    spec = next(each for each in snapshot.spec.nodes.values() if each.full_name == full_name)
    return spec.parameters.get(name), snapshot.overrides.get(full_name, {}).get(name)


def _initial_value(spec: ParameterSpec | None, entry: ParameterEntry | None) -> Any:
    if entry is not None or spec is None:
        return entry and entry.value
    is_bytes = spec.type == 'byte_array' and spec.value is not None
    return [bytes([item]) for item in spec.value] if is_bytes else spec.value


def _type_of(spec: ParameterSpec) -> Parameter.Type:
    return Parameter.Type[(spec.type or '').upper()]
