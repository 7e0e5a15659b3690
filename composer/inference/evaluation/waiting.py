"""What a behaviour waits for in its thread: events, queues, locks, names of the state."""

from __future__ import annotations

import ast
from contextlib import contextmanager
from typing import TYPE_CHECKING

from composer.inference.current_run import span_of
from composer.inference.evaluation.part import Part
from composer.inference.reading import Block
from composer.inference.scopes import own_nodes
from composer.inference.values import (
    UNKNOWN,
    Argument,
    Arguments,
    BoundMethod,
    Constant,
    Held,
    Place,
    Primitive,
    Value,
    is_none,
    truth_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.inference.reading import Awaited
    from composer.inference.scopes import Scope

# The methods that wait for something, by the class; and those that bring it about.
WAITING: dict[str, frozenset[str]] = {
    'threading.Event': frozenset({'wait'}),
    'threading.Condition': frozenset({'wait', 'wait_for'}),
    'threading.Barrier': frozenset({'wait'}),
    'threading.Semaphore': frozenset({'acquire'}),
    'queue.Queue': frozenset({'get'}),
    'queue.LifoQueue': frozenset({'get'}),
    'queue.PriorityQueue': frozenset({'get'}),
    'queue.SimpleQueue': frozenset({'get'}),
    'concurrent.futures.Future': frozenset({'result', 'exception'}),
}
_PUTTING = frozenset({'put', 'put_nowait'})
FILLING: dict[str, frozenset[str]] = {
    'threading.Event': frozenset({'set'}),
    'threading.Condition': frozenset({'notify', 'notify_all'}),
    'threading.Barrier': frozenset({'wait', 'abort'}),
    'threading.Semaphore': frozenset({'release'}),
    'queue.Queue': _PUTTING,
    'queue.LifoQueue': _PUTTING,
    'queue.PriorityQueue': _PUTTING,
    'queue.SimpleQueue': _PUTTING,
    'concurrent.futures.Future': frozenset({'cancel', 'set_exception', 'set_result'}),
}
_LOCK = 'threading.Lock'
_LOCK, THREAD = 'threading.Lock', 'threading.Thread'
MADE = frozenset({*FILLING, _LOCK, THREAD})
# Methods after which a wait is as before.
_HARMLESS = frozenset({'clear', 'reset', 'task_done', 'acquire', 'release'})
_ASKING = frozenset({'done', 'empty', 'full', 'is_set', 'qsize'})
# What raises RuntimeError where no loop of asyncio runs.
_OF_LOOP = frozenset(
    f'asyncio.{name}'
    for name in (
        *('gather', 'open_connection', 'sleep', 'start_server', 'timeout', 'to_thread', 'wait'),
        *('wait_for', 'create_subprocess_exec', 'create_subprocess_shell', 'TaskGroup'),
    )
)
_INSTEAD = {
    'asyncio.gather': 'await one after the other',
    'asyncio.sleep': 'call time.sleep, in a group of its own; in a timer, write a generator',
}
_EMPTY = Constant(int, 0)
WAYS_OUT = (ast.Break, ast.Return, ast.Raise, ast.Yield, ast.YieldFrom, ast.Await)


class Waiting(Part):
    """Notes what a behaviour waits for, and what it brings about."""

    # Primitives of threads

    def make(self, kind: str, arguments: Arguments, place: Place) -> Value:
        """Return an object that threads wait for."""
        self._evaluator.calls.escape_all(arguments)
        first = arguments.get(0, 'value')
        if kind == 'threading.Semaphore' and (first is None or first.value != _EMPTY):
            return UNKNOWN
        target = dict(arguments.named).get('target')
        if kind == THREAD and target is not None:
            self.check_target(target)
        return Primitive(kind, place, target.value if target else None)

    def check_target(self, target: Argument) -> None:
        """Report a target that is called right here."""
        node = target.place.node
        called = node.value if isinstance(node, ast.keyword) else node
        if is_none(target.value) and isinstance(called, ast.Call):
            text = 'this is called here, and the thread runs nothing'
            help_text = f'give it {ast.unparse(called.func)}, and args=(…)'
            self._evaluator.run.report('no-effect', target.place, text, help_text)

    # What needs an event loop

    def await_asyncio(self, name: str, arguments: Arguments, place: Place) -> None:
        """Report what raises without a loop of asyncio; those of ROS have none."""
        first = arguments.get(0, 'delay')
        if name == 'asyncio.sleep' and (first is None or truth_of(first.value) is False):
            return
        if name in _OF_LOOP and self._evaluator.run.waits:
            self._evaluator.run.report(
                'no-event-loop',
                place,
                f'{name} needs the event loop of asyncio, and behaviours run in that of ROS',
                _INSTEAD.get(name),
            )

    # Calls of primitives

    def call(self, owner: Primitive, name: str, arguments: Arguments, place: Place) -> Value:
        """Return what a method of a primitive may return, and note what it does."""
        self._evaluator.run.moves += 1
        if owner.kind == THREAD:
            self._join(owner, name, arguments, place)
        elif owner.kind == _LOCK:
            self._call_lock(owner, name, arguments, place)
        else:
            self._call(owner, owner.kind, name, arguments, place)
        return UNKNOWN

    def _call(
        self, what: Awaited, kind: str, name: str, arguments: Arguments, place: Place
    ) -> None:
        self._evaluator.calls.escape_all(arguments)
        run = self._evaluator.run
        is_wait = name in WAITING[kind]
        if name in FILLING[kind]:
            self.fill(what)
        elif not is_wait and name not in _HARMLESS:
            run.reading.asked.add(what)
        if is_wait and not _is_timed(name, arguments):
            self._block(what, place)

    def call_held(self, name: str, method: str, arguments: Arguments, place: Place) -> None:
        """Note a call of a method of something that is kept in `node.state`."""
        for kind, methods in FILLING.items():
            if method in methods or method in WAITING[kind] or method in _ASKING:
                self._call(Held(kind, name), kind, method, arguments, place)

    def fill(self, what: Awaited) -> None:
        """Note that something is brought about, by the behaviour or beside it."""
        run = self._evaluator.run
        run.reading.fills.setdefault(what, set()).add(run.waits)

    def _block(self, what: Awaited, place: Place) -> None:
        """Note that the behaviour waits until something comes, for ever."""
        run = self._evaluator.run
        if run.waits and run.is_sure and not run.broad_guards:
            calls = self._evaluator.call_places
            related = [('it is called here', span_of(calls[0]))] if calls else []
            if isinstance(what, Primitive):
                related.append(('it is made here', span_of(what.origin)))
            run.reading.blocks.append(Block(what, span_of(place), tuple(related)))

    def _join(self, thread: Primitive, name: str, arguments: Arguments, place: Place) -> None:
        """Who joins a thread waits for what the thread waits for."""
        if name != 'join' or any(True for _ in arguments.all()):
            return
        match thread.target:
            case BoundMethod(owner=Primitive(kind=kind) as what, name=method):
                if method in WAITING.get(kind, ()):
                    self._block(what, place)

    # Locks

    def _call_lock(self, lock: Primitive, name: str, arguments: Arguments, place: Place) -> None:
        run = self._evaluator.run
        if name == 'acquire' and not any(True for _ in arguments.all()):
            self.take(lock, place)
            if run.waits and not run.conditions:
                run.held_locks.append((lock, place))
        else:
            run.held_locks = [each for each in run.held_locks if each[0] is not lock]

    def take(self, lock: Primitive, place: Place) -> None:
        """Report that a lock is taken by who has it already."""
        run = self._evaluator.run
        held = next((where for each, where in run.held_locks if each is lock), None)
        if held is not None and run.waits:
            line = getattr(held.node, 'lineno', 0)
            run.report(
                'blocked-group',
                place,
                f'this waits for ever for a lock that the behaviour has taken in line {line}',
                'write threading.RLock, or take it in one place',
                used_at=lock.origin,
            )

    @contextmanager
    def holding(self, value: Value, place: Place) -> Iterator[None]:
        """Take a lock meanwhile, if it is one."""
        held = self._evaluator.run.held_locks
        if not isinstance(value, Primitive) or value.kind != _LOCK:
            yield
            return
        self.take(value, place)
        self._evaluator.run.held_locks = [*held, (value, place)]
        yield
        self._evaluator.run.held_locks = held

    # Names of the state, and of modules

    def poll(self, node: ast.While, scope: Scope) -> None:
        """Note a loop that goes on until a name changes that other behaviours set."""
        test = _test_of(node)
        if test is None or not scope.waits:
            return
        stored = {
            each.id
            for each in ast.walk(node)
            if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
        }
        asked = {each.id for each in ast.walk(test) if isinstance(each, ast.Name)}
        names = set() if asked & stored else self._probe(test, scope)
        # Of several, each may end it.
        if len(names) == 1:
            self._block(names.pop(), Place(scope.module, test))

    def _probe(self, test: ast.expr, scope: Scope) -> set[Awaited]:
        """Return the names on which alone a condition depends."""
        run = self._evaluator.run
        moved, names = run.moves + run.tried, scope.copy_names()
        run.probed = set()
        try:
            with run.silence():
                self._evaluator.evaluate(test, scope)
        finally:
            found, run.probed = run.probed, None
            scope.names = names
        return found if run.moves + run.tried == moved else set()


def shown(what: Awaited) -> str:
    """Return what is waited for in words."""
    if isinstance(what, Primitive):
        return f'this {what.kind.rpartition(".")[2].lower()}'
    is_state = what.kind == 'state' or what.kind in FILLING
    return f"'node.state.{what.name}'" if is_state else f"'{what.name}'"


def _is_timed(name: str, arguments: Arguments) -> bool:
    """Return whether a wait ends by itself, or may."""
    if arguments.is_open:
        return True
    first = arguments.get(0, 'blocking' if name == 'acquire' else 'block')
    if name in ('get', 'acquire') and first is not None:
        return first.value != Constant(bool, value=True) or len(list(arguments.all())) > 1
    position = 1 if name in ('wait_for', 'get', 'acquire') else 0
    timeout = arguments.get(position, 'timeout')
    return timeout is not None and not is_none(timeout.value)


def _test_of(node: ast.While) -> ast.expr | None:
    """Return the condition that alone ends a loop, or goes on with it."""
    outs = [each for each in own_nodes(node) if isinstance(each, WAYS_OUT)]
    if not outs:
        return None if isinstance(node.test, ast.Constant) else node.test
    if not isinstance(node.test, ast.Constant) or len(outs) > 1:
        return None
    for each in node.body:
        match each:
            case ast.If(body=[ast.Break() | ast.Return()], orelse=[]):
                return each.test
    return None
