"""The components of a system: loaded into their containers, and again when these are restarted."""

from __future__ import annotations

import threading
from dataclasses import replace
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeAlias

from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter

from composer.errors import StartError
from composer.language.specs import DEFAULT_WAIT_SEC, ConditionSpec
from composer.names import expand_name, remap_name, split_name
from composer.records import record
from composer.ros_parameters.parameter_types import convert_parameter_value, infer_parameter_type
from composer.runtime.external.container_client import (
    LOAD_SERVICE,
    ContainerClient,
    ContainerError,
)
from composer.runtime.logs import system_logger
from composer.runtime.middleware.ros_graph import create_graph_node
from composer.runtime.nodes.system_handle import never
from composer.runtime.system_executor import SystemExecutor
from composer.runtime.wait_for import Waiter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from rclpy.node import Node as RosNode

    from composer.language.specs import ComponentSpec
    from composer.processes.external_process import ExternalProcess, ProcessRun
    from composer.runtime.nodes.system_handle import SystemHandle

OnLoad: TypeAlias = 'Callable[[ExternalProcess, ComponentSpec, Callable[[], bool]], None]'
_NODE_NAME = '_composer_components'
# How long containers that run elsewhere may take, all together, as Composer stops.
_STOP_SEC = 3.0
_POLL_SEC = 0.05
# How often is looked whether a container that runs elsewhere is another one.
_LOOK_SEC = 1.0
_LEVEL_SEC = 5.0
# How long the services of a component that was loaded may take to be seen.
_SERVICE_SEC = 1.0


@record
class _Loaded:
    """A component in its container.

    Attributes:
        servers: See `ContainerClient.servers`.
    """

    component: ComponentSpec
    process: ExternalProcess
    unique_id: int
    servers: frozenset[bytes]


