"""The rclpy node of a node in the file, with only those of ROS's own services that it needs.

Their costs for each node (rclpy 7.1.6 and Fast DDS 2.14 on two cores, 40 nodes in a process;
a node without any takes 0.01 MB and 0.3 ms):

| | MB | ms |
|---|---|---|
| parameter services (six) | 0.9 | 3 |
| logger services (two) | 0.2 | 0.4 |
| type description service | 0.13 | 0.4 |
| publisher of `/rosout` | 0.07 | 0.2 |
| publisher of `/parameter_events` | 0.07 | 0.3 |

So a node has

- parameter services, as every ROS node: `ros2 param list` waits five seconds for those of each
  node. They are there from the start if the node declares parameters, which the `on_start` of
  another one may want to set; otherwise they are created later (see
  `composer.runtime.nodes.parameter_services`).
- `/rosout`, as every ROS node: it is cheap, and users expect a node's log there. It is created
  with the node, not with the first line: subscriptions that are not transient local would miss
  that line.
- `/parameter_events` from the start if it declares parameters, otherwise from the first change
  of a parameter, or with its parameter services.
- no type description service: no tool of Jazzy calls it.
- no logger services: rclpy leaves them out, too.

The file turns each of them on or off.

What parameter files say is given as overrides, as it was when the system was read: a node that
starts again while they are edited is as it was. What the command line gives wins over them.
"""

from __future__ import annotations

import threading
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from rclpy.impl import rcutils_logger
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_service import ParameterService

from composer.ament import remaps_actions
from composer.names import expand_name
from composer.runtime.logs import has_rosout_publisher
from composer.runtime.middleware.lost_participants import LostParticipants
from composer.terminal import escape_log

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rcl_interfaces.msg import ParameterDescriptor, ParameterEvent, SetParametersResult
    from rclpy.context import Context
    from rclpy.impl.logging_severity import LoggingSeverity
    from rclpy.publisher import Publisher

    from composer.language.specs import NodeSpec
    from composer.ros_parameters.file_reader import ParameterEntry

_PARAMETER_EVENTS = '/parameter_events'
_TYPE_DESCRIPTION = 'start_type_description_service'
_SIM_TIME = 'use_sim_time'
_POLL_SEC = 0.001
# rclpy leaves out the files in this list when it looks for the line of code that logs.
rcutils_logger._internal_callers.append(__file__)  # noqa: SLF001


