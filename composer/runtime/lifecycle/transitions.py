"""The transitions of a node with a lifecycle: what its behaviours say, and who rests when.

The node rests in every state but `active`: no timer ticks, no message, request or goal comes to a
behaviour, and what is published is dropped. Its publishers publish from the beginning of
`on_activate` to the end of `on_deactivate`.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from threading import get_ident
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from lifecycle_msgs.msg import State, Transition
from rclpy.exceptions import InvalidHandle
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import TransitionCallbackReturn

from composer.errors import StartError
from composer.runtime.behaviours.calls import FAILED, return_result
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.behaviours.tracebacks import represent
from composer.runtime.lifecycle.bond import Bond

if TYPE_CHECKING:
    from composer.runtime.nodes.callback_groups import LifecycleGate
    from composer.runtime.nodes.live_node import LiveNode

_SUCCESS, _FAILURE, _ERROR = (
    TransitionCallbackReturn.SUCCESS,
    TransitionCallbackReturn.FAILURE,
    TransitionCallbackReturn.ERROR,
)
# The behaviour of each state in which a transition is.
_BEHAVIOURS = {
    State.TRANSITION_STATE_CONFIGURING: 'on_configure',
    State.TRANSITION_STATE_ACTIVATING: 'on_activate',
    State.TRANSITION_STATE_DEACTIVATING: 'on_deactivate',
    State.TRANSITION_STATE_CLEANINGUP: 'on_cleanup',
    State.TRANSITION_STATE_SHUTTINGDOWN: 'on_stop',
    State.TRANSITION_STATE_ERRORPROCESSING: 'on_error_state',
}
# The transitions on the way up, by the state that a node is to reach.
_WAY_UP: dict[str, tuple[int, ...]] = {
    'unconfigured': (),
    'inactive': (Transition.TRANSITION_CONFIGURE,),
    'active': (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE),
}
# The transition on the way down from each state.
_WAY_DOWN = {
    State.PRIMARY_STATE_ACTIVE: Transition.TRANSITION_DEACTIVATE,
    State.PRIMARY_STATE_INACTIVE: Transition.TRANSITION_CLEANUP,
}
_SHUTDOWN = {
    State.PRIMARY_STATE_UNCONFIGURED: Transition.TRANSITION_UNCONFIGURED_SHUTDOWN,
    State.PRIMARY_STATE_INACTIVE: Transition.TRANSITION_INACTIVE_SHUTDOWN,
    State.PRIMARY_STATE_ACTIVE: Transition.TRANSITION_ACTIVE_SHUTDOWN,
}
_POLL_SEC = 0.002
_START_POLL_SEC = 0.05


class Lifecycle:
    """The lifecycle of a node.

    Attributes:
        start: The state to which it brings itself when it starts.
    """

    def __init__(self, node: LiveNode, gate: LifecycleGate) -> None:
        self.start: str = node.spec.lifecycle or 'unconfigured'
        self._node = node
        self._gate = gate
        self._machine = node.ros.state_machine
        self._bond = Bond(node)
        self._has_started = threading.Event()
        # Held during a transition.
        self._turn = threading.Lock()
        self._failure = ''
        node.ros.change_state = self.change

    @property
    def state(self) -> str:
        """The state that the node is in, as in `active`, or `activating` during a transition."""
        try:
            return str(self._machine.current_state[1])
        except (InvalidHandle, RuntimeError):
            return 'finalized'  # It is being destroyed.

    def begin(self) -> None:
        """Let others change its state, as the node has started."""
        self._has_started.set()

    def reach(self, goal: str) -> str:
        """Bring an unconfigured node to a state; return why it did not get there, or ''."""
        self._has_started.set()
        for transition in _WAY_UP[goal]:
            self._failure = 'another one changed its state meanwhile'
            if self.change(transition) is not _SUCCESS:
                return self._failure
        return ''

    def require(self, goal: str) -> None:
        """Bring an unconfigured node to a state.

        Raises:
            StartError: It did not get there.
        """
        if (failure := self.reach(goal)) and not self._node.system.stop.is_set:
            message = f"node '{self._node.spec.key}': {failure}"
            raise StartError(message)

    def change(self, transition: int) -> TransitionCallbackReturn:
        """Make a transition, by its identifier in `lifecycle_msgs/msg/Transition`."""
        stop = self._node.system.stop
        with self._node.waits.make_room():
            while not (self._has_started.wait(_START_POLL_SEC) or stop.is_set):
                pass
        if stop.is_set:
            return _FAILURE
        if not self._turn.acquire(blocking=False):
            self._log().warning(f'is {self.state}: no other transition begins until that ends')
            return _FAILURE
        try:
            return self._change(transition)
        finally:
            self._turn.release()

    def leave(self, timeout_sec: float) -> None:
        """Deactivate the node, clean it up and shut it down, each as far as it gets there.

        Args:
            timeout_sec: How long each behaviour may take, if it is a coroutine, and a transition
                that has begun.
        """
        if not self._turn.acquire(timeout=timeout_sec / 2):
            self._log().error(f'is {self.state}, and is not shut down')
            return
        try:
            for state, transition in _WAY_DOWN.items():
                if self._machine.current_state[0] == state:
                    self._change(transition, timeout_sec)
            last = _SHUTDOWN.get(self._machine.current_state[0])
            if last is not None:
                self._change(last, timeout_sec)
        finally:
            self._turn.release()

    def follow(self) -> None:
        """Do what the node says now that was edited: keep a bond or none."""
        if self._node.spec.bond and not self._gate.rests:
            self._bond.form()
        else:
            self._bond.break_up()

    def _change(self, transition: int, timeout_sec: float | None = None) -> Any:
        before = self.state
        try:
            self._machine.trigger_transition_by_id(transition, True)
        except rclpy_implementation.RCLError:
            self._failure = f'is {before}, from which there is no transition {transition}'
            self._log().warning(self._failure)
            return _FAILURE
        state = self._machine.current_state[0]
        if state in (State.TRANSITION_STATE_DEACTIVATING, State.TRANSITION_STATE_SHUTTINGDOWN):
            self._rest(timeout_sec)
        elif state == State.TRANSITION_STATE_ACTIVATING:
            self._let_publish(may_publish=True)
        result = self._run(_BEHAVIOURS[state], timeout_sec)
        self._machine.trigger_transition_by_label(result.to_label(), True)
        if result is _ERROR:
            outcome = self._run('on_error_state', timeout_sec)
            # To fail there is to fail for good.
            label = (_SUCCESS if outcome is _SUCCESS else _FAILURE).to_label()
            self._machine.trigger_transition_by_label(label, True)
        self._settle()
        if result is _SUCCESS:
            self._log().info(f'is {self.state}')
        else:
            self._log().warning(f'{self._failure}; the node is {self.state}')
        return result

    def _run(self, key: str, timeout_sec: float | None) -> Any:
        """Call the behaviour of a transition; return what came of it."""
        node = self._node
        hook = getattr(node.spec, key)
        if key == 'on_stop':
            # Called once: the stop of the system finds nothing left to stop.
            hook, node.has_begun = (hook if node.has_begun else None), False
        if hook is None:
            return _SUCCESS
        raised: list[BaseException] = []
        # An edit may have given it another `warn_after` since it was called last.
        node.drop_limits(key)
        call = node.reported_call(
            Owner(key), hook.path, node.bind(hook), raised.append, deliver=return_result
        )
        result = node.run_to_end(call, timeout_sec=timeout_sec)
        if raised:
            self._failure = f'{key} raised {represent(raised[0])}'
            return _ERROR
        if result is FAILED:
            self._failure = f'{key} was ended by the stop of the system'
            return _FAILURE
        if result is None or result is True or result is _SUCCESS:
            return _SUCCESS
        if result is _ERROR:
            self._failure = f'{key} returned an error'
            return _ERROR
        self._failure = f'{key} returned False'
        if result is not False and result is not _FAILURE:
            self._failure = f'{key} returned {result!r}, not True or False'
            self._log().error(self._failure)
            return _ERROR
        return _FAILURE

    def _rest(self, timeout_sec: float | None) -> None:
        """Let nothing begin any more, and wait for what has begun, as long as a stop would."""
        node, me = self._node, get_ident()
        self._gate.rests = True
        node.rest_counts(rests=True)
        for timer in node.timers():
            with suppress(InvalidHandle):
                timer.cancel()
        if timeout_sec is not None:
            return  # The stop has waited.
        limit_sec = node.system.stop_timeout_sec
        deadline = monotonic() + limit_sec
        with node.waits.make_room():
            # But for the behaviour that asked for the transition.
            while monotonic() < deadline and any(
                entry is None or entry[2] != me for entry in list(node.running.entries.values())
            ):
                sleep(_POLL_SEC)
        for behaviour in list(node.suspended):
            behaviour.close(limit_sec, for_good=False)

    def _settle(self) -> None:
        """Work or rest, as the state is that the node has come to."""
        node, is_active = self._node, self._machine.current_state[0] == State.PRIMARY_STATE_ACTIVE
        self._let_publish(may_publish=is_active)
        was_resting, self._gate.rests = self._gate.rests, not is_active
        node.rest_counts(rests=not is_active)
        if is_active and was_resting:
            self._gate.has_refused.clear()
            for timer in node.timers() if self._gate.is_open else ():
                with suppress(InvalidHandle):
                    timer.reset()
        self.follow()
        node.system.executor.wake()
        if node.system.observe is not None:
            node.system.observe('state', node.full_name, '', self.state)

    def _let_publish(self, *, may_publish: bool) -> None:
        self._gate.may_publish = may_publish
        publishers: dict[str, Any] = self._node.entities['publishers']
        for publisher in list(publishers.values()):
            publisher.rest(rests=not may_publish)

    def _log(self) -> Any:
        return self._node.ros.get_logger()
