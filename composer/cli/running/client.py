"""Finds the systems that run on this ROS graph, and asks them."""

from __future__ import annotations

import importlib.util
import os
import select
import time
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from composer.cli.running import answer_forms
from composer.errors import ComposerError, RosNotFoundError, UsageError
from composer.planning.snapshot_data import decode_snapshot
from composer.records import record
from composer.runtime.control import protocol
from composer.runtime.control.name_claim import find_address, list_claims
from composer.runtime.environment import check_middleware, check_ros, check_shell
from composer.runtime.health.system_state import Outcome
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from composer.planning.snapshot import Snapshot

# How long systems on other hosts may take to be found, and those that are on this one for sure.
_SEARCH_SEC = 1.0
_LOCAL_SEARCH_SEC = 10.0
_POLL_SEC = 0.05
STATUS_SEC = 5.0
_SNAPSHOT_SEC = 30.0


@record
class RunningSystem:
    """A system that was found.

    Attributes:
        name: As it says itself.
        node: The full name of its control node.
        status: What it says of itself; `None` if it says nothing that is understood.
        problem: Why there is no status, in two words.
    """

    name: str
    node: str
    status: dict[str, Any] | None
    problem: str = ''


class Client:
    """A node beside those of the systems, while it is entered.

    Raises:
        RosNotFoundError: There is no rclpy, or no std_srvs.
        StartError: ROS cannot start.
    """

    def __init__(self) -> None:
        check_ros()
        if importlib.util.find_spec('std_srvs') is None:
            message = 'systems are asked by the services of std_srvs, which is not installed'
            raise RosNotFoundError(message)
        check_shell({})
        check_middleware(os.environ)
        self._exit = ExitStack()

    def __enter__(self) -> Self:
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        from rclpy.parameter import Parameter

        context = Context()
        # No log file: it logs nothing.
        context.init([], initialize_logging=False)
        self._exit.callback(context.try_shutdown)
        self._domain_id: int = context.get_domain_id()
        self._node = Node(
            f'_composer_client_{os.getpid()}',
            context=context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=[Parameter('start_type_description_service', value=False)],
        )
        self._exit.callback(self._node.destroy_node)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._exit.callback(self._executor.shutdown)
        return self

    def __exit__(self, *_: object) -> None:
        self._exit.close()

    def find_all(self) -> list[RunningSystem]:
        """Return the systems on this ROS graph, by their names; what is far may need a second."""
        self._search(lambda _found: False)
        return self._ask_status(self._list_control_nodes())

    def find_silent(self, found: Iterable[RunningSystem]) -> list[int]:
        """Return the processes of systems on this host that were not found: they say nothing."""
        known = {find_address(_last(each.node), self._domain_id) for each in found}
        claims = list_claims(self._domain_id)
        return [
            each['pid'] for each in claims if 'name' not in each and each['address'] not in known
        ]

    def find(self, name: str | None) -> RunningSystem:
        """Return the system of this name; without one, the only system that there is.

        Raises:
            ComposerError: There is none, or it cannot be asked.
            UsageError: There are several.
        """
        if name is not None:
            wanted = protocol.node_name(name)
            self._search(lambda found: any(_last(node) == wanted for node in found))
            for node in self._list_control_nodes():
                if _last(node) == wanted:
                    (system,) = self._ask_status([node])
                    return replace(system, name=name)
            systems = self._ask_status(self._list_control_nodes())
        else:
            systems = self.find_all()
        if name is None and len(systems) == 1:
            return systems[0]
        raise self._explain(name, [each.name for each in systems])

    def ask(self, system: RunningSystem, command: str, timeout_sec: float) -> Outcome:
        """Give a system a command, and return its answer.

        Raises:
            ComposerError: It did not answer in time, or ended before it did.
        """
        with self.asking(system, command) as ask:
            return ask(timeout_sec)

    @contextmanager
    def asking(self, system: RunningSystem, command: str) -> Iterator[Callable[[float], Outcome]]:
        """Yield what does as `ask`, given the longest time, as often as it is called."""
        from std_srvs.srv import Trigger

        with self._client(Trigger, f'{system.node}/{command}') as client:

            def ask(timeout_sec: float) -> Outcome:
                response = self._call(client, Trigger.Request(), system, timeout_sec)
                return Outcome(response.success, response.message)

            yield ask

    def restart(self, system: RunningSystem, node: str, timeout_sec: float) -> Outcome:
        """Let a system build a node anew; see `ask`.

        Args:
            node: The full name of the node.
        """
        from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
        from rcl_interfaces.srv import SetParametersAtomically

        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=node)
        request = SetParametersAtomically.Request(parameters=[Parameter(name='node', value=value)])
        with self._client(SetParametersAtomically, f'{system.node}/{protocol.RESTART}') as client:
            result = self._call(client, request, system, timeout_sec).result
            return Outcome(result.successful, result.reason)

    def stop(self, system: RunningSystem, timeout_sec: float) -> bool:
        """Stop a system, and wait until it has left the graph; return whether it has.

        One on this host has left with its process, of which the graph may hear late.
        """
        pid = self._list_local().get(_last(system.node))
        process = None if pid is None else _open_process(pid)
        try:
            self.ask(system, protocol.DOWN, STATUS_SEC)
            if process is None:
                return self._wait(
                    lambda: system.node not in self._list_control_nodes(), timeout_sec
                )
            return bool(select.select([process], [], [], timeout_sec)[0])
        finally:
            if process is not None:
                os.close(process)

    @contextmanager
    def _client(self, service: Any, name: str) -> Iterator[Any]:
        client = self._node.create_client(service, name)
        try:
            yield client
        finally:
            self._node.destroy_client(client)

    def _call(self, client: Any, request: Any, system: RunningSystem, timeout_sec: float) -> Any:
        deadline = time.monotonic() + timeout_sec
        if not client.wait_for_service(min(timeout_sec, STATUS_SEC)):
            message = f"system '{system.name}' does not answer"
            raise ComposerError(message)
        future = client.call_async(request)
        while not future.done():
            self._executor.spin_until_future_complete(future, _SEARCH_SEC / 2)
            if future.done():
                break
            if not client.service_is_ready():
                message = f"system '{system.name}' ended before it answered"
                raise ComposerError(message)
            if time.monotonic() > deadline:
                message = f"system '{system.name}' did not answer within {timeout_sec:g} s"
                raise ComposerError(message, help='it may do it yet')
        return future.result()

    def _ask_status(self, nodes: Sequence[str]) -> list[RunningSystem]:
        """Return systems by their names with what they say, asked all at the same time."""
        from std_srvs.srv import Trigger

        names = [f'{node}/{protocol.STATUS}' for node in nodes]
        clients = [self._node.create_client(Trigger, name) for name in names]
        self._wait(lambda: all(each.service_is_ready() for each in clients), STATUS_SEC)
        calls = [each.call_async(Trigger.Request()) for each in clients]
        deadline = time.monotonic() + STATUS_SEC
        for call in calls:
            self._executor.spin_until_future_complete(call, max(0.0, deadline - time.monotonic()))
        texts = [call.result().message if call.done() else None for call in calls]
        for client in clients:
            self._node.destroy_client(client)
        systems = [_read_status(node, text) for node, text in zip(nodes, texts, strict=True)]
        return sorted(systems, key=lambda each: (each.name, each.node))

    def _search(self, is_enough: Callable[[list[str]], bool]) -> None:
        """Wait until systems had the time to be found."""
        begun = time.monotonic()
        local = self._list_local()

        def is_over() -> bool:
            found = self._list_control_nodes()
            if is_enough(found):
                return True
            has_all = local.keys() <= {_last(node) for node in found}
            return has_all and time.monotonic() > begun + _SEARCH_SEC

        self._wait(is_over, _LOCAL_SEARCH_SEC)

    def _list_local(self) -> dict[str, int]:
        """Return the control nodes and processes of the systems here that can be asked."""
        claims = list_claims(self._domain_id)
        return {
            protocol.node_name(str(each['name'])): each['pid']
            for each in claims
            if each.get('is_asked')
        }

    def _list_control_nodes(self) -> list[str]:
        services = (name for name, _ in self._node.get_service_names_and_types())
        return sorted(filter(None, map(protocol.find_control_node, services)))

    def _explain(self, name: str | None, names: list[str]) -> ComposerError:
        domain = f'ROS_DOMAIN_ID {self._domain_id}'
        if name is None and names:
            message = f'several systems run on this ROS graph ({domain})'
            return UsageError(message, help=f'name one of them: {", ".join(names)}')
        claims = list_claims(self._domain_id)
        if name in [each.get('name') for each in claims if not each.get('is_asked', True)]:
            message = f"system '{name}' was started with --no-control, and cannot be asked"
            return ComposerError(message)
        silent = {each['address']: each['pid'] for each in claims if 'name' not in each}
        address = find_address(protocol.node_name(name or ''), self._domain_id)
        if name and address in silent:
            return ComposerError(f"system '{name}' (pid {silent[address]}) does not answer")
        advice = suggest(name, names, 'there are') if name else None
        if silent:
            advice = f'process {min(silent.values())} runs a system, and does not answer'
        what = f"there is no system '{name}'" if name else 'no system runs'
        return ComposerError(f'{what} on this ROS graph ({domain})', help=advice)

    @staticmethod
    def _wait(condition: Callable[[], bool], timeout_sec: float) -> bool:
        deadline = time.monotonic() + timeout_sec
        while not condition():
            if time.monotonic() > deadline:
                return False
            time.sleep(_POLL_SEC)
        return True


def ask_snapshot(name: str) -> Snapshot:
    """Return what a running system runs as.

    Raises:
        ComposerError: There is no such system, or it does not answer.
    """
    with Client() as client:
        outcome = client.ask(client.find(name), protocol.SNAPSHOT, _SNAPSHOT_SEC)
    return decode_snapshot(answer_forms.read_answer(outcome.text))


def _read_status(node: str, text: str | None) -> RunningSystem:
    """Return the system at a control node, which anybody may have created."""
    name = _last(node).removeprefix(protocol.node_name(''))
    if text is None:
        return RunningSystem(name, node, None, 'no answer')
    try:
        status = answer_forms.read_answer(text, answer_forms.STATUS)
    except ComposerError:
        return RunningSystem(name, node, None, 'unknown answer')
    if protocol.node_name(status['name']) != _last(node):
        return RunningSystem(name, node, None, 'wrong name')
    return RunningSystem(status['name'], node, status)


def _open_process(pid: int) -> int | None:
    try:
        return os.pidfd_open(pid)
    except ProcessLookupError:
        return None


def _last(node: str) -> str:
    return node.rpartition('/')[2]