class ComposedRosNode(Node):
    """A node of rclpy as a file declares it, without its entities.

    Args:
        ros_arguments: The arguments after `--ros-args` of the command line.

    Args:
        entries: What the parameter files of the node say, by the names of the parameters; the
            command line wins over them.

    Attributes:
        from_files: The parameters that the node has from its parameter files, by name.
        lost: The participants that were killed, whose servers are not there for its clients.
    """

    lost = LostParticipants()

    def __init__(
        self,
        spec: NodeSpec,
        context: Context,
        ros_arguments: Sequence[str],
        entries: Mapping[str, ParameterEntry],
    ) -> None:
        given: set[str] = set()
        if ros_arguments:
            from composer.ros_parameters.overrides import find_names_given

            given = find_names_given(ros_arguments, spec.full_name)
        self.from_files = {name: entries[name] for name in entries if name not in given}
        self._node_logger: NodeLogger | None = None
        self._late_events: _LatePublisher | None = None
        hooks = spec.before_parameters_set, spec.on_parameters, spec.after_parameters_set
        has_parameters = bool(spec.parameters) or spec.has_other_parameters or any(hooks)
        self._events_are_late = not has_parameters
        self._lacks_services = spec.parameter_services and not has_parameters
        # Global arguments hold for every node of the process, where a __node rule would give all
        # of them one name.
        super().__init__(
            spec.name,
            context=context,
            namespace=spec.namespace,
            cli_args=_node_arguments(spec, self.from_files, ros_arguments),
            parameter_overrides=_as_overrides(self.from_files),
            use_global_arguments=False,
            enable_rosout=spec.rosout,
            start_parameter_services=spec.parameter_services and has_parameters,
            enable_logger_service=spec.logger_services,
            allow_undeclared_parameters=spec.allow_undeclared_parameters,
            automatically_declare_parameters_from_overrides=(
                spec.automatically_declare_parameters_from_overrides
            ),
        )
        for name in (_SIM_TIME, _TYPE_DESCRIPTION):
            if name not in self.from_files and name not in given:
                # The file of the system says it, and parameter files that come win over that.
                self._parameter_overrides.pop(name, None)
        if self._late_events is not None:
            self._late_events.open()

    def create_publisher(self, msg_type: Any, topic: str, *arguments: Any, **options: Any) -> Any:
        """See the base class, whose constructor creates the publisher of parameter events."""
        if topic != _PARAMETER_EVENTS or not self._events_are_late:
            return super().create_publisher(msg_type, topic, *arguments, **options)
        self._events_are_late = False
        self._late_events = _LatePublisher(
            lambda: self.create_publisher(msg_type, topic, *arguments, **options)
        )
        return self._late_events

    def get_logger(self) -> NodeLogger:
        """Return the logger, which takes any level from any line of code."""
        if self._node_logger is None:
            self._node_logger = NodeLogger(super().get_logger().name)
        return self._node_logger

    def create_client(self, *arguments: Any, **options: Any) -> Any:
        """See the base class; a server that was killed is not ready for it."""
        client = super().create_client(*arguments, **options)
        is_ready, service = client.service_is_ready, client.service_name
        client.service_is_ready = lambda: (
            is_ready() and not self.lost.have_all_servers(self, service)
        )
        return client

    def resolve_action_name(self, name: str) -> str:
        """Return the full name of an action, which newer versions of ROS remap as a topic."""
        if remaps_actions():
            return str(self.resolve_topic_name(name))
        return expand_name(name, self.get_name(), self.get_namespace())

    def follow_files(self, entries: Mapping[str, ParameterEntry]) -> None:
        """Let parameters that are declared from now on have the values of parameter files.

        Args:
            entries: What the files say now; the command line wins over them.
        """
        overrides = self._parameter_overrides
        for name in self.from_files:
            overrides.pop(name, None)
        self.from_files = {name: entries[name] for name in entries if name not in overrides}
        overrides.update({each.name: each for each in _as_overrides(self.from_files)})

    def find_override(self, name: str) -> Any:
        """Return the value that a file or the command line gives a parameter; `None` for none."""
        entry, override = self.from_files.get(name), self._parameter_overrides.get(name)
        return entry.value if entry else override and override.value

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """See the base class; values have the types that are declared, see `as_declared`."""
        results: list[SetParametersResult] = super().set_parameters(
            [self.as_declared(each) for each in parameter_list]
        )
        return results

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """See the base class; values have the types that are declared, see `as_declared`."""
        return super().set_parameters_atomically(
            [self.as_declared(each) for each in parameter_list]
        )

    def as_declared(self, parameter: Parameter) -> Parameter:
        """Return a parameter with the type that is declared, where its value allows that.

        An empty list has any type of lists, and an integer is a double.
        """
        if not self.has_parameter(parameter.name):
            return parameter
        kind = Parameter.Type(self.describe_parameter(parameter.name).type)
        value, is_array = parameter.value, parameter.type_.name.endswith('_ARRAY')
        if kind in (Parameter.Type.NOT_SET, parameter.type_):
            return parameter
        if is_array and kind.name.endswith('_ARRAY') and not len(value):
            return Parameter(parameter.name, kind, [])
        given = {'INTEGER': 'DOUBLE', 'INTEGER_ARRAY': 'DOUBLE_ARRAY'}.get(parameter.type_.name)
        if given != kind.name:
            return parameter
        doubles = [float(item) for item in value] if is_array else float(value)
        return Parameter(parameter.name, kind, doubles)

    def start_parameter_services(self) -> None:
        """Create the parameter services, unless the node has them or the file turns them off."""
        if not self._lacks_services:
            return
        self._lacks_services = False
        if self._late_events is not None:
            self._late_events.create()
        self._parameter_service = ParameterService(self)

    def copy_parameter(self, name: str) -> tuple[Parameter, ParameterDescriptor]:
        """Return a parameter and its descriptor, for `put_parameter`."""
        return self._parameters[name], self._descriptors[name]

    def put_parameter(self, parameter: Parameter, descriptor: ParameterDescriptor) -> None:
        """Make a parameter what it was: nobody is asked, and nothing refuses it."""
        self._parameters[parameter.name] = parameter
        self._descriptors[parameter.name] = descriptor

    def wait_until_gone(self, timeout_sec: float) -> bool:
        """Wait until the destroyed node is gone; return whether it went in time.

        An executor that waits for an entity of the node keeps the entity, and with it the node,
        until it wakes up. A new node of that name would meanwhile get no publisher of `/rosout`,
        and lose its next one when the old node ends.
        """
        deadline = monotonic() + timeout_sec
        name = self.get_logger().name
        while has_rosout_publisher(name):
            if monotonic() > deadline:
                return False
            sleep(_POLL_SEC)
        return True


