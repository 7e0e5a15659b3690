"""What a behaviour waits for in its thread: events, queues, locks, names of the state, time."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.node_uses.message_uses import shown_value
from composer.node_uses.names import Chain, External, Made
from composer.node_uses.reading import Awaited, Block
from composer.python_source.syntax import is_none, own_nodes

if TYPE_CHECKING:
    from composer.node_uses.names import Scope
    from composer.node_uses.reading import Run

QUEUES = ('queue.LifoQueue', 'queue.PriorityQueue', 'queue.Queue', 'queue.SimpleQueue')
# The methods that wait for something, by the class; and those that bring it about.
WAITING: dict[str, frozenset[str]] = {
    'threading.Event': frozenset({'wait'}),
    'threading.Condition': frozenset({'wait', 'wait_for'}),
    **dict.fromkeys(QUEUES, frozenset({'get'})),
}
FILLING: dict[str, frozenset[str]] = {
    'threading.Event': frozenset({'set'}),
    'threading.Condition': frozenset({'notify', 'notify_all'}),
    **dict.fromkeys(QUEUES, frozenset({'put', 'put_nowait'})),
}
LOCK, THREAD = 'threading.Lock', 'threading.Thread'
# Methods after which a wait is as before.
_HARMLESS = frozenset({'clear', 'task_done', 'acquire', 'release'})
_ASKING = frozenset({'empty', 'full', 'is_set', 'qsize'})
_CLOCKS = frozenset({'time.monotonic', 'time.perf_counter', 'time.time'})
_WAYS_OUT = (ast.Break, ast.Return, ast.Raise, ast.Yield, ast.YieldFrom, ast.Await)


def note_method(run: Run, owner: Made, call: ast.Call, name: str, scope: Scope) -> None:
    """Note a call of a method of something that threads wait for."""
    if owner.kind == LOCK and name in ('acquire', 'release'):
        run.held_locks = [each for each in run.held_locks if each[0] != owner]
    elif owner.kind in WAITING:
        place = owner.module.span_of(owner.node)
        made_at = f'{place.source.name}:{place.line}:{place.column}'
        noun = f'this {owner.kind.rpartition(".")[2].lower()}'
        _note(run, Awaited(owner.kind, made_at, noun, place), call, name, scope)


def note_method_of_state(run: Run, held: str, call: ast.Call, name: str, scope: Scope) -> None:
    """Note a call of a method of something that is kept in `node.state`."""
    for kind, methods in FILLING.items():
        if name in methods or name in WAITING[kind] or name in _ASKING:
            _note(run, Awaited(kind, 'state', held), call, name, scope)


def _note(run: Run, what: Awaited, call: ast.Call, name: str, scope: Scope) -> None:
    is_wait = name in WAITING[what.kind]
    if name in FILLING[what.kind]:
        run.fill(what, scope)
    elif not is_wait and name not in _HARMLESS:
        run.reading.asked.add(what)
    if is_wait and not _is_timed(name, call):
        _block(run, what, scope, call)


def _block(run: Run, what: Awaited, scope: Scope, node: ast.expr) -> None:
    if scope.waits and not (run.doubts or run.broad_guards):
        called_at = run.calls[0] if run.calls else None
        run.reading.blocks.append(Block(what, scope.module.span_of(node), called_at))


def _is_timed(name: str, call: ast.Call) -> bool:
    """Return whether a wait ends by itself, or may."""
    keywords = {each.arg: each.value for each in call.keywords}
    if None in keywords or any(isinstance(each, ast.Starred) for each in call.args):
        return True
    blocks = keywords.get('block', call.args[0] if call.args else None)
    if name == 'get' and blocks is not None:
        is_true = isinstance(blocks, ast.Constant) and blocks.value is True
        return not is_true or 'timeout' in keywords or len(call.args) > 1
    position = 1 if name in ('wait_for', 'get') else 0
    timeout = keywords.get('timeout', call.args[position] if len(call.args) > position else None)
    return not is_none(timeout)


# Locks


def take(run: Run, lock: Made, node: ast.expr, scope: Scope) -> None:
    """Report that a lock is taken by who has it already."""
    line = next((line for each, line in run.held_locks if each == lock), None)
    if line is not None and scope.waits:
        text = f'this waits for ever for a lock that the behaviour has taken in line {line}'
        help_text = 'write threading.RLock, or take it in one place'
        run.report('blocked-group', scope.module, node, text, help_text)


# Time


def note_sleep(run: Run, seconds: ast.expr, node: ast.expr, scope: Scope) -> None:
    """Note how long the behaviour sleeps."""
    number = shown_value(_meant(run, seconds, scope))
    if isinstance(number, int | float) and scope.waits and not run.doubts:
        run.reading.sleeps.append((float(number), scope.module.span_of(node)))


def _meant(run: Run, node: ast.expr, scope: Scope) -> ast.expr:
    """Return what is assigned to a name, where it is assigned once."""
    if not isinstance(node, ast.Name):
        return node
    if run.names.is_local(node.id, scope):
        value = run.names.alias_of(node.id, scope)
        return value if isinstance(value, ast.expr) else node
    top = scope.module.top
    match top.statements.get(node.id) if node.id not in top.stored_again else None:
        case [(ast.Assign(targets=[ast.Name()], value=value), False)]:
            return value
    return node


def note_loop(run: Run, loop: ast.While, scope: Scope) -> None:
    """Note a loop that only others end, or only the clock."""
    outs = [each for each in own_nodes(loop) if isinstance(each, _WAYS_OUT)]
    test = loop.test
    if isinstance(test, ast.Constant):
        match loop.body, outs:
            case [ast.If(test=inner, body=[ast.Break() | ast.Return()], orelse=[]), *_], [_]:
                test = inner
            case _:
                return
    elif outs:
        return
    limit = _limit_of(run, test, scope)
    if limit is not None:
        note_sleep(run, limit, test, scope)
        return
    match [*_names_in(run, test, scope)]:
        case [Awaited() as what]:
            _block(run, what, scope, test)


def _limit_of(run: Run, test: ast.expr, scope: Scope) -> ast.expr | None:
    """Return how long a loop goes on that only the clock ends."""
    match test:
        case ast.Compare(
            left=ast.BinOp(left=clock, op=ast.Sub()),
            ops=[ast.Lt() | ast.LtE()],
            comparators=[limit],
        ):
            return limit if _is_clock(run, clock, scope) else None
        case ast.Compare(left=clock, ops=[ast.Lt() | ast.LtE()], comparators=[ast.Name() as end]):
            match _meant(run, end, scope):
                case ast.BinOp(left=begin, op=ast.Add(), right=limit):
                    is_clock = _is_clock(run, clock, scope) and _is_clock(run, begin, scope)
                    return limit if is_clock else None
    return None


def _is_clock(run: Run, node: ast.expr, scope: Scope) -> bool:
    function = run.names.value_of(node.func, scope) if isinstance(node, ast.Call) else None
    return isinstance(function, External) and function.name in _CLOCKS


def _names_in(run: Run, test: ast.expr, scope: Scope) -> set[Awaited | None]:
    """Return the names that others change, and on which a condition depends; `None` for more."""
    match test:
        case ast.Constant():
            return set()
        case ast.UnaryOp(operand=operand):
            return _names_in(run, operand, scope)
        case ast.Compare(left=left, comparators=others):
            return set().union(*(_names_in(run, part, scope) for part in (left, *others)))
        case ast.Name() | ast.Attribute():
            return {_changed_name(run, test, scope)}
    return {None}


def _changed_name(run: Run, node: ast.Name | ast.Attribute, scope: Scope) -> Awaited | None:
    match run.names.value_of(node, scope):
        case Chain(path=('node', 'state', name)):
            # A name that it was copied to stays as it is.
            return Awaited('', 'state', name) if isinstance(node, ast.Attribute) else None
    return global_name(run, node.id, scope) if isinstance(node, ast.Name) else None


def global_name(run: Run, name: str, scope: Scope) -> Awaited | None:
    """Return a name of a module that functions store."""
    is_own = name in run.names.stored_in(scope.definition) or name in scope.given
    if is_own or name not in scope.module.top.stored_again:
        return None
    return Awaited('', str(scope.module.path), name)
