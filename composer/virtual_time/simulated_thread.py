"""A thread that takes turns, and what it may wait for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.virtual_time.originals import REAL

if TYPE_CHECKING:
    from collections.abc import Callable


class SimulatedThread:
    """A thread that takes turns with others.

    Attributes:
        call: What it does; `None` once that is over.
        turn: A real lock that is free when it is this thread's turn.
        ident: What `threading.get_ident` says in it; 0 before it has begun.
        native: What `threading.get_native_id` says in it; 0 before it has begun.
        is_ending: Whether it has been told to end.
        is_over: Whether it has ended.
        looks: How often it has read a clock, or not really waited, since it last did.
        on_wait: Called before it lets others run.
        error: What is raised where it waits.
    """

    __slots__ = (
        'call',
        'error',
        'ident',
        'is_ending',
        'is_over',
        'looks',
        'native',
        'on_wait',
        'turn',
    )

    def __init__(self, call: Callable[[], object] | None = None) -> None:
        self.call = call
        self.turn = REAL.allocate_lock()
        REAL.acquire(self.turn)
        self.ident = self.native = 0
        self.is_ending = False
        self.is_over = False
        self.looks = 0
        self.on_wait: Callable[[], None] | None = None
        self.error: BaseException | None = None


class Wait:
    """A wait of a thread, until it succeeds or its time is over.

    Attributes:
        attempt: Tells whether it has succeeded; `None` if only time is waited for.
    """

    __slots__ = ('attempt', 'has_succeeded', 'is_over', 'thread')

    def __init__(self, thread: SimulatedThread, attempt: Callable[[], object] | None) -> None:
        self.thread = thread
        self.attempt = attempt
        self.is_over = False
        self.has_succeeded = False


class Call:
    """A function to be called at a time; it must not wait."""

    __slots__ = ('function', 'is_over')

    def __init__(self, function: Callable[[], None]) -> None:
        self.function = function
        self.is_over = False
