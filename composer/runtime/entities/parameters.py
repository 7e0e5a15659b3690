"""Parameters: declared with descriptors; changes are checked, and a behaviour may refuse them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import contextmanager
from threading import get_ident
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
from composer.language.parsing.parameter_references import find_value_problem
from composer.ros_parameters.parameter_types import INT64_MAX, INT64_MIN, suggest_value
from composer.runtime.behaviours.calls import FAILED, return_result
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.entities.timers import Timer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from composer.language.specs import BehaviourSpec, NodeSpec, ParameterSpec
    from composer.runtime.nodes.live_node import LiveNode
    from composer.runtime.nodes.ros_node import ComposedRosNode

# The keys of a node whose behaviours hear of changes.
PARAMETER_HOOKS = ('before_parameters_set', 'on_parameters', 'after_parameters_set')
_FLOAT_MAX = 1.7976931348623157e308


class NodeParameters:
    """The declared parameters of a node.

    Attributes:
        specs: What they are declared as.
        set_live: The names of those that somebody has set since they were declared.

    Raises:
        StartError: The command line or a parameter file gives one a value that its declaration
            refuses.
    """

    def __init__(self, node: LiveNode) -> None:
        self._node = node
        self._asking: Callable[[list[Parameter]], SetParametersResult] | None = None
        self._before: Callable[[list[Parameter]], list[Parameter]] | None = None
        self._after: Callable[[list[Parameter]], None] | None = None
        self.specs: dict[str, ParameterSpec] = {}
        self.set_live: set[str] = set()
        self._refusing = lambda changes: _refuse(self.specs, node.spec, changes)
        # The thread that sets parameters to what the files say.
        self._own_thread = 0
        node.ros.add_on_set_parameters_callback(self._refusing)
        node.ros.add_post_set_parameters_callback(self._note)
        for spec in node.spec.parameters.values():
            self.declare(spec)

    def declare(self, spec: ParameterSpec) -> None:
        """Declare a parameter.

        Raises:
            StartError: Its value is refused.
        """
        ros = self._node.ros
        self.specs[spec.name] = spec
        try:
            with self._as_own():
                _declare(ros, spec)
        except ParameterException as error:
            reason = str(error).removesuffix(f': {spec.name}')
            message = f"parameter '{spec.name}' from {_origin(ros, spec.name)}: {reason}"
            advice = suggest_value(spec.type, ros.find_override(spec.name))
            raise StartError(message, help=advice) from error

    def undeclare(self, name: str) -> None:
        """Remove a parameter, read-only ones included."""
        ros = self._node.ros
        loosen_parameter(ros, name)
        ros.undeclare_parameter(name)
        del self.specs[name]
        self.set_live.discard(name)

    def set(self, spec: ParameterSpec, value: Any) -> None:
        """Set a parameter to a value of the files.

        Raises:
            StartError: It is refused.
        """
        parameter = Parameter(spec.name, type_of(spec), value)
        with self._as_own():
            (result,) = self._node.ros.set_parameters([parameter])
        if not result.successful:
            message = f"parameter '{spec.name}' of '{self._node.spec.key}': {result.reason}"
            raise StartError(message)

    def ask(self, spec: NodeSpec) -> None:
        """Call the behaviours of this node about changes from now on."""
        node, ros = self._node, self._node.ros
        if self._asking is not None:
            ros.remove_on_set_parameters_callback(self._asking)
            self._asking = None
        if self._before is not None:
            ros.remove_pre_set_parameters_callback(self._before)
            self._before = None
        if self._after is not None:
            ros.remove_post_set_parameters_callback(self._after)
            self._after = None
        for key in PARAMETER_HOOKS:
            node.drop_limits(key)
        if spec.on_parameters is not None:
            # rclpy calls the callback first that was added last, and a behaviour is not asked
            # about what is refused anyway.
            ros.remove_on_set_parameters_callback(self._refusing)
            self._asking = _create_callback(node, spec.on_parameters)
            ros.add_on_set_parameters_callback(self._asking)
            ros.add_on_set_parameters_callback(self._refusing)
        if spec.before_parameters_set is not None:
            self._before = self._changing(spec.before_parameters_set)
            ros.add_pre_set_parameters_callback(self._before)
        if spec.after_parameters_set is not None:
            self._after = _telling(node, spec.after_parameters_set)
            ros.add_post_set_parameters_callback(self._after)

    def _changing(self, spec: BehaviourSpec) -> Callable[[list[Parameter]], list[Parameter]]:
        """Return what lets `before_parameters_set` change changes."""
        node = self._node
        call = node.call(
            Owner('before_parameters_set'), spec.path, node.bind(spec), deliver=return_result
        )

        def change(changes: list[Parameter]) -> list[Parameter]:
            wanted = node.run_to_end(call, _as_changes(changes))
            if wanted is None:
                return changes
            # rclpy refuses an empty list.
            if wanted is FAILED or not isinstance(wanted, Mapping):
                return []
            given = {each.name: each for each in changes}
            return [
                given[name]
                if name in given and given[name].value is value
                else node.ros.as_declared(Parameter(name, value=value))
                for name, value in wanted.items()
            ]

        return change

    @contextmanager
    def _as_own(self) -> Iterator[None]:
        self._own_thread = get_ident()
        try:
            yield
        finally:
            self._own_thread = 0

    def _note(self, changes: list[Parameter]) -> None:
        if self._own_thread != get_ident():
            self.set_live.update(each.name for each in changes)
        names = {each.name for each in changes}
        for name, timer in self._node.spec.timers.items():
            created = self._node.entities['timers'].get(name)
            is_followed = any(each.parameter in names for each in timer.by_parameter.values())
            if is_followed and isinstance(created, Timer):
                created.follow()


def type_of(spec: ParameterSpec) -> Parameter.Type:
    """Return the type that rclpy knows a parameter by."""
    return Parameter.Type[(spec.type or '').upper()]


def loosen_parameter(ros: ComposedRosNode, name: str) -> None:
    """Let a parameter have any value, until it has another descriptor; rclpy refuses to."""
    ros._descriptors[name] = ParameterDescriptor(name=name, dynamic_typing=True)  # noqa: SLF001


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
    kind = type_of(spec)
    descriptor = create_descriptor(spec)
    if ros.has_parameter(spec.name):
        # It was declared from an override, without what the file says of it.
        ros.undeclare_parameter(spec.name)
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


def find_refusal(spec: ParameterSpec, value: Any) -> str:
    """Return why a parameter may not have a value: it is none of its choices; empty if it may."""
    if spec.choices is None or value in spec.choices:
        return ''
    return f"'{value}' is not one of {', '.join(map(str, spec.choices))}"


def _refuse(
    specs: Mapping[str, ParameterSpec], node: NodeSpec, changes: list[Parameter]
) -> SetParametersResult:
    for change in changes:
        if (spec := specs.get(change.name)) and (reason := find_refusal(spec, change.value)):
            return SetParametersResult(successful=False, reason=reason)
        for timer in node.timers.values():
            for key, reference in timer.by_parameter.items():
                if reference.parameter == change.name and (
                    problem := find_value_problem(key, reference, change.value)
                ):
                    reason = f"timer '{timer.name}' follows it: {problem}"
                    return SetParametersResult(successful=False, reason=reason)
    return SetParametersResult(successful=True)


def _as_changes(changes: Iterable[Parameter]) -> dict[str, Any]:
    return {change.name: change.value for change in changes}


def _telling(node: LiveNode, spec: BehaviourSpec) -> Callable[[list[Parameter]], None]:
    """Return what tells `after_parameters_set` of changes."""
    call = node.call(Owner('after_parameters_set'), spec.path, node.bind(spec))

    def tell(changes: list[Parameter]) -> None:
        node.run_to_end(call, _as_changes(changes))

    return tell


def _create_callback(
    node: LiveNode, spec: BehaviourSpec
) -> Callable[[list[Parameter]], SetParametersResult]:
    """Return what asks `on_parameters` whether changes are accepted."""
    function = node.bind(spec)
    call = node.call(Owner('on_parameters'), spec.path, function, deliver=return_result)

    def ask(changes: list[Parameter]) -> SetParametersResult:
        # rclpy wants the answer when this returns, so a coroutine is waited for.
        reason = node.run_to_end(call, _as_changes(changes))
        if reason is FAILED:
            reason = 'on_parameters raised an error'
        return SetParametersResult(successful=reason is None, reason=str(reason or ''))

    return ask
