"""The wrapper around every behaviour: it runs it, keeps account of it, and catches everything."""

from __future__ import annotations

import itertools
import sys
import threading
import traceback
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.python_source import FunctionKind
from composer.runtime.behaviours import kind_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CoroutineType, FrameType


@dataclass(frozen=True, slots=True)
class RunningCall:
    """A behaviour that has begun and not ended.

    Attributes:
        thread: The identifier of its thread, `None` for a coroutine.
    """

    owner: str
    thread: int | None
    coroutine: CoroutineType[Any, Any, Any] | None = None

    def format_stack(self) -> str:
        """Return where it is now, innermost call last."""
        if self.coroutine is not None:
            frame: FrameType | None = getattr(self.coroutine, 'cr_frame', None)
        else:
            frame = sys._current_frames().get(self.thread or 0)  # noqa: SLF001 - the only way
        return ''.join(traceback.format_stack(frame)).rstrip() if frame else '  (it has ended)'


class CallLedger:
    """The behaviours of a node that are running."""

    def __init__(self) -> None:
        self._running: dict[int, RunningCall | None] = {}
        self._tokens = itertools.count()
        self._changed = threading.Condition()

    def begin(self, call: RunningCall | None) -> int:
        """Note that a behaviour begins; return what `end` takes.

        Args:
            call: `None` for what is still to be done but has no stack of its own.
        """
        token = next(self._tokens)
        self._running[token] = call
        return token

    def end(self, token: int) -> None:
        """Note that a behaviour has ended."""
        del self._running[token]
        if not self._running:
            with self._changed:
                self._changed.notify_all()

    def running(self) -> list[RunningCall]:
        """Return the behaviours that run now."""
        return [call for call in list(self._running.values()) if call is not None]

    def wait_until_idle(self, timeout_sec: float) -> bool:
        """Wait until no behaviour runs; return whether that came to be in time."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._running, timeout_sec)


class BehaviourCall:
    """A function bound to an entity, as a callback for rclpy.

    Args:
        function: Called with the callback's arguments.
        deliver: Takes what the function returned.
        failed: Takes what it raised.
    """

    def __init__(
        self,
        owner: str,
        function: Callable[..., Any],
        ledger: CallLedger,
        *,
        deliver: Callable[[Any], None],
        failed: Callable[[str, BaseException], None],
    ) -> None:
        self._owner = owner
        self._function = function
        self._ledger = ledger
        self._deliver = deliver
        self._failed = failed

    def delivering(self, deliver: Callable[[Any], None]) -> BehaviourCall:
        """Return the same call with its result going elsewhere."""
        return BehaviourCall(
            self._owner, self._function, self._ledger, deliver=deliver, failed=self._failed
        )

    def as_callback(self, kind: FunctionKind | None = None) -> Callable[..., Any]:
        """Return what rclpy calls or awaits; it never raises."""
        asynchronous = (kind or kind_of(self._function)) is FunctionKind.COROUTINE
        # rclpy looks at the callback itself to tell what to await, and how many arguments it
        # takes: a message callback with one, a timer callback with none.
        if asynchronous:

            async def await_behaviour(*arguments: Any) -> None:
                await self._run_async(*arguments)

            return await_behaviour

        def call_behaviour(*arguments: Any) -> None:
            self.run(*arguments)

        return call_behaviour

    def run(self, *arguments: Any) -> bool:
        """Call a plain function; return whether it did not raise."""
        token = self._ledger.begin(RunningCall(self._owner, threading.get_ident()))
        try:
            self._deliver(self._function(*arguments))
        except BaseException as error:  # noqa: BLE001 - a behaviour never takes another node down
            self._failed(self._owner, error)
            return False
        finally:
            self._ledger.end(token)
        return True

    async def _run_async(self, *arguments: Any) -> None:
        try:
            # A wrapper of an async function may itself be a plain one, and raise at once.
            coroutine: CoroutineType[Any, Any, Any] = self._function(*arguments)
        except BaseException as error:  # noqa: BLE001 - a behaviour never takes another node down
            self._failed(self._owner, error)
            return
        token = self._ledger.begin(RunningCall(self._owner, None, coroutine))
        try:
            self._deliver(await coroutine)
        except GeneratorExit:
            # The executor drops the coroutine; to go on here would be an error of Python's.
            raise
        except BaseException as error:  # noqa: BLE001 - as above
            self._failed(self._owner, error)
        finally:
            self._ledger.end(token)
