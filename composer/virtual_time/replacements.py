"""What Python programs wait with, and read the time from, in virtual time.

All of it asks first whether the calling thread takes turns: any other waits as before. A wait
tries, without blocking, what it would block for, as long as others run. Threads that they start
take turns, too. A process takes no virtual time: who waits for it really waits.
"""

from __future__ import annotations

import _random
import gc
import itertools
import os
import random
import subprocess
import sys
import tempfile
import threading
import uuid
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from composer.virtual_time.blocking_calls import blocking_calls
from composer.virtual_time.clocks import clocks, to_ns
from composer.virtual_time.replaced_functions import ReplacedFunction, ReplacedMethod
from composer.virtual_time.unrepeatable import THREAD, Watch, begin

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from composer.virtual_time.simulated_threads import SimulatedThreads

# Without C's generator `uuid1` reads Python's clock; and a network card that no machine has.
_UUID1: Final = (
    (uuid, '_generate_time_safe', None),
    (uuid, '_last_timestamp', None),
    (uuid, '_node', 0x0242AC110002),
)
_SEED_BITS: Final = 256
# Those whose time is virtual now.
_running: list[SimulatedThreads] = []


def _leave_in_child() -> None:
    """Let a forked process have real time: the threads that it would wait for are not in it."""
    for threads in _running:
        threads.by_ident.clear()


os.register_at_fork(after_in_child=_leave_in_child)


@contextmanager
def replaced(threads: SimulatedThreads, start_time_ns: int, seed: int) -> Iterator[Watch]:
    """Let the simulated threads wait in virtual time, and have its clocks, meanwhile.

    Args:
        start_time_ns: What the wall clock says at the virtual time 0, in ns since 1970.
        seed: Of what is random.

    Yields:
        What notes what cannot be replaced.
    """
    watch = Watch(threads)
    with ExitStack() as stack:
        _running.append(threads)
        stack.callback(_running.remove, threads)
        if gc.isenabled():
            # The simulated threads collect it, in turns of their own; what was there before is
            # not theirs, and would take most of the time.
            gc.collect(1)
            gc.freeze()
            stack.callback(gc.unfreeze)
            gc.disable()
            stack.callback(gc.enable)
        stack.callback(begin(watch))
        for each in (
            clocks(threads, start_time_ns, watch.note_work),
            _entropy(threads, seed),
            blocking_calls(threads, watch),
            watch.telling(),
        ):
            for target, function in each:
                target.replace(function)
                stack.callback(target.restore)
        # These Python itself looks up at each call.
        methods = thread_methods(threads, lambda: watch.note(THREAD))
        attributes: list[tuple[Any, str, Any]] = [(threading.Thread, *each) for each in methods]
        attributes += [(subprocess.Popen, *each) for each in process_methods(threads)]
        attributes += [(tempfile, '_name_sequence', None), *_UUID1]
        for owner, name, value in attributes:
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)
        stack.enter_context(_numbered(threads))
        stack.enter_context(_seeded(seed))
        yield watch


@contextmanager
def _numbered(threads: SimulatedThreads) -> Iterator[None]:
    """Number the threads, pools and futures that are made meanwhile, in their names and hashes.

    Pools keep threads and futures in sets, whose order is otherwise that of addresses.
    """
    hashes = itertools.count(1)
    with ExitStack() as stack:
        for owner, (keyword, place, write_name, is_hashed) in _NUMBERED.items():
            begun: Any = owner.__init__
            stack.callback(setattr, owner, '__init__', begun)
            naming = keyword, place, partial(write_name, itertools.count())
            owner.__init__ = _numbering(threads, begun, naming, hashes if is_hashed else None)
            if is_hashed and owner.__hash__ is not _hash_by_number:
                owner.__hash__ = _hash_by_number
        yield


def _name_thread(numbers: Iterator[int], keywords: Mapping[str, Any]) -> str:
    target = getattr(keywords.get('target'), '__name__', '')
    name = f'Thread-{next(numbers) + 1}'
    return f'{name} ({target})' if target else name


def _name_pool(numbers: Iterator[int], _keywords: Mapping[str, Any]) -> str:
    return f'ThreadPoolExecutor-{next(numbers)}'


# What takes a name, its place among the arguments, what writes one that was not given, and whether
# it is hashed by its number.
_NUMBERED: Final[dict[Any, tuple[str, int, Callable[..., str], bool]]] = {
    threading.Thread: ('name', 2, _name_thread, True),
    ThreadPoolExecutor: ('thread_name_prefix', 1, _name_pool, False),
    Future: ('', 0, _name_pool, True),
}