class Components:
    """Loads and unloads the components of a system.

    Attributes:
        on_load: Called with each component that was loaded, or that an edit has changed, its
            container, and what tells whether it has gone.
    """

    def __init__(self, system: SystemHandle) -> None:
        self._system = system
        self.on_load: OnLoad = lambda _process, _component, _has_ended: None
        self._loaded: dict[tuple[str, str], _Loaded] = {}
        self._clients: dict[str, ContainerClient] = {}
        # The last run of each container that has all its components again.
        self._reloaded: dict[str, ProcessRun | None] = {}
        self._node: RosNode | None = None
        self._executor: SystemExecutor | None = None
        self._is_outdated: Callable[[], bool] = never
        self._stopping = threading.Event()
        self._watcher: threading.Thread | None = None
        # Held while a container is asked.
        self._lock = threading.RLock()

    def list_names(self) -> list[str]:
        """Return the full names of the components that are loaded."""
        return [each.component.full_name for each in list(self._loaded.values())]

    def waiters(self, processes: Iterable[ExternalProcess]) -> Iterator[Waiter]:
        """Yield what loads the components of containers that start now."""
        for process in processes:
            if not process.spec.on_demand:
                for component in process.spec.components.values():
                    yield self.waiter(process, component)

    def waiter(self, process: ExternalProcess, component: ComponentSpec) -> Waiter:
        """Return what loads a component once its container, and all it waits for, is there."""
        spec = process.spec
        waits = (*spec.wait_for, *component.wait_for)
        timeout_sec = DEFAULT_WAIT_SEC + spec.delay_sec + sum(each.timeout_sec for each in waits)
        service = f'{spec.full_name}/{LOAD_SERVICE}'
        needed = [ConditionSpec('service', service, timeout_sec, None, component.path)]
        if not spec.external:
            path = component.path
            needed.insert(0, ConditionSpec('process', spec.name, timeout_sec, 'running', path))
        return Waiter(
            f"component '{component.key}'",
            component.full_name,
            (*needed, *component.wait_for),
            0.0,
            partial(_resolve, component),
            lambda text: system_logger.info(f"component '{component.key}': {text}"),
            partial(self.load, process, component, self._system.is_outdated),
            lambda: not process.is_leaving,
        )

    def load(
        self,
        process: ExternalProcess,
        component: ComponentSpec,
        is_outdated: Callable[[], bool] = never,
    ) -> None:
        """Load a component.

        Args:
            is_outdated: Returns whether there is a newer edit, for which it is left.

        Raises:
            StartError: The container cannot load it, or is gone for good.
        """
        run = process.run
        try:
            self._try_to_load(process, component, is_outdated)
        except StartError:
            # One that is started again gets all its components again.
            if not self._is_reloaded(process, run, component, is_outdated):
                raise

    def _is_reloaded(
        self,
        process: ExternalProcess,
        run: ProcessRun | None,
        component: ComponentSpec,
        is_outdated: Callable[[], bool],
    ) -> bool:
        """Wait for the next run of a container that has ended; return whether that has it."""
        if process.spec.external or (process.run is run and process.has_come_to('running')):
            return False
        while process.run is run or self._reloaded.get(process.spec.name) is not process.run:
            is_over = process.is_done or process.is_leaving or is_outdated()
            if is_over or self._system.stop.is_set or self._stopping.wait(_POLL_SEC):
                return False
        return (process.spec.name, component.key) in self._loaded

    def _try_to_load(
        self, process: ExternalProcess, component: ComponentSpec, is_outdated: Callable[[], bool]
    ) -> None:
        with self._lock:
            if (process.spec.name, component.key) in self._loaded:
                # Its container was started again, and got all its components, while it waited.
                return
            self._is_outdated = is_outdated
            try:
                self._load(process, component)
            except ContainerError as error:
                if self._system.stop.is_set:
                    return
                place = self._system.positions.key(component.path).place
                message = (
                    f"component '{component.key}' ({place}) cannot be loaded into "
                    f"'{process.spec.full_name}': {error}"
                )
                raise StartError(message) from error
            finally:
                self._is_outdated = never

    def unload(self, container: str, key: str, timeout_sec: float = DEFAULT_WAIT_SEC) -> bool:
        """Unload a component, if it is loaded; return whether it is not any more."""
        with self._lock:
            loaded = self._loaded.pop((container, key), None)
            if loaded is None:
                return True
            try:
                self._client(loaded.process).unload(loaded.unique_id, timeout_sec)
            except ContainerError as error:
                system_logger.warning(f"component '{key}' could not be unloaded: {error}")
                return False
            return True

    def restart(self, full_name: str) -> str:
        """Unload and load a component; return why that failed, an empty string if it did not."""
        with self._lock:
            for (container, key), loaded in list(self._loaded.items()):
                if loaded.component.full_name == full_name:
                    self.unload(container, key)
                    try:
                        self.load(loaded.process, loaded.component)
                    except StartError as error:
                        system_logger.error(str(error))
                        return str(error)
                    return ''
        return f"there is no node '{full_name}' any more"

    def release(self, process: ExternalProcess, timeout_sec: float = DEFAULT_WAIT_SEC) -> None:
        """Let go of a container: unload what was loaded into one that is not ours."""
        with self._lock:
            answers = process.spec.external
            for container, key in list(self._loaded):
                if self._loaded[container, key].process is process:
                    # One that is silent once is not asked again.
                    answers = answers and self.unload(container, key, timeout_sec)
                    self._loaded.pop((container, key), None)
            if client := self._clients.pop(process.spec.name, None):
                client.destroy()

    def reload(self, process: ExternalProcess) -> None:
        """Load all components into a container that has begun anew."""
        run = process.run
        try:
            self._reload(process)
        finally:
            self._reloaded[process.spec.name] = run

    def _reload(self, process: ExternalProcess) -> None:
        name, components = process.spec.name, process.spec.components
        if not components:
            return
        with self._lock:
            before: frozenset[bytes] = frozenset()
            for at in [each for each in self._loaded if each[0] == name]:
                before |= self._loaded.pop(at).servers
            client = self._client(process)
            client.forget()
            while not client.servers - before:
                if self._find_end(process) or self._stopping.wait(_POLL_SEC):
                    return
            count = 0
            for component in components.values():
                try:
                    self._try_to_load(process, component, never)
                except StartError as error:
                    system_logger.error(str(error))
                    if self._find_end(process):
                        return
                else:
                    count += 1
        words = 'component was' if count == 1 else 'components were'
        system_logger.info(f"container '{name}': {count} {words} loaded again")

    def stop(self) -> None:
        """Unload what was loaded into containers that are not ours, and ask them no more."""
        self._stopping.set()
        deadline = monotonic() + _STOP_SEC
        with self._lock:
            for process in {each.process for each in self._loaded.values()}:
                self.release(process, deadline - monotonic())
            for client in self._clients.values():
                client.settle(deadline - monotonic())
        if self._watcher is not None:
            self._watcher.join()
        if self._executor is not None:
            self._executor.stop(_STOP_SEC)
        if self._node is not None:
            self._node.destroy_node()

    def _load(self, process: ExternalProcess, component: ComponentSpec) -> None:
        client = self._client(process)
        client.settle()
        name = component.full_name
        timeout_sec = DEFAULT_WAIT_SEC if process.spec.external else None
        if component.is_named and name in client.list_nodes(timeout_sec).values():
            message = f"it has a node '{name}' already, which somebody else has loaded"
            raise ContainerError(message)
        unique_id, full_name = client.load(self.request_for(component), f"'{component.key}'")
        if not component.is_named:
            namespace, name = split_name(full_name)
            component = replace(component, namespace=namespace, name=name)
        self._loaded[process.spec.name, component.key] = _Loaded(
            component, process, unique_id, client.servers
        )
        if component.log_level is not None and client.has_logger_services is not False:
            self._set_level(component, client)
        self._tell_load(self._loaded[process.spec.name, component.key])
        if process.spec.external and self._watcher is None:
            self._watcher = threading.Thread(
                target=self._watch, name='composer-components', daemon=True
            )
            self._watcher.start()

    def request_for(self, component: ComponentSpec) -> Any:
        """Return the `LoadNode.Request` for a component."""
        entries = self._system.parameter_files.get(component.full_name, {})
        return _write_request(component, entries)

    def change(self, container: str, component: ComponentSpec) -> None:
        """Let a loaded component be kept as an edit says."""
        with self._lock:
            at = (container, component.key)
            if (loaded := self._loaded.get(at)) is not None:
                self._loaded[at] = replace(loaded, component=component)
                self._tell_load(self._loaded[at])

    def _tell_load(self, loaded: _Loaded) -> None:
        at = loaded.process.spec.name, loaded.component.key
        self.on_load(loaded.process, loaded.component, lambda: self._loaded.get(at) is not loaded)

    def _watch(self) -> None:
        """Load components again into containers that were restarted by somebody else."""
        while not self._stopping.wait(_LOOK_SEC):
            for loaded in list(self._loaded.values()):
                process = loaded.process
                if not process.spec.external or loaded not in self._loaded.values():
                    continue
                client = self._clients.get(process.spec.name)
                now = client.servers if client else frozenset()
                # The last one may stay in the graph for a while after its death.
                if now - loaded.servers:
                    self.reload(process)

    def _client(self, process: ExternalProcess) -> ContainerClient:
        name = process.spec.name
        if name not in self._clients:
            if self._node is None:
                self._node = create_graph_node(self._system.context, _NODE_NAME)
                self._executor = SystemExecutor(
                    self._system.context, None, log=system_logger.error
                )
                self._executor.add_node(self._node)
                self._executor.start()
            self._clients[name] = ContainerClient(
                self._node, process.spec.full_name, partial(self._find_end, process)
            )
        return self._clients[name]

    def _find_end(self, process: ExternalProcess) -> str:
        """Return why a container will not answer; an empty string if it may."""
        if self._stopping.is_set():
            # Only what has a time limit is asked now.
            return ''
        if self._system.stop.is_set:
            return 'the system stops'
        if self._is_outdated():
            return 'the files have changed meanwhile'
        is_ours = not process.spec.external
        return process.state if is_ours and not process.has_come_to('running') else ''

    def _set_level(self, component: ComponentSpec, container: ContainerClient) -> None:
        """Give the logger of a component its level, if it has a service for that.

        Whether it has one is the container's matter: rclcpp_components has it since Kilted.
        """
        from rcl_interfaces.msg import LoggerLevel
        from rcl_interfaces.srv import SetLoggerLevels

        assert self._node is not None  # noqa: S101 - it has loaded the component
        assert component.log_level is not None  # noqa: S101 - who calls this has looked
        name = f'{component.full_name}/set_logger_levels'
        client = self._node.create_client(SetLoggerLevels, name)
        try:
            if container.has_logger_services is None:
                container.has_logger_services = client.wait_for_service(_SERVICE_SEC)
            if not container.has_logger_services:
                system_logger.warning(
                    f"container '{container.full_name}' has no services for log levels, so that "
                    'log_level of its components counts for nothing: give the levels in its '
                    'arguments, as in [--ros-args, --log-level, NODE:=debug]'
                )
                return
            logger = component.full_name.strip('/').replace('/', '.')
            level = LoggingSeverity[component.log_level.upper()].value
            levels = [LoggerLevel(name=logger, level=level)]
            if client.wait_for_service(_LEVEL_SEC):
                answered = threading.Event()
                future = client.call_async(SetLoggerLevels.Request(levels=levels))
                future.add_done_callback(lambda _future: answered.set())
                if answered.wait(_LEVEL_SEC) and all(
                    each.successful for each in future.result().results
                ):
                    return
            system_logger.warning(f"component '{component.key}': its log level cannot be set")
        finally:
            self._node.destroy_client(client)


