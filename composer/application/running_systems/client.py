"""Asks running systems, by the services of their control nodes."""

from __future__ import annotations

import importlib.util
import os
import time
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Self

from composer.errors import ComposerError, RosNotFoundError, UsageError
from composer.network.variables import PEERS, drop_unknown_peers
from composer.processes.kernel import CLIENT_THREADS, check_threads
from composer.records import record
from composer.runtime.control import protocol
from composer.runtime.environment import (
    check_middleware,
    check_ros,
    check_shell,
    environment_set,
)
from composer.runtime.health.system_state import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence


_POLL_SEC = 0.05
# How often it is seen whether who was asked is still there.
_LOOK_SEC = 0.5
_ASK_AGAIN_SEC = 1.0
STATUS_SEC = 5.0


class EndedError(ComposerError):
    """A system ended before it answered."""


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

    Args:
        name: The beginning of the node's name.
        ros_arguments: Those of a command line, as `-r` and `/scan:=/raw`.

    Attributes:
        domain_id: The ROS domain that it is in.
        node: The node itself.
        executor: The one that the node is in; it runs while it is waited for something.

    Raises:
        RosNotFoundError: There is no rclpy, or no std_srvs.
        StartError: ROS cannot start.
        UsageError: The ROS arguments are wrong.
    """

    def __init__(self, name: str = '_composer_client', ros_arguments: Sequence[str] = ()) -> None:
        self._name, self._ros_arguments = name, ros_arguments
        check_ros()
        check_threads(CLIENT_THREADS)
        if importlib.util.find_spec('std_srvs') is None:
            message = 'systems are asked by the services of std_srvs, which is not installed'
            raise RosNotFoundError(message)
        # As a system does that it may ask, which runs without the peers that are not known.
        peers = {PEERS: os.environ[PEERS]} if PEERS in os.environ else {}
        self._variables, _ = drop_unknown_peers(peers)
        with environment_set(self._variables):
            check_shell({})
        check_middleware(os.environ)

    def __enter__(self) -> Self:
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        from rclpy.parameter import Parameter

        with ExitStack() as stack:
            stack.enter_context(environment_set(self._variables))
            context = self._context = Context()
            try:
                # No log file: it logs nothing.
                context.init(['--ros-args', *self._ros_arguments], initialize_logging=False)
            except Exception as error:
                message = f'ROS 2 cannot start: {error}'
                raise UsageError(message) from error
            stack.callback(context.try_shutdown)
            self.domain_id: int = context.get_domain_id()
            self.node = Node(
                f'{self._name}_{os.getpid()}',
                context=context,
                enable_rosout=False,
                start_parameter_services=False,
                parameter_overrides=[Parameter('start_type_description_service', value=False)],
            )
            stack.callback(self.node.destroy_node)
            self.executor = SingleThreadedExecutor(context=context)
            self.executor.add_node(self.node)
            stack.callback(self.executor.shutdown)
            self._exit = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._exit.close()

    def interrupt(self) -> None:
        """Let what another thread waits for raise an error at once."""
        self._context.try_shutdown()

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

    def restart(
        self, system: RunningSystem, node: str, timeout_sec: float, action: str = 'restart'
    ) -> Outcome:
        """Let a system build a node anew; see `ask`.

        Args:
            node: The full name of the node.
            action: Or `stop` or `start` it.
        """
        from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
        from rcl_interfaces.srv import SetParametersAtomically

        kind = ParameterType.PARAMETER_STRING
        request = SetParametersAtomically.Request(
            parameters=[
                Parameter(name=name, value=ParameterValue(type=kind, string_value=text))
                for name, text in (('node', node), ('action', action))
            ]
        )
        with self._client(SetParametersAtomically, f'{system.node}/{protocol.RESTART}') as client:
            result = self._call(client, request, system, timeout_sec).result
            return Outcome(result.successful, result.reason)

    @contextmanager
    def _client(self, service: Any, name: str) -> Iterator[Any]:
        client = self.node.create_client(service, name)
        try:
            yield client
        finally:
            self.node.destroy_client(client)

    def _call(self, client: Any, request: Any, system: RunningSystem, timeout_sec: float) -> Any:
        deadline = time.monotonic() + timeout_sec
        if not client.wait_for_service(min(timeout_sec, STATUS_SEC)):
            message = f"system '{system.name}' does not answer"
            raise ComposerError(message)
        future = client.call_async(request)
        while not future.done():
            self.executor.spin_until_future_complete(future, _LOOK_SEC)
            if future.done():
                break
            if not client.service_is_ready():
                message = f"system '{system.name}' ended before it answered"
                raise EndedError(message)
            if time.monotonic() > deadline:
                message = f"system '{system.name}' did not answer within {timeout_sec:g} s"
                raise ComposerError(message, help='it may do it yet')
        return future.result()

    def ask_all(self, services: Sequence[str]) -> list[str | None]:
        """Call services, all at the same time; return their messages, `None` for no answer."""
        from std_srvs.srv import Trigger

        clients = [self.node.create_client(Trigger, name) for name in services]
        wait_until(lambda: all(each.service_is_ready() for each in clients), STATUS_SEC)
        calls: list[list[Any]] = [[] for _ in clients]
        deadline = time.monotonic() + STATUS_SEC
        while (now := time.monotonic()) < deadline and not all(map(_first_answer, calls)):
            # An answer is lost if the server has not discovered this client yet: ask again.
            for client, asked in zip(clients, calls, strict=True):
                if _first_answer(asked) is None:
                    asked.append(client.call_async(Trigger.Request()))
            end = min(now + _ASK_AGAIN_SEC, deadline)
            for asked in calls:
                remaining_sec = max(0.0, end - time.monotonic())
                self.executor.spin_until_future_complete(asked[-1], remaining_sec)
        for client in clients:
            self.node.destroy_client(client)
        answers = map(_first_answer, calls)
        return [None if answer is None else answer.message for answer in answers]

    def list_services(self) -> list[str]:
        """Return the full names of all services on the graph."""
        return [name for name, _ in self.node.get_service_names_and_types()]


def _first_answer(calls: Sequence[Any]) -> Any:
    """Return the first answer to one of several calls of a service, `None` if there is none."""
    return next((call.result() for call in calls if call.done()), None)


def wait_until(condition: Callable[[], bool], timeout_sec: float) -> bool:
    """Wait until a condition holds; return whether it did in time."""
    deadline = time.monotonic() + timeout_sec
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(_POLL_SEC)
    return True