def _numbering(
    threads: SimulatedThreads,
    begun: Callable[..., None],
    naming: tuple[str, int, Callable[[Mapping[str, Any]], str]],
    hashes: Iterator[int] | None,
) -> Callable[..., None]:
    keyword, place, write_name = naming

    def begin_numbered(self: Any, *arguments: Any, **keywords: Any) -> None:
        if threads.mine() is not None:
            if hashes is not None:
                self._simulated_number = next(hashes)
            if keyword and len(arguments) <= place and not keywords.get(keyword):
                keywords[keyword] = write_name(keywords)
        begun(self, *arguments, **keywords)

    return begin_numbered


def _hash_by_number(self: Any) -> int:
    number: int | None = self.__dict__.get('_simulated_number')
    return object.__hash__(self) if number is None else number


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    before = random.getstate()
    random.seed(seed)
    numpy = sys.modules.get('numpy')
    state = numpy and numpy.random.get_state()
    if numpy:
        numpy.random.seed(seed % 2**32)
    try:
        yield
    finally:
        random.setstate(before)
        if numpy:
            numpy.random.set_state(state)


def _entropy(
    threads: SimulatedThreads, seed: int
) -> Iterator[tuple[ReplacedFunction | ReplacedMethod, Callable[..., Any]]]:
    """Yield what makes random bytes: `uuid4`, `secrets` and numpy get theirs here.

    A generator without a seed, as `random.Random()`, asks the kernel in C.
    """
    source = random.Random(seed)  # noqa: S311 - no secret
    seeding = ReplacedMethod(_random.Random, 'seed')

    def replaced(target: ReplacedFunction) -> Callable[..., Any]:
        def read(size: Any, *flags: Any) -> Any:
            mine = threads.mine()
            return target.original(size, *flags) if mine is None else source.randbytes(size)

        return read

    def seed_anew(self: Any, number: Any = None) -> Any:
        if number is None and threads.mine() is not None:
            number = source.getrandbits(_SEED_BITS)
        return seeding.original(self, number)

    for builtin in (os.urandom, os.getrandom):
        target = ReplacedFunction(builtin)
        yield target, replaced(target)
    yield seeding, seed_anew


def thread_methods(
    threads: SimulatedThreads, on_start: Callable[[], None]
) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the methods of `threading.Thread` that are others, by their names.

    Args:
        on_start: Called when a simulated thread starts another.
    """
    start, join, is_alive = (
        threading.Thread.start,
        threading.Thread.join,
        threading.Thread.is_alive,
    )
    bootstrap: Any = threading.Thread._bootstrap_inner  # type: ignore[attr-defined]  # noqa: SLF001

    def start_in_turn(self: Any) -> None:
        if threads.mine() is not None and not self._started.is_set():
            on_start()
            with threads.added(partial(bootstrap, self)) as self._simulated:
                start(self)
        else:
            start(self)

    def bootstrap_in_turn(self: Any) -> None:
        simulated = getattr(self, '_simulated', None)
        if simulated is None:
            bootstrap(self)
        else:
            report = self._invoke_excepthook
            # What comes of the end of the simulation is no error of the thread.
            self._invoke_excepthook = lambda who: simulated.is_ending or report(who)
            threads.run(simulated)

    def join_in_turn(self: Any, timeout: Any = None) -> None:
        simulated = getattr(self, '_simulated', None)
        if simulated is None or threads.mine() is None or threads.mine() is simulated:
            join(self, timeout)
            return
        limit_ns = None if timeout is None else to_ns(max(timeout, 0))
        is_over = simulated.is_over or threads.wait_until(lambda: simulated.is_over, limit_ns)
        if is_over:
            # Its last steps, in C, take no turns.
            with threads.outside():
                join(self)

    def is_alive_in_turn(self: Any) -> bool:
        simulated = getattr(self, '_simulated', None)
        if simulated is not None and simulated.is_over and threads.mine() is not None:
            with threads.outside():
                join(self)
        return is_alive(self)

    yield from (
        ('start', start_in_turn),
        ('join', join_in_turn),
        ('is_alive', is_alive_in_turn),
        ('_bootstrap_inner', bootstrap_in_turn),
    )


def process_methods(threads: SimulatedThreads) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the methods of `subprocess.Popen` that are others, by their names."""
    for name in ('communicate', 'wait'):
        yield name, _really(threads, getattr(subprocess.Popen, name))


def _really(threads: SimulatedThreads, method: Callable[..., Any]) -> Callable[..., Any]:
    def wait(*arguments: Any, **keywords: Any) -> Any:
        with threads.outside():
            return method(*arguments, **keywords)

    return wait
