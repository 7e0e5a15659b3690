"""Sources: functions that block, or generators, each called again and again by its own thread.

What reads a port, a socket or a camera waits there, and holds nobody up.
"""

from __future__ import annotations

import inspect
import threading
from typing import TYPE_CHECKING, Any

from composer.errors import StartError
from composer.python_source.function_kinds import FunctionKind
from composer.runtime.behaviours.callables import kind_of
from composer.runtime.behaviours.calls import FAILED
from composer.runtime.behaviours.running_calls import Owner

if TYPE_CHECKING:
    from composer.language.specs import SourceSpec
    from composer.runtime.behaviours.calls import BehaviourCall
    from composer.runtime.nodes.live_node import LiveNode

# After an error it is called again later: twice as late each time, but no later than the last.
_FIRST_PAUSE_SEC, _LONGEST_PAUSE_SEC = 1.0, 30.0


class Source:
    """A source; it begins once the node has started.

    Attributes:
        ros: Itself: it is begun and ended where timers are, as by `reset` and `cancel` of rclpy's.
    """

    def __init__(self, node: LiveNode, spec: SourceSpec) -> None:
        self.ros = self
        self._node = node
        self.owner = Owner('source', spec.name)
        # Held where a thread is begun or told to end.
        self._lock = threading.Lock()
        self._reader: _Reader | None = None
        # The one before, which may still be ending.
        self._last: _Reader | None = None
        self._adopt(spec)
        node.suspended.append(self)

    def _adopt(self, spec: SourceSpec) -> None:
        self._spec = spec
        self._bound = self._node.function_of(spec.behaviour)
        self._begin = self._node.bind(spec.behaviour, self.owner)
        self._cancelling: BehaviourCall | None = None
        if spec.cancel is not None:
            owner = Owner('source', spec.name, 'cancel')
            function = self._node.bind(spec.cancel, owner)
            self._cancelling = self._node.reported_call(owner, (*spec.path, 'cancel'), function)
        kind = kind_of(self._begin)
        if kind in {FunctionKind.COROUTINE, FunctionKind.ASYNC_GENERATOR}:
            message = f"source '{spec.name}': '{spec.behaviour.name}' is async"
            advice = 'a source has a thread of its own: write it with def'
            raise StartError(message, help=advice)
        self.is_generator = kind is FunctionKind.GENERATOR

    def reset(self) -> None:
        """Begin, if it has not begun; in virtual time there may be no device to wait for."""
        if not self._node.system.begins_source(self._node.full_name, self.owner.name):
            return
        with self._lock:
            if self._reader is None:
                self._reader = _Reader(self, self._begin)
                self._reader.thread.start()

    def cancel(self) -> None:
        """Have it end: after the value that it waits for, or as `cancel:` makes it."""
        with self._lock:
            reader, self._reader = self._reader, None
        if reader is not None:
            reader.end()
            self._last = reader
            if self._cancelling is not None:
                self._node.run_to_end(self._cancelling)

    def close(self, timeout_sec: float, *, for_good: bool = True) -> None:  # noqa: ARG002
        """See `Suspended`: what the generator has in `finally:` runs in its thread."""
        self.cancel()
        reader = self._last
        if reader is not None and reader.thread is not threading.current_thread():
            reader.thread.join(timeout_sec)

    def change(self, spec: SourceSpec) -> None:
        """See `LiveEntity`: with new code, or other arguments, it begins anew."""
        own, new = self._spec.behaviour, spec.behaviour
        is_same = repr(dict(own.arguments)) == repr(dict(new.arguments))
        goes_on = is_same and self._bound == self._node.function_of(spec.behaviour)
        ran = self._reader is not None
        if not goes_on:
            self.close(self._node.system.stop_timeout_sec)
        self._adopt(spec)
        if ran and not goes_on:
            self.reset()
        elif self._reader is not None:
            self._reader.call = self.call_of(self._reader)

    def destroy(self) -> None:
        """See `LiveEntity`."""
        self.close(self._node.system.stop_timeout_sec)
        if self in self._node.suspended:
            self._node.suspended.remove(self)

    def call_of(self, reader: _Reader) -> BehaviourCall:
        """Return the call of one step, as the file has it now."""
        spec, node = self._spec, self._node
        return node.call(
            self.owner,
            spec.path,
            reader.step,
            options=spec,
            deliver=node.publish_to(spec.publish),
            may_begin=node.gate.allows_events,
        )

    @property
    def publisher(self) -> str:
        """The name of the publisher for what it brings; empty for none."""
        return self._spec.publish or ''

    def play(self, value: Any) -> None:
        """Bring a value, as if the behaviour had returned it."""
        spec, node = self._spec, self._node
        deliver, may_begin = node.publish_to(spec.publish), node.gate.allows_events
        node.call(
            self.owner,
            spec.path,
            lambda: value,
            options=spec,
            deliver=deliver,
            may_begin=may_begin,
        ).run()

    def close_generator(self, generator: Any) -> None:
        """Run what a generator has in `finally:`; what that raises is reported."""
        call = self._node.reported_call(self.owner, self._spec.path, generator.close)
        self._node.run_to_end(call)


class _Reader:
    """One run of a source, from its first call to its end.

    Attributes:
        call: That of a step; an edit may put another in its place.
    """

    def __init__(self, source: Source, begin: Any) -> None:
        self._source = source
        self._begin = begin
        self._generator: Any = None
        self._is_over = False
        self._ending = threading.Event()
        self.call = source.call_of(self)
        name = f'source {source.owner.name}'
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)

    def end(self) -> None:
        """Begin no other step."""
        self._ending.set()

    def step(self) -> Any:
        """Return the next value; `None` is not published."""
        if not self._source.is_generator:
            return self._begin()
        if self._generator is None:
            self._generator = self._begin()
        try:
            return next(self._generator)
        except StopIteration as end:
            self._is_over = True
            return end.value

    def _run(self) -> None:
        pause_sec = _FIRST_PAUSE_SEC
        while not (self._ending.is_set() or self._is_over):
            if self.call.run() is not FAILED:
                pause_sec = _FIRST_PAUSE_SEC
                continue
            generator = self._generator
            if generator and inspect.getgeneratorstate(generator) == inspect.GEN_CLOSED:
                self._generator = None
            self._ending.wait(pause_sec)
            pause_sec = min(2 * pause_sec, _LONGEST_PAUSE_SEC)
        if self._generator is not None:
            self._source.close_generator(self._generator)