def _resolve(component: ComponentSpec, condition: ConditionSpec) -> str:
    """Return the full name for a condition of a component."""
    name, namespace = component.name, component.namespace
    full = expand_name(condition.name, name, namespace)
    if condition.kind not in ('topic', 'service'):
        return full
    return remap_name(full, component.remap, name, namespace, f'ros{condition.kind}')


def _write_request(component: ComponentSpec, entries: Mapping[str, Any]) -> Any:
    """Return the request to load a component.

    Args:
        entries: What its parameter files say, by the names of the parameters.
    """
    from composition_interfaces.srv import LoadNode

    parameters = [
        _typed(name, type_name, value)
        for name, value in _flatten(component.parameters)
        if name not in entries
        and (type_name := component.types.get(name) or infer_parameter_type(value)) is not None
    ]
    parameters += [
        Parameter(name, Parameter.Type[entry.type.upper()], entry.value)
        for name, entry in entries.items()
        if entry.type is not None
    ]
    level = component.log_level
    asked = {
        'use_intra_process_comms': component.intra_process,
        'enable_logger_service': level is not None,
    }
    extra = {name: True for name, is_asked in asked.items() if is_asked}
    extra |= component.extra_arguments
    return LoadNode.Request(
        package_name=component.package,
        plugin_name=component.plugin,
        node_name=component.name if component.is_named else '',
        node_namespace=component.namespace,
        log_level=LoggingSeverity[level.upper()].value if level else 0,
        remap_rules=[f'{old}:={new}' for old, new in component.remap],
        parameters=[each.to_parameter_msg() for each in parameters],
        extra_arguments=[
            Parameter(name, value=value).to_parameter_msg() for name, value in extra.items()
        ],
    )


def _typed(name: str, type_name: str, value: Any) -> Parameter:
    if type_name == 'byte_array':
        value = [bytes([item]) for item in value]
    kind = Parameter.Type[type_name.upper()]
    return Parameter(name, kind, convert_parameter_value(value, type_name))


def _flatten(values: Mapping[str, Any], prefix: str = '') -> Iterator[tuple[str, Any]]:
    """Yield parameters by their full names; those of mappings have dots in them."""
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flatten(value, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}', value