class _LatePublisher:
    """Creates its publisher when there is something to publish.

    It publishes nothing before it is opened: the constructor of a node declares the parameters
    that every node has, which are of no interest.
    """

    def __init__(self, create: Callable[[], Publisher]) -> None:
        self._create = create
        self._publisher: Publisher | None = None
        self._lock = threading.Lock()
        self._is_open = False

    def open(self) -> None:
        """Publish from now on."""
        self._is_open = True

    def publish(self, event: ParameterEvent) -> None:
        """Publish a change of parameters."""
        if self._is_open:
            self.create().publish(event)

    def create(self) -> Publisher:
        """Return the publisher, which is created if there is none."""
        with self._lock:
            if self._publisher is None:
                self._publisher = self._create()
        return self._publisher


def _node_arguments(
    spec: NodeSpec,
    from_files: Mapping[str, ParameterEntry],
    ros_arguments: Sequence[str],
) -> list[str]:
    """Return the node's arguments: of remapping rules the first wins, of parameters the last."""
    arguments = ['--ros-args']
    if spec.use_sim_time and _SIM_TIME not in from_files:
        arguments += ['-p', f'{_SIM_TIME}:=true']
    if not spec.type_description_service and _TYPE_DESCRIPTION not in from_files:
        arguments += ['-p', f'{_TYPE_DESCRIPTION}:=false']
    arguments += ros_arguments
    for old, new in spec.remap:
        arguments += ['-r', f'{old}:={new}']
    return arguments


def _as_overrides(entries: Mapping[str, ParameterEntry]) -> list[Parameter]:
    return [
        Parameter(name, Parameter.Type[entry.type.upper()], entry.value)
        for name, entry in entries.items()
        # An empty list has no type.
        if entry.type is not None
    ]


class NodeLogger(RcutilsLogger):
    """A logger that takes any level and options from any line of code.

    rclpy keeps what a line has logged first, and refuses another level or other options from it:
    `log = logger.info if ok else logger.warning`. So each level with its options has a logger of
    rclpy's. What a behaviour logs may be what others have sent: it can forge no line, and no
    terminal obeys more of it than its colours.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._alike: dict[object, RcutilsLogger] = {}

    def log(self, message: str, severity: LoggingSeverity, **options: object) -> bool:
        """See the base class."""
        key = severity, *sorted((name, repr(value)) for name, value in options.items())
        logger = self._alike.get(key)
        if logger is None:
            logger = self._alike.setdefault(key, RcutilsLogger(self.name))
        text = escape_log(message) if isinstance(message, str) else message
        return bool(logger.log(text, severity, **options))

    def get_child(self, name: str) -> NodeLogger:
        """See the base class."""
        child = super().get_child(name)
        logger = NodeLogger(child.name)
        logger.logger_sublogger_namepair = child.logger_sublogger_namepair
        child.logger_sublogger_namepair = None  # Its finalizer would take it away.
        return logger
