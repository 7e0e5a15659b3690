"""Timers: call functions, resume generators or publish constants at a fixed rate."""

from __future__ import annotations

import threading
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock, ClockType

from composer.interfaces.classes import import_interface
from composer.language.parsing.parameter_references import period_of
from composer.python_source.function_kinds import FunctionKind
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.messages.payloads import converter_for

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable

    from rclpy.timer import Timer as RosTimer

    from composer.language.specs import ClockName, TimerSpec
    from composer.runtime.nodes.live_node import LiveNode

_CLOCKS = {'steady': ClockType.STEADY_TIME, 'system': ClockType.SYSTEM_TIME}


class Timer:
    """A timer; it ticks once the node has started.

    Attributes:
        ros: The rclpy timer.
    """

    def __init__(self, node: LiveNode, spec: TimerSpec) -> None:
        self._node = node
        self._owner = Owner('timer', spec.name)
        self._spec = spec
        self._period_sec = self._find_period(spec)
        self._ticker = _Ticker(node, self._owner, spec)
        self.ros = node.ros.create_timer(
            self._period_sec,
            self._create_callback(spec),
            callback_group=node.group(spec.group),
            clock=_create_clock(spec.clock),
            # A period is counted from the start of the node, not from its creation.
            autostart=False,
        )
        self._ticker.timer = self.ros
        node.count_missed(self._owner, self.ros)

    def change(self, spec: TimerSpec) -> None:
        """See `LiveEntity`: a generator with new code begins anew, and a new period begins now."""
        if not self._ticker.goes_on(spec):
            self._ticker.close(self._node.system.stop_timeout_sec)
            self._ticker.forget()
            self._ticker = _Ticker(self._node, self._owner, spec)
            self._ticker.timer = self.ros
        self.ros.callback = self._create_callback(spec)
        self._spec = spec
        self.follow()

    def follow(self) -> None:
        """Take the period that the file, or the parameter that it follows, says now."""
        period_sec = self._find_period(self._spec)
        if period_sec != self._period_sec:
            self._period_sec = period_sec
            self.ros.timer_period_ns = round(period_sec * 1e9)
            if not self.ros.is_canceled():
                # A generator that has ended has cancelled it.
                self.ros.reset()

    def _find_period(self, spec: TimerSpec) -> float:
        for key, reference in spec.by_parameter.items():
            value = self._node.ros.get_parameter(reference.parameter).value
            return period_of(key, reference, value)
        return spec.period_sec

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self._ticker.close(self._node.system.stop_timeout_sec)
        self._ticker.forget()
        self._node.ros.destroy_timer(self.ros)

    def _create_callback(self, spec: TimerSpec) -> Callable[..., Any]:
        node = self._node
        return node.call(
            self._owner,
            spec.path,
            self._ticker.function,
            options=spec,
            deliver=node.publish_to(spec.publish),
            may_begin=node.gate.allows_events,
        ).run


def _create_clock(name: ClockName) -> Clock | None:
    return Clock(clock_type=_CLOCKS[name]) if name in _CLOCKS else None


class _Constant:
    """The message of a timer, of the type that its publisher has: an edit may change that."""

    def __init__(self, node: LiveNode, spec: TimerSpec) -> None:
        self._node, self._spec = node, spec
        self._type = ''
        self._message: Any = None
        self.message()

    def message(self) -> Any:
        """Return the message; `None` if an edit has just taken the publisher away."""
        publisher = self._node.spec.publishers.get(self._spec.publish or '')
        if publisher is None:
            return None
        type_name = publisher.type
        if type_name != self._type:
            convert = converter_for(import_interface(type_name)).convert
            self._message, self._type = convert(self._spec.message), type_name
        return self._message


class _Ticker:
    """What a timer does at each tick.

    Attributes:
        function: Does it; it takes no arguments.
    """

    timer: RosTimer

    def __init__(self, node: LiveNode, owner: Owner, spec: TimerSpec) -> None:
        self._node, self._owner, self._spec = node, owner, spec
        # The generator that is suspended until the next tick, if there is one.
        self._generator: Any = None
        # Ticks of a reentrant group overlap, which a generator cannot: it skips such a tick.
        self._turn = threading.Lock()
        # The thread that resumes the generator, and whether that was to close it meanwhile.
        self._thread = 0
        self._is_closed = False
        if spec.behaviour is None:
            self.function: Callable[[], Any] = _Constant(node, spec).message
            return
        self._bound = node.function_of(spec.behaviour)
        self._begin = self.function = node.bind(spec.behaviour, owner)
        self._kind = kind_of(self._begin)
        if self._kind is FunctionKind.GENERATOR:
            self.function = self._resume
        elif self._kind is FunctionKind.ASYNC_GENERATOR:
            self.function = self._resume_async
        else:
            return
        node.suspended.append(self)

    def goes_on(self, spec: TimerSpec) -> bool:
        """Return whether it does what `spec` says, so that a generator need not begin anew."""
        behaviour, own = spec.behaviour, self._spec.behaviour
        if behaviour is None or own is None:
            return False
        # `1` and `1.0` are equal, and not the same.
        is_same = repr(dict(behaviour.arguments)) == repr(dict(own.arguments))
        return is_same and self._bound == self._node.function_of(behaviour)

    def close(self, timeout_sec: float, *, for_good: bool = True) -> None:
        """See `Suspended`: what the generator has in `finally:` runs."""
        if self._thread == get_ident():
            # The generator itself removes its timer.
            self._is_closed = True
            return
        if not self._turn.acquire(timeout=timeout_sec):
            # It is not suspended but hangs, and is reported for that.
            return
        generator, self._generator = self._generator, None
        if generator is not None:
            self._close(generator, timeout_sec)
        if not for_good:
            self._turn.release()

    def _close(self, generator: Any, timeout_sec: float) -> None:
        is_async = self._kind is FunctionKind.ASYNC_GENERATOR
        close = partial(_close_async, generator) if is_async else generator.close
        call = self._node.reported_call(self._owner, self._spec.path, close)
        self._node.run_to_end(call, timeout_sec=timeout_sec)

    def forget(self) -> None:
        """End it no more at the stop: it has been."""
        if self in self._node.suspended:
            self._node.suspended.remove(self)

    def _resume(self) -> Any:
        if not self._turn.acquire(blocking=False):
            return None
        try:
            if self._generator is None:
                self._generator = self._begin()
            self._thread = get_ident()
            result = next(self._generator)
            if self._is_closed:
                self._generator.close()
            return result  # noqa: TRY300 - what it raises by then is its own
        except StopIteration as end:
            self.timer.cancel()
            return end.value
        except BaseException:
            # A generator that raised is finished; the next tick begins a new one.
            self._generator = None
            raise
        finally:
            self._thread = 0
            self._turn.release()

    async def _resume_async(self) -> Any:
        if not self._turn.acquire(blocking=False):
            return None
        try:
            if self._generator is None:
                self._generator = self._begin()
            self._thread = get_ident()
            result = await anext(self._generator)
            if self._is_closed:
                await self._generator.aclose()
            return result  # noqa: TRY300 - as above
        except StopAsyncIteration:
            self.timer.cancel()
            return None
        except BaseException:
            self._generator = None
            raise
        finally:
            self._thread = 0
            self._turn.release()


async def _close_async(generator: AsyncGenerator[Any, Any]) -> None:
    await generator.aclose()
