"""The services of a control node: what is asked of a system, and done with it."""

from __future__ import annotations

import json
import zlib
from base64 import b64encode
from functools import partial
from time import monotonic
from typing import TYPE_CHECKING, Any, Protocol

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup

from composer.errors import ExitCode
from composer.runtime.behaviours.tracebacks import format_internal_error
from composer.runtime.control import protocol
from composer.runtime.control.answers import snapshot_answer
from composer.runtime.health.system_state import Outcome, SystemState
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Callable

    from rclpy.node import Node as RosNode

    from composer.planning.snapshot import Snapshot
    from composer.runtime.health.deliveries import Deliveries
    from composer.runtime.tracing.tracer import TracePart


_STARTING = 'the system is still starting'


class AskedWorkers(Protocol):
    """The workers of a system that is asked."""

    def ask(self, what: str) -> dict[str, Any]:
        """Return what each worker answers that does, by name."""

    def describe(self) -> list[dict[str, Any]]:
        """Return the state of each worker, with the nodes that run in it."""


class ControlledSystem(Protocol):
    """A system that is asked."""

    @property
    def snapshot(self) -> Snapshot:
        """What it runs as."""

    @property
    def state(self) -> SystemState:
        """Its state."""

    @property
    def write_trace(self) -> object:
        """What takes the trace of the whole run; `None` if nothing does."""

    @property
    def workers(self) -> AskedWorkers:
        """Its workers."""

    def list_nodes(self) -> list[str]:
        """Return the full names of its nodes."""

    def list_components(self) -> list[str]:
        """Return the full names of the components that are loaded into its containers."""

    def find_foreign_ends(self) -> list[tuple[str, str, str]]:
        """See `LocalPart`."""

    def find_deliveries(self) -> Deliveries:
        """Return which way the messages of each publisher and the calls of each client go."""

    def restart_node(self, full_name: str) -> Outcome:
        """Build a node anew."""

    def begin_trace(self) -> None:
        """Note what happens from now on."""

    def end_traces(self) -> dict[str, TracePart]:
        """Return what each process has noted."""

    def request_stop(self, code: int = ExitCode.DONE) -> None:
        """Let it stop."""


class Commands(Protocol):
    """What is done with the files of a running system."""

    @property
    def given(self) -> dict[str, list[str]]:
        """The layers, arguments and settings that it was started with, and the stopped nodes."""

    def reload(self, system: Any) -> Outcome:
        """Read the files, and let the system become what they say."""

    def reload_now(self, system: Any) -> Outcome:
        """Do as `reload`, but abort goals that it would wait for, or that it waits for."""

    def switch(self, system: Any, node: str, *, runs: bool) -> Outcome:
        """Stop a node, or start one that was stopped."""

    def plan(self, system: Any) -> Outcome:
        """Read the files, and tell what `reload` would do."""


class ControlServices:
    """Serves commands and queries on a node.

    Args:
        status: Returns what the system says of itself.
        top: Returns the health of its entities.

    Attributes:
        answered: When it answered last, a time of `time.monotonic`.
    """

    def __init__(
        self,
        node: RosNode,
        system: ControlledSystem,
        commands: Commands,
        status: Callable[[], Outcome],
        top: Callable[[], Outcome],
    ) -> None:
        from rcl_interfaces.srv import SetParametersAtomically
        from std_srvs.srv import Trigger

        self._system = system
        self._commands = commands
        self.answered = float('-inf')
        # What changes no node is served beside a reload, which may wait for a goal.
        queries, changes = ReentrantCallbackGroup(), MutuallyExclusiveCallbackGroup()
        services = (
            (protocol.STATUS, status, queries),
            (protocol.TOP, top, queries),
            (protocol.SNAPSHOT, lambda: snapshot_answer(system.snapshot, commands.given), queries),
            (protocol.TRACE, self._begin_trace, changes),
            (protocol.TRACE_READ, self._read_trace, changes),
            (protocol.DOWN, self._stop_system, queries),
            (protocol.PLAN, lambda: commands.plan(system), changes),
            (protocol.RELOAD, lambda: self._reload(commands.reload), changes),
            (protocol.RELOAD_NOW, lambda: self._reload(commands.reload_now), queries),
        )
        for name, answer, group in services:
            node.create_service(
                Trigger, f'~/{name}', partial(self._serve, answer), callback_group=group
            )
        node.create_service(
            SetParametersAtomically,
            f'~/{protocol.RESTART}',
            self._serve_restart,
            callback_group=changes,
        )

    def _serve(self, answer: Callable[[], Outcome], _request: Any, response: Any) -> Any:
        outcome = _attempt(answer)
        response.success, response.message = outcome.succeeded, outcome.text
        self.answered = monotonic()
        return response

    def _serve_restart(self, request: Any, response: Any) -> Any:
        names = {each.name: each.value.string_value for each in request.parameters}
        name, action = names.get('node', ''), names.get('action', 'restart')
        outcome = _attempt(lambda: self._restart(name, action))
        response.result.successful, response.result.reason = outcome.succeeded, outcome.text
        return response

    def _reload(self, reload: Callable[[Any], Outcome]) -> Outcome:
        state = self._system.state
        # Workers take no edit before all that is in them has started.
        if state.is_up or (state.is_open and not self._system.workers.describe()):
            return reload(self._system)
        return Outcome(succeeded=False, text=_STARTING)

    def _restart(self, name: str, action: str) -> Outcome:
        if action in ('stop', 'start'):
            return self._reload(partial(self._commands.switch, node=name, runs=action == 'start'))
        if not self._system.state.is_open:
            return Outcome(succeeded=False, text=_STARTING)
        if name in self._system.state.stopped:
            text = f"node '{name}' is stopped: composer start starts it"
            return Outcome(succeeded=False, text=text)
        processes = [each['name'] for each in self._system.state.find_processes()]
        if name not in (*self._system.list_nodes(), *self._system.list_components(), *processes):
            return Outcome(succeeded=False, text=f"the system has no node or process '{name}'")
        return self._system.restart_node(name)

    def _begin_trace(self) -> Outcome:
        if self._system.write_trace is not None:
            return Outcome(succeeded=False, text='the system is traced already, by up --trace')
        self._system.begin_trace()
        return Outcome(succeeded=True, text='')

    def _read_trace(self) -> Outcome:
        """End the trace, and return it: JSON, compressed, in base64."""
        data = zlib.compress(json.dumps(self._system.end_traces()).encode(), 1)
        return Outcome(succeeded=True, text=b64encode(data).decode())

    def _stop_system(self) -> Outcome:
        self._system.request_stop()
        return Outcome(succeeded=True, text=f'{self._system.state.name} stops')


def _attempt(answer: Callable[[], Outcome]) -> Outcome:
    """Return an answer whatever happens: without one, who asked would wait in vain."""
    try:
        return answer()
    except Exception as error:  # noqa: BLE001 - a bug in Composer, or a behaviour that broke it
        system_logger.error(format_internal_error(error))
        return Outcome(succeeded=False, text=f'it failed: {error!r}')
