"""Calls of behaviours: timed, and with no error getting out of them.

Every message goes through here, so a call is made of plain functions and tuples: a hundred
nanoseconds more would be the cost of composing.
"""

from __future__ import annotations

from threading import get_ident
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Final

from composer.executor.after_fork import end_child
from composer.python_source.function_kinds import FunctionKind
from composer.runtime import forked_children
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.tracing.tracer import COROUTINE, tracer

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import CoroutineType

    from composer.runtime.behaviours.running_calls import Owner, Progress, RunningCalls

# What a call returns if the behaviour raised, or was not called.
FAILED: Final = object()


class BehaviourCall:
    """A function bound to an entity, as a callback for rclpy.

    Args:
        function: Called with the arguments of the callback.
        deliver: Takes what the function returned.
        failed: Takes what it raised.
        add_time: Takes how long each call took, in nanoseconds; `None` measures nothing.
        may_begin: Asked right before the function is called, when the call is among the running
            ones already: whoever closes a gate and then looks at these misses no call. `None` for
            always.
        progress: Of a function that yields intermediate results.

    Attributes:
        is_async: Whether the function is a coroutine.
        run: Calls the function, and returns what `deliver` returned, or `FAILED`; it never raises.
            It is itself a coroutine where the function is one.
    """

    __slots__ = (
        '_add_time',
        '_deliver',
        '_failed',
        '_function',
        '_may_begin',
        '_owner',
        '_progress',
        '_running',
        'is_async',
        'run',
    )

    def __init__(  # noqa: PLR0913 - all but three have a default or go by their names
        self,
        owner: Owner,
        function: Callable[..., Any],
        running: RunningCalls,
        *,
        deliver: Callable[[Any], Any],
        failed: Callable[[Owner, BaseException], None],
        add_time: Callable[[int], None] | None = None,
        may_begin: Callable[[], bool] | None = None,
        progress: Progress | None = None,
    ) -> None:
        self._owner = owner
        self._function = function
        self._running = running
        self._deliver = deliver
        self._failed = failed
        self._add_time = add_time
        self._may_begin = may_begin
        self._progress = progress
        self.is_async = kind_of(function) is FunctionKind.COROUTINE
        # rclpy looks at the callback itself to tell what to await, and how many arguments it
        # takes: a message callback has one, a timer callback none.
        self.run: Callable[..., Any] = self._compile_async() if self.is_async else self._compile()

    def with_progress(self, progress: Progress) -> BehaviourCall:
        """Return the same call of a function that yields intermediate results."""
        return BehaviourCall(
            self._owner,
            self._function,
            self._running,
            deliver=self._deliver,
            failed=self._failed,
            add_time=self._add_time,
            may_begin=self._may_begin,
            progress=progress,
        )

    async def complete(self, *arguments: Any) -> Any:
        """Call the function, await it if it is a coroutine, and return what `run` does."""
        result = self.run(*arguments)
        return await result if self.is_async else result

    def _compile(self) -> Callable[..., Any]:
        """Return the call of a plain function as one function, with all that it needs at hand."""
        owner, function, deliver, failed = self._owner, self._function, self._deliver, self._failed
        running, entries, tokens = self._running, self._running.entries, self._running.tokens
        add_time, may_begin, progress = self._add_time, self._may_begin, self._progress
        now_ns, get_thread = monotonic_ns, get_ident

        def call_behaviour(*arguments: Any) -> Any:
            token = next(tokens)
            traced = tracer.begin(arguments) if tracer.is_on else None
            begun_ns = now_ns()
            entries[token] = (owner, begun_ns, get_thread(), None, progress)
            try:
                if may_begin is not None and not may_begin():
                    return FAILED
                result = function(*arguments)
                # A message that is passed on belongs to nobody then.
                arguments = ()
                if forked_children.in_child:
                    end_child()
                return deliver(result)
            except BaseException as error:  # noqa: BLE001 - it never takes another node down
                if forked_children.in_child:
                    end_child(error)
                failed(owner, error)
                return FAILED
            finally:
                if add_time is not None:
                    add_time(now_ns() - begun_ns)
                if traced is not None:
                    tracer.end('callback', running.node, owner, traced)
                running.last = owner, begun_ns
                # As `running.end` does.
                del entries[token]
                if running.has_listeners:
                    running.notify_end(token)

        return call_behaviour

    def _compile_async(self) -> Callable[..., Any]:
        running, add_time = self._running, self._add_time

        async def await_behaviour(*arguments: Any) -> Any:
            traced = tracer.begin(arguments) if tracer.is_on else None
            begun_ns = monotonic_ns()
            token = None
            try:
                # A wrapper of an async function may itself be a plain one, and raise at once.
                coroutine: CoroutineType[Any, Any, Any] = self._function(*arguments)
                token = next(running.tokens)
                running.entries[token] = (self._owner, begun_ns, None, coroutine, self._progress)
                if self._may_begin is not None and not self._may_begin():
                    coroutine.close()
                    return FAILED
                result = await coroutine
                if forked_children.in_child:
                    end_child()
                return self._deliver(result)
            except BaseException as error:
                if forked_children.in_child:
                    end_child(error)
                if _comes_from_outside(error):
                    # The executor drops the coroutine; to go on would be an error of Python's.
                    raise
                self._failed(self._owner, error)
                return FAILED
            finally:
                if add_time is not None:
                    add_time(monotonic_ns() - begun_ns)
                if traced is not None:
                    tracer.end('callback', running.node, self._owner, traced, COROUTINE)
                running.last = self._owner, begun_ns
                if token is not None:
                    running.end(token)

        return await_behaviour


def return_result(result: Any) -> Any:
    """Return a result to whoever called; for `deliver`."""
    return result


def discard_result(_result: Any) -> None:
    """Drop a result; for `deliver`."""


def _comes_from_outside(error: BaseException) -> bool:
    """Return whether a coroutine is closed, other than by what it awaits itself."""
    trace = error.__traceback__
    return isinstance(error, GeneratorExit) and (trace is None or trace.tb_next is None)
