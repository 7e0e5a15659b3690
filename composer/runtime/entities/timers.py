"""Timers: functions called, generators resumed, or constants published at a fixed rate."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from rclpy.clock import Clock, ClockType

from composer.interfaces.classes import import_interface
from composer.python_source.modules import FunctionKind
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.calls import Owner
from composer.runtime.messages.payloads import converter_for

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Generator

    from rclpy.timer import Timer

    from composer.language.specs import ClockName, TimerSpec
    from composer.runtime.nodes.live_node import LiveNode

_CLOCKS = {'steady': ClockType.STEADY_TIME, 'system': ClockType.SYSTEM_TIME}


def create_timers(node: LiveNode) -> None:
    """Create the node's timers; they tick once the node has started."""
    for spec in node.spec.timers.values():
        ticker = _Ticker(node, spec)
        owner = Owner('timer', spec.name)
        call = node.call(
            owner,
            spec.path,
            ticker.function,
            rules=spec,
            publish=spec.publish,
            admits=node.gate.lets_events,
        )
        if ticker.is_generator:
            node.at_stop.append(ticker)
        ticker.timer = node.ros.create_timer(
            spec.period_sec,
            call.as_callback(ticker.kind),
            callback_group=node.group(spec.group),
            clock=_create_clock(spec.clock),
            # A period is counted from the start of the node, not from its creation.
            autostart=False,
        )
        node.timers.append(ticker.timer)
        node.follow(owner, ticker.timer)


def _create_clock(name: ClockName) -> Clock | None:
    return Clock(clock_type=_CLOCKS[name]) if name in _CLOCKS else None


class _Ticker:
    """What a timer does at each tick, as one function without arguments.

    Attributes:
        is_generator: Whether it waits half-way between two ticks.
    """

    timer: Timer
    is_generator = False

    def __init__(self, node: LiveNode, spec: TimerSpec) -> None:
        self.kind = FunctionKind.PLAIN
        if spec.behaviour is None:
            publisher = node.spec.publishers[spec.publish or '']
            message = converter_for(import_interface(publisher.type)).convert(spec.message)
            self.function: Callable[[], Any] = lambda: message
            return
        behaviour = node.function(spec.behaviour)
        self._begin = node.bind(spec.behaviour)
        kind = kind_of(behaviour)
        self._node, self._spec = node, spec
        self._generator: Generator[Any, Any, Any] | None = None
        self._async_generator: AsyncGenerator[Any, Any] | None = None
        self.is_generator = kind in (FunctionKind.GENERATOR, FunctionKind.ASYNC_GENERATOR)
        # Ticks of a reentrant group overlap, which a generator cannot: it lets such a tick pass.
        self._turn = threading.Lock()
        if kind is FunctionKind.GENERATOR:
            self.function = self._resume
        elif kind is FunctionKind.ASYNC_GENERATOR:
            self.kind = FunctionKind.COROUTINE
            self.function = self._resume_async
        else:
            self.kind = kind
            self.function = self._begin

    def close(self, timeout_sec: float) -> None:
        """See `AtStop`: what the generator has in `finally:` runs."""
        if not self._turn.acquire(timeout=timeout_sec):
            # It is not waiting but hanging, and is reported for that.
            return
        owner, path = Owner('timer', self._spec.name), self._spec.path
        generator, self._generator = self._generator, None
        if generator is not None:
            self._node.reported_call(owner, path, generator.close).run()
        async_generator, self._async_generator = self._async_generator, None
        if async_generator is not None:
            done = threading.Event()
            call = self._node.reported_call(owner, path, async_generator.aclose)
            task = self._node.services.executor.create_task(
                call.as_callback(FunctionKind.COROUTINE)
            )
            task.add_done_callback(lambda _task: done.set())
            done.wait(timeout_sec)

    def _resume(self) -> Any:
        if not self._turn.acquire(blocking=False):
            return None
        try:
            if self._generator is None:
                self._generator = self._begin()
            return next(self._generator)
        except StopIteration as end:
            self.timer.cancel()
            return end.value
        except BaseException:
            # A generator that raised is finished; the next tick begins a new one.
            self._generator = None
            raise
        finally:
            self._turn.release()

    async def _resume_async(self) -> Any:
        if not self._turn.acquire(blocking=False):
            return None
        try:
            if self._async_generator is None:
                self._async_generator = self._begin()
            return await anext(self._async_generator)
        except StopAsyncIteration:
            self.timer.cancel()
            return None
        except BaseException:
            self._async_generator = None
            raise
        finally:
            self._turn.release()
