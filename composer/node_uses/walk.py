"""Walks through the code of a behaviour, and of the functions of the project that it calls."""

from __future__ import annotations

import ast
import builtins
import importlib.util
import re
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from composer.entity_kinds import GOAL_STATUSES
from composer.node_uses import node_calls, waiting
from composer.node_uses.names import (
    Chain,
    Class,
    External,
    Function,
    Instance,
    Made,
    Scope,
    Texts,
    Value,
)
from composer.node_uses.reading import (
    NAMING_METHODS,
    Awaited,
    MessageUse,
    NeededValue,
    NodeUse,
    Passed,
    Payload,
    Run,
)
from composer.python_source.annotations import find_interface
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.syntax import (
    is_none,
    list_arguments,
    list_children,
    list_nodes,
    owner_of,
    stored_names,
    words_in,
)
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from composer.node_uses.names import Names

# Longer chains of calls are not followed, and the node that is given to one may do anything.
_DEEPEST = 5
# What one behaviour may take: an expression is a step.
_MOST_STEPS = 30_000
# Those of all behaviours that are read together.
_MOST_STEPS_IN_ALL = 600_000
_TESTS = frozenset(
    {'callable', 'get_fields_and_field_types', 'getattr', 'hasattr', 'isinstance', 'type'}
)
# What decides on a condition, from what changes while the system runs to what never does.
_RANKS = ('', 'state', 'file', 'fixed')
_ENDS = (ast.Return, ast.Raise, ast.Break, ast.Continue)
NODE_ATTRIBUTES = frozenset(
    {
        *('logger', 'name', 'own_state', 'parameters', 'publishers', 'ros', 'state', 'stopping'),
        'subscriptions',
    }
)
LOGGER_NAMES = frozenset(
    {
        *('debug', 'error', 'fatal', 'get_child', 'get_effective_level', 'info', 'log', 'name'),
        *('is_enabled_for', 'set_level', 'warn', 'warning'),
    }
)
_SPINNING = frozenset(
    f'rclpy.{name}' for name in ('spin', 'spin_once', 'spin_until_future_complete')
)
_METHOD = re.compile(r'^    def ([a-z]\w*)', re.MULTILINE)
_OF_MAPPING = frozenset({'get', 'items', 'keys', 'values'})
# Functions that take no `None`.
_NEEDING = re.compile(
    r'math\.\w+|builtins\.(abs|enumerate|float|int|len|list|max|min|range|round|sorted|sum|tuple|zip)'
)
# Those that take one after their first argument.
_NEEDING_ONE = ('builtins.round', 'math.perm')
# Functions that keep nothing of what they are given.
_HARMLESS = frozenset(
    f'builtins.{name}'
    for name in (
        *('bool', 'callable', 'dict', 'format', 'hasattr', 'id', 'isinstance', 'len', 'list'),
        *('print', 'repr', 'sorted', 'str', 'tuple', 'type'),
    )
)
# What changes a list or an array of a message.
_MUTATORS = frozenset(
    {
        *('append', 'byteswap', 'clear', 'extend', 'fill', 'frombytes', 'insert', 'pop', 'put'),
        *('remove', 'resize', 'reverse', 'sort'),
    }
)
# What a wrong name raises, and what catches it.
_CATCHING = frozenset(
    {
        *('AttributeError', 'ComposerError', 'KeyError', 'LookupError', 'NameError'),
        *('PayloadError', 'TypeError', 'UndeclaredError', 'UndeclaredParameterError'),
        'ValueError',
    }
)
_SUPPRESSING = frozenset({'raises', 'suppress'})
_CATCHING_ALL = frozenset({'BaseException', 'Exception'})
_DOING_NOTHING = (ast.Pass, ast.Continue, ast.Return, ast.Break)
_ACTING = (ast.Await, ast.Call, ast.NamedExpr, ast.Yield, ast.YieldFrom)
_WITHOUT_EFFECT = (ast.Dict, ast.List, ast.Set, ast.Tuple, ast.Compare, ast.JoinedStr)
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


Places: TypeAlias = dict[int, tuple[bool, bool, bool]]


class TooLongError(Exception):
    """A behaviour is too long to be walked through."""


class Walk:
    """Notes what one behaviour does.

    Attributes:
        places: The functions, statements and expressions that were walked through, by the
            identities of their syntax trees. Of each, whether errors are caught there, whether
            it is on a branch on which the file decides, and whether it comes after such a
            decision; of several ways there, of the most certain one.
    """

    def __init__(self, names: Names, places: Places) -> None:
        self.run = Run(names)
        self.places = places
        self._names = names
        # The functions under way, the behaviour first.
        self._under_way: list[Scope] = []
        self._steps = 0
        self._entered: set[object] = set()
        self._asked: dict[int, set[str]] = {}
        self._stored: dict[int, ast.expr] = {}

    # Functions

    def enter(
        self,
        function: Function,
        passed: dict[str, Value | None],
        *,
        is_waited: bool,
        is_call: bool = True,
    ) -> None:
        """Walk through a function that Composer calls, or this code."""
        definition, run = function.definition, self.run
        run.reading.passed.append(Passed(definition, passed, is_call or not function.is_returned))
        given = {name: value for name, value in passed.items() if value is not None}
        arguments = [each.arg for each in list_arguments(definition.args)]
        if function.bound is not None and arguments:
            given[arguments[0]] = function.bound
        key = (
            *(id(definition), is_waited, frozenset(given.items()), run.is_certain, run.doubts > 0),
            *(run.guards > 0, tuple(lock for lock, _ in run.held_locks)),
        )
        if key in self._entered:
            return
        self._entered.add(key)
        stored = self._names.stored_in(definition)
        chains = {name: value for name, value in given.items() if isinstance(value, Chain)}
        for name, chain in chains.items():
            if name in stored or len(self._under_way) >= _DEEPEST:
                run.escape(chain)
        if len(self._under_way) >= _DEEPEST:
            return
        self._note_place(definition)
        scope = Scope(function.module, definition, given, function.scope, waits=is_waited)
        run.reading.modules |= {id(each): each for each in (function.module, *function.makers)}
        before = run.standing
        self._under_way.append(scope)
        if isinstance(definition, ast.Lambda):
            self.visit(definition.body, scope)
        else:
            self._block(definition.body, scope)
        self._under_way.pop()
        run.standing = before

    def _note_place(self, node: ast.AST) -> None:
        run = self.run
        is_caught = run.guards > run.kinds or run.broad_guards > 0
        here = (is_caught, run.branches > 0, run.doubts > 0)
        self.places[id(node)] = min(here, self.places.get(id(node), here))

    def _follow(
        self, function: Function, call: ast.Call, scope: Scope, *, is_waited: bool
    ) -> None:
        """Walk through a function of the project that is called here."""
        misfit = node_calls.explain_misfit(node_calls.called_signature(function), call)
        if misfit is not None:
            name = getattr(function.definition, 'name', 'the function')
            text = f'{name}() is called with other arguments: {misfit}'
            self.run.report('bad-call', scope.module, call, text, None)
            return
        given = self._names.bind(function, call, scope)
        is_open = any(isinstance(each, ast.Starred) for each in call.args)
        for node in (*call.args, *(each.value for each in call.keywords)):
            value = self._names.value_of(node, scope)
            if is_open or not isinstance(value, Chain) or value not in given.values():
                self.visit(node, scope)
            else:
                self._note_read(value, node, scope)
        self.run.calls.append(scope.module.span_of(call))
        if node_calls.is_open(call):
            given = {**dict.fromkeys(function.parameters), **given}
        self.enter(function, given, is_waited=is_waited and scope.waits)
        self.run.calls.pop()

    def _hand_on(self, function: Function, given: Sequence[Value | None]) -> None:
        """Walk through a function that something may call later, with these arguments first."""
        names = function.parameters
        self.enter(function, dict(zip_longest(names, given[: len(names)])), is_waited=False)

    # Statements

    def _block(self, body: Sequence[ast.stmt], scope: Scope) -> None:
        for statement in body:
            self._statement(statement, scope)

    def _statement(self, node: ast.stmt, scope: Scope) -> None:
        self._note_place(node)
        match node:
            case ast.If() | ast.While():
                self._branch(node, scope)
            case ast.Try() | ast.TryStar():
                self._try(node, scope)
            case ast.With() | ast.AsyncWith():
                self._with(node, scope)
            case ast.For() | ast.AsyncFor():
                self.need(node.iter, scope)
                self.visit(node.iter, scope)
                self.visit(node.target, scope)
                self._block(node.body, scope)
                self._else(node.orelse, scope)
            case ast.Match():
                self.visit(node.subject, scope)
                chosen = self._chosen_by(node.subject, scope)
                for case in node.cases:
                    for pattern in [case.pattern, *getattr(case.pattern, 'patterns', ())]:
                        if isinstance(pattern, ast.MatchValue):
                            self._compare_with(node.subject, pattern.value, scope)
                    with self.run.condition(chosen):
                        if case.guard is not None:
                            self.visit(case.guard, scope)
                        self._block(case.body, scope)
                self._doubt_rest(node, chosen)
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                inner = Function(scope.module, node, None, scope)
                self.enter(inner, {}, is_waited=False)
            case ast.ClassDef():
                self._block(node.body, scope)
            case ast.Expr():
                self._expression(node.value, scope)
            case ast.Global(names=names):
                self._note_globals(names, scope)
            case ast.AugAssign(target=target, value=value):
                self._need_operands(node, scope)
                self.visit(value, scope)
                if not self._read_target(target, scope):
                    self.visit(target, scope)
            case ast.Assign(targets=targets, value=value):
                self._assign(targets, value, scope)
            case _:
                # Functions do not evaluate the annotations of their names.
                annotation = getattr(node, 'annotation', None)
                for child in list_children(node):
                    if isinstance(child, ast.expr) and child is not annotation:
                        self.visit(child, scope)

    def _note_globals(self, names: Sequence[str], scope: Scope) -> None:
        stored = stored_names(scope.definition or ast.Pass())
        for name in names:
            what = waiting.global_name(self.run, name, scope)
            if what is not None and name in stored:
                self.run.fill(what, scope)

    def _branch(self, node: ast.If | ast.While, scope: Scope) -> None:
        chosen = self._chosen_by(node.test, scope)
        self.visit(node.test, scope)
        if isinstance(node, ast.While):
            waiting.note_loop(self.run, node, scope)
        with self.run.condition(chosen, self._state_name(node.test, scope)):
            self._block(node.body, scope)
        with self.run.condition(chosen):
            if isinstance(node, ast.While):
                self._else(node.orelse, scope)
            else:
                self._block(node.orelse, scope)
        match node.test:
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                self._doubt_rest(node, chosen, self._state_name(operand, scope))
            case _:
                self._doubt_rest(node, chosen)

    def _state_name(self, test: ast.expr, scope: Scope) -> str:
        """Return the name of `node.state` that is all of a test."""
        match self._names.value_of(test, scope):
            case Chain(path=('node', 'state', name)):
                return name
        return ''

    def _else(self, body: Sequence[ast.stmt], scope: Scope) -> None:
        """Walk through what comes only where a loop did not break, or nothing was raised."""
        with self.run.condition('file'):
            self._block(body, scope)

    def _doubt_rest(self, node: ast.AST, chosen: str, held: str = '') -> None:
        """Note that what follows is only reached where a branch does not end before."""
        if any(isinstance(each, _ENDS) for each in ast.walk(node)):
            self.run.doubt(chosen, held)

    def _try(self, node: ast.Try | ast.TryStar, scope: Scope) -> None:
        is_guard = any(map(_is_guard, node.handlers))
        with self.run.guard(is_guard=is_guard, is_broad=any(map(_is_broad, node.handlers))):
            self._block(node.body, scope)
        for handler in node.handlers:
            with self.run.guard(is_guard=is_guard):
                self._block(handler.body, scope)
        self._else(node.orelse, scope)
        self._block(node.finalbody, scope)

    def _with(self, node: ast.With | ast.AsyncWith, scope: Scope) -> None:
        held = [*self.run.held_locks]
        is_guard = False
        for item in node.items:
            value = self._names.value_of(item.context_expr, scope)
            if isinstance(value, Made) and value.kind == waiting.LOCK:
                waiting.take(self.run, value, item.context_expr, scope)
                self.run.held_locks.append((value, item.context_expr.lineno))
            self.visit(item.context_expr, scope)
            if item.optional_vars is not None:
                self.visit(item.optional_vars, scope)
            if isinstance(item.context_expr, ast.Call):
                func = item.context_expr.func
                called = self._names.value_of(func, scope)
                # One of the project may catch what its body raises.
                is_guard |= isinstance(called, Class) or bool(words_in(func) & _SUPPRESSING)
                is_guard |= called is None and isinstance(func, ast.Name)
        with self.run.guard(is_guard=is_guard):
            self._block(node.body, scope)
        self.run.held_locks = held

    def _assign(self, targets: Sequence[ast.expr], value: ast.expr, scope: Scope) -> None:
        """Walk through an assignment; the node may have another name, or be kept in its object."""
        known = self._names.value_of(value, scope)
        is_kept = isinstance(known, Chain | Function) and all(
            self._names.value_of(each, scope) == known
            or (isinstance(each, ast.Name) and known != Chain(('node', 'own_state')))
            for each in targets
        )
        if isinstance(value, ast.Tuple) and all(isinstance(each, ast.Tuple) for each in targets):
            for target in targets:
                for one, other in zip(getattr(target, 'elts', ()), value.elts, strict=False):
                    self._assign([one], other, scope)
            return
        if not is_kept or isinstance(value, ast.Call):
            self.visit(value, scope)
        elif isinstance(known, Chain):
            self._note_read(known, value, scope)
        for target in targets:
            if isinstance(target, ast.Tuple | ast.List):
                self.need(value, scope)
            self._stored[id(target)] = value
            self.visit(target, scope)
        match targets, value:
            case [ast.Name(id=name)], ast.Call(func=func):
                nodes = ast.walk(scope.definition or ast.Pass())
                is_alone = [getattr(each, 'id', '') for each in nodes].count(name) == 1
                if is_alone and self._kind_of(func, scope) is FunctionKind.COROUTINE:
                    text = f"'{name}' is a coroutine that is never awaited, so it never runs"
                    help_text = 'put await before it'
                    self.run.report('missing-await', scope.module, value, text, help_text)

    def _read_target(self, target: ast.expr, scope: Scope) -> bool:
        """Note that `x += 1` reads x, too; return whether it does not make it."""
        match self._names.value_of(target, scope):
            case Chain(path=('node', 'state', name)):
                self.run.use_state(name, scope.module, target)
                self.run.fill(Awaited('', 'state', name), scope)
                return True
        match target:
            case ast.Subscript(value=inner, slice=key):
                if self._names.value_of(inner, scope) == Chain(('node', 'own_state')):
                    self._read_own_state(key, scope)
        return False

    def _expression(self, node: ast.expr, scope: Scope) -> None:
        """Walk through an expression whose value nothing takes."""
        run, module = self.run, scope.module
        self.visit(node, scope)
        if isinstance(node, _WITHOUT_EFFECT) and not any(
            isinstance(each, _ACTING) for each in ast.walk(node)
        ):
            run.report('no-effect', module, node, 'this has no effect', 'return it, or remove it')
        elif isinstance(node, ast.Attribute):
            match self._names.value_of(node, scope):
                case Chain(path=('node', name)) if name in node_calls.NODE_METHODS:
                    run.report('no-effect', module, node, 'this is not called', f'write {name}()')
        elif isinstance(node, ast.Call):
            match self._kind_of(node.func, scope), self._names.value_of(node, scope):
                case FunctionKind.COROUTINE, _:
                    text = f"'{ast.unparse(node.func)}(…)' is never awaited, so it never runs"
                    run.report('missing-await', module, node.func, text, 'put await before it')
                case FunctionKind.GENERATOR, _:
                    text = 'this makes a generator, and nothing goes through it'
                    run.report('no-effect', module, node, text, "write 'yield from' before it")
                case _, Made(kind=waiting.THREAD):
                    text = 'this thread is never started'
                    run.report('no-effect', module, node, text, 'write .start()')

    def _kind_of(self, func: ast.expr, scope: Scope) -> FunctionKind | None:
        match self._names.value_of(func, scope):
            case Chain(path=('node', 'call_async') | ('goal', _, 'result_async')):
                return FunctionKind.COROUTINE
            case Function(definition=ast.FunctionDef() | ast.AsyncFunctionDef() as definition):
                return self._names.kind_of(definition)
        return None

    # Conditions

    def _chosen_by(self, test: ast.expr, scope: Scope) -> str:
        """Return what decides on a condition: `fixed`, `file`, `state`, or something else."""
        return self._strongest([test], scope, set()) or ''

    def _strongest(self, nodes: Iterable[ast.AST], scope: Scope, seen: set[str]) -> str | None:
        """Return what decides on parts of which each may decide alone; `None` for constants."""
        found = [self._decided_by(each, scope, seen) for each in nodes]
        return max((each for each in found if each is not None), key=_RANKS.index, default=None)

    def _decided_by(self, node: ast.AST, scope: Scope, seen: set[str]) -> str | None:
        if self._asks_what_it_is(node, scope):
            return 'fixed'
        if isinstance(node, ast.Attribute | ast.Name):
            match self._names.value_of(node, scope):
                case Chain(path=('node', 'name', *_)):
                    return 'fixed'
                case Chain(path=('node', 'parameters', *_)) | Texts():
                    return 'file'
                case Chain(path=('node', 'state' | 'own_state', *_)):
                    return 'state'
        match node:
            case ast.Constant() | ast.Lambda():
                return None
            case ast.Name(id=name):
                if name in seen:
                    return ''
                if self._is_given(name, scope) or self._is_constant(name, scope):
                    return 'file' if self._is_given(name, scope) else 'fixed'
                stored = self._names.stored_in(scope.definition).get(name, [])
                values = [value for value, _ in stored if value is not None]
                return self._strongest(values, scope, seen | {name}) or ''
            case ast.Compare() | ast.BinOp() | ast.Call():
                # A value of the run beside one of the file: both outcomes may come.
                operands = list_children(node)
                if isinstance(node, ast.Call):
                    # Of what is called, only its owner counts.
                    operands = [*list_children(node.func), *operands[1:]]
                if any(self._asks_what_it_is(each, scope) for each in operands):
                    return 'fixed'
                found = [self._decided_by(each, scope, seen) for each in operands]
                known = (each for each in found if each is not None)
                return min(known, key=_RANKS.index, default=None)
        return self._strongest(list_children(node), scope, seen)

    def _asks_what_it_is(self, node: ast.AST, scope: Scope) -> bool:
        """Return whether a part of a test asks for a type, an attribute, or an identity."""
        match node:
            case ast.Compare(ops=[ast.Is() | ast.IsNot()], comparators=[other]):
                is_member = isinstance(other, ast.Attribute) and other.attr.isupper()
                return not (isinstance(other, ast.Constant) or is_member)
            case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name), args=args):
                of = self._names.value_of(args[0], scope) if args else None
                is_asked = isinstance(of, Chain) and of.path[0] in ('message', 'made')
                called = self._names.value_of(node.func, scope) if is_asked else None
                # A function of the project may ask that.
                asks = isinstance(called, Function) and bool(words_in(called.definition) & _TESTS)
                return asks or (name in _TESTS and of != Chain(('node', 'state')))
            case ast.Attribute(attr=name):
                return name.startswith('__')
        return False

    def _is_given(self, name: str, scope: Scope) -> bool:
        """Return whether a name is an argument of which nothing is known, or a constant."""
        within: Scope | None = scope
        while within is not None and within.definition is not None:
            if name in self._names.stored_in(within.definition):
                return False
            if name in within.arguments:
                return not isinstance(within.given.get(name), Chain | Instance | Class)
            within = within.outer
        return False

    def _is_constant(self, name: str, scope: Scope) -> bool:
        """Return whether a name is one that a module never changes, or imports."""
        match scope.module.top.statements.get(name):
            case [(ast.Assign(value=ast.Constant()) | ast.ImportFrom(), _), *_]:
                return name.isupper()
        return False

    def _asked_in(self, scope: Scope) -> set[str]:
        """Return the parameters and states that a function asks whether they have a value."""
        if scope.definition is None:
            return set()
        key = id(scope.definition)
        if key not in self._asked:
            self._asked[key] = set()
            nodes = list_nodes(_tests_in(scope.definition))
            operands = {id(each) for node in nodes for each in self._operands_of(node, scope)}
            for node in nodes:
                if isinstance(node, ast.Attribute | ast.Name) and id(node) not in operands:
                    match self._names.value_of(node, scope):
                        case Chain(path=('node', 'parameters' | 'state' as of, name, *_)):
                            self._asked[key].add(f'{of}.{name}')
            # What it calls may ask, too.
            for node in list_nodes([scope.definition]):
                called = (
                    self._names.value_of(node.func, scope) if isinstance(node, ast.Call) else None
                )
                if isinstance(called, Function) and called.definition is not scope.definition:
                    self._asked[key] |= _compared_with_none(called.definition)
        return self._asked[key]

    def need(self, node: ast.expr, scope: Scope) -> None:
        """Note that something has to have a value: a parameter or a state may be unset."""
        match self._names.value_of(node, scope):
            case Chain(path=('node', 'parameters' | 'state' as of, name)):
                run, full = self.run, f'{of}.{name}'
                is_ready = bool(run.guards or run.broad_guards or run.doubts)
                is_set = of == 'state' and name in run.reading.state_set
                # A caller may have asked before.
                is_ready |= any(full in self._asked_in(each) for each in (scope, *self._under_way))
                if name in _OF_MAPPING or is_ready or is_set:
                    return
                if of == 'parameters' or len(run.held_states) == run.state_doubts:
                    needed = NeededValue(of, name, scope.module.span_of(node), run.held_states)
                    run.reading.values_needed.append(needed)

    def _need_operands(self, node: ast.AST, scope: Scope) -> None:
        for operand in self._operands_of(node, scope):
            self.need(operand, scope)

    def _operands_of(self, node: ast.AST, scope: Scope) -> list[ast.expr]:
        """Return the parts of an expression, or of `x += 1`, that cannot be `None`."""
        match node:
            case ast.BinOp(left=one, op=op, right=other) | ast.AugAssign(one, op, other):
                return [] if isinstance(op, ast.Mod) else [one, other]
            case ast.Compare(left, [ast.Lt() | ast.LtE() | ast.Gt() | ast.GtE(), *_], others):
                return [left, *others]
            case ast.Subscript(value=owner):
                return [owner]
            case ast.FormattedValue(shown, -1, ast.JoinedStr([ast.Constant(), *_])):
                return [shown]
            case ast.Call(func=func, args=args, keywords=keywords):
                match self._names.value_of(func, scope):
                    case External(name=name) if _NEEDING.fullmatch(name):
                        is_keyed = len(args) > 1 and any(each.arg == 'key' for each in keywords)
                        return [] if is_keyed else args[:1] if name in _NEEDING_ONE else args
        return []

    # Expressions

    def visit(self, node: ast.expr, scope: Scope) -> None:
        """Walk through an expression.

        Raises:
            TooLongError: There were too many.
        """
        self._steps += 1
        self._names.walked += 1
        if self._steps > _MOST_STEPS or self._names.walked > _MOST_STEPS_IN_ALL:
            raise TooLongError
        self._note_place(node)
        self._need_operands(node, scope)
        match node:
            case ast.Name() | ast.Attribute() | ast.Subscript():
                self._visit_name(node, scope)
            case ast.Call():
                self._call(node, scope)
            case ast.Await(value=value):
                self._await(value, scope)
            case ast.Lambda():
                self.enter(Function(scope.module, node, None, scope), {}, is_waited=False)
            case ast.IfExp(test=test, body=body, orelse=other):
                self.visit(test, scope)
                with self.run.condition(self._chosen_by(test, scope)):
                    self.visit(body, scope)
                    self.visit(other, scope)
            case ast.BoolOp(values=[first, *rest]):
                self.visit(first, scope)
                with self.run.condition(self._chosen_by(first, scope)):
                    for each in rest:
                        self.visit(each, scope)
            case ast.Compare():
                self._compare(node, scope)
            case _:
                self._visit_all(node, scope)

    def _visit_all(self, node: ast.AST, scope: Scope) -> None:
        for child in list_children(node):
            if isinstance(child, ast.expr):
                self.visit(child, scope)
            else:
                self._visit_all(child, scope)

    def _visit_name(self, node: ast.Name | ast.Attribute | ast.Subscript, scope: Scope) -> None:
        value = self._names.value_of(node, scope)
        match node:
            # The name may stand for a part of the node from here on.
            case ast.Name(ctx=ast.Store()):
                value = None
            case ast.Attribute(value=inner, attr=name, ctx=ast.Store()):
                owner = self._names.value_of(inner, scope)
                value = Chain((*owner.path, name)) if isinstance(owner, Chain) else None
        if isinstance(value, Chain):
            self._use(value, node, scope)
            self._visit_calls(node, scope)
            return
        if isinstance(node, ast.Subscript):
            self._subscript(node, scope)
        elif isinstance(node, ast.Attribute):
            self._note_unresolved(node.value, node, scope)
            self.visit(node.value, scope)
        elif isinstance(node.ctx, ast.Load):
            self._check_defined(node, scope)
        if isinstance(value, Function) and isinstance(node.ctx, ast.Load):
            self._hand_on(value, [])

    def _note_unresolved(self, inner: ast.expr, node: ast.expr, scope: Scope) -> None:
        if self._names.value_of(inner, scope) is None:
            self.run.reading.unresolved.append(node)

    def _visit_calls(self, node: ast.expr, scope: Scope) -> None:
        """Visit the call whose result a chain begins with, as in `node.send_goal('a').status`."""
        owner = owner_of(node)
        if isinstance(owner, ast.Call | ast.Await):
            self.visit(owner, scope)

    def _check_defined(self, node: ast.Name, scope: Scope) -> None:
        top, name = scope.module.top, node.id
        if top.is_open or top.is_dynamic or name[:2] in ('_', '__') or hasattr(builtins, name):
            return
        defined = self._names.defined_in(scope)
        if name not in defined:
            help_text = suggest(name, defined)
            for own, value in scope.given.items():
                if isinstance(value, Instance) and self._names.attribute(value, name):
                    help_text = f'write {own}.{name}'
            help_text = 'take node as a parameter' if name == 'node' else help_text
            text = f"'{name}' is not defined"
            self.run.report('undefined-name', scope.module, node, text, help_text)

    def _subscript(self, node: ast.Subscript, scope: Scope) -> None:
        is_stored = isinstance(node.ctx, ast.Store)
        key = node.slice
        match self._names.value_of(node.value, scope):
            case Chain(path=('node', 'parameters')) if is_stored:
                self._refuse_parameter(key, scope)
            case Chain(path=('node', 'parameters') | ('changes',) as path):
                named = self._names.value_of(key, scope)
                self.run.use('parameter', named, is_change=path == ('changes',))
            case Chain(path=('node', 'publishers')):
                self.run.use('publisher', self._names.value_of(key, scope))
            case Chain(path=('node', 'own_state')):
                if is_stored:
                    self._set_own_state(key, scope)
                else:
                    self._read_own_state(key, scope)
            case Chain(path=('node', 'state')):
                text = "the node's state has attributes, and no items"
                help_text = 'write node.state.NAME'
                self.run.report('unknown-attribute', scope.module, node, text, help_text)
            case _:
                self._note_unresolved(node.value, node, scope)
                self.visit(node.value, scope)
        self.visit(key, scope)

    def _set_own_state(self, key: ast.expr | None, scope: Scope) -> None:
        named = self._names.value_of(key, scope) if key else None
        if isinstance(named, Texts):
            self.run.reading.own_state_set |= named.all
        else:
            self.run.reading.is_own_state_open = True

    def _read_own_state(self, key: ast.expr, scope: Scope) -> None:
        named = self._names.value_of(key, scope)
        is_guarded = bool(self.run.guards or self.run.doubts)
        for text, node, module in named.options if isinstance(named, Texts) else ():
            use = NodeUse('own_state', text, module.span_of(node, text), is_guarded=is_guarded)
            self.run.reading.own_state_read.append(use)

    def _compare(self, node: ast.Compare, scope: Scope) -> None:
        operands = [node.left, *node.comparators]
        match node:
            case ast.Compare(ops=[ast.In() | ast.NotIn()], comparators=[container]):
                named = self._names.value_of(node.left, scope)
                match self._names.value_of(container, scope):
                    case Chain(path=('node', 'parameters') | ('changes',) as path):
                        is_change = path == ('changes',)
                        self.run.ask('parameter', named, is_change=is_change)
                        operands = [node.left]
                    case Chain(path=('node', 'own_state')):
                        self._set_own_state(node.left, scope)
                        operands = [node.left]
                for each in getattr(container, 'elts', ()):
                    self._compare_with(node.left, each, scope)
            case ast.Compare(ops=[ast.Eq() | ast.NotEq()], comparators=[ast.Constant()]):
                self._compare_with(node.left, operands[1], scope)
        for operand in operands:
            self.visit(operand, scope)

    def _compare_with(self, node: ast.expr, other: ast.expr, scope: Scope) -> None:
        match self._names.value_of(node, scope), other:
            case Chain(path=('goal', _, 'status')), ast.Constant(value=value):
                if value not in GOAL_STATUSES:
                    text = f'the status of a goal is never {value!r}'
                    help_text = suggest(value, GOAL_STATUSES, 'it is one of')
                    self.run.report('never-equal', scope.module, other, text, help_text)
            case Chain(path=('node', 'parameters', name)), ast.Constant(value=str() as value):
                if not self.run.guards:
                    place = scope.module.span_of(other, value)
                    self.run.reading.compared.append((name, value, place))

    # The node and its parts

    def _use(
        self, chain: Chain, node: ast.Name | ast.Attribute | ast.Subscript, scope: Scope
    ) -> None:
        """Note a use of something that the behaviour is given, outside a call of it."""
        is_stored = not isinstance(node.ctx, ast.Load)
        match chain.path:
            case ('node', 'state', name) if is_stored:
                self.run.set_state(name, scope, node)
            case ('node', 'parameters', name) if is_stored:
                self._refuse_parameter(node, scope, name)
            case ('node', name) if is_stored:
                if name not in NODE_ATTRIBUTES:
                    text = f"the node takes no attribute '{name}'"
                    help_text = f'keep it in node.state.{name}'
                    self.run.report('unknown-attribute', scope.module, node, text, help_text)
            case ('node', 'own_state', name) if is_stored:
                text = f"own_state takes no attribute '{name}'"
                help_text = f'it is a dictionary: write [{name!r}]'
                self.run.report('unknown-attribute', scope.module, node, text, help_text)
            case _:
                self.run.escape(chain)
                self._note_read(chain, node, scope)

    def _note_read(self, chain: Chain, node: ast.expr, scope: Scope) -> None:
        run = self.run
        match chain.path:
            case ('message' | 'made', *_):
                self._use_message(chain, node, scope)
            case ('node', 'parameters', name, *_) if name not in _OF_MAPPING:
                owner = _prefix(node, name)
                if owner is not None:
                    named = Texts(((name, owner, scope.module),))
                    run.use('parameter', named)
            case ('node', 'parameters', _, *_):
                run.reading.open_kinds.add('parameter')
            case ('node', 'state', name, *_):
                owner = _prefix(node, name)
                if name.startswith('__'):
                    run.reading.is_state_open = True
                elif owner is not None:
                    run.use_state(name, scope.module, owner)
                    if owner is not node:
                        self.need(owner, scope)
            case ('node', 'ros', name, *_) if _is_question(name):
                pass
            case ('node', 'ros', *_):
                run.reading.reaches_ros = True
                run.reading.open_kinds.add('parameter')
            case ('node', 'logger', name, *_) if name not in LOGGER_NAMES:
                self._unknown("the node's logger", name, LOGGER_NAMES, _prefix(node, name), scope)
            case ('node', method, name) if method in node_calls.NODE_METHODS and not hasattr(
                _prefix, name
            ):
                text = f"'{name}' is read of the method '{method}', which is not called"
                help_text = f'write {method}().{name}'
                run.report('unknown-attribute', scope.module, node, text, help_text)
            case ('node', 'own_state', name, *_) if not hasattr(dict, name):
                text, help_text = f"own_state has no '{name}'", f'write [{name!r}]'
                run.report('unknown-attribute', scope.module, node, text, help_text)
            case ('node', name, *_) if name not in node_calls.NODE_METHODS | NODE_ATTRIBUTES:
                if not name.startswith('__'):
                    known = node_calls.NODE_METHODS | NODE_ATTRIBUTES
                    self._unknown('the node', name, known, _prefix(node, name), scope)

    def _unknown(
        self, owner: str, name: str, known: frozenset[str], node: ast.expr | None, scope: Scope
    ) -> None:
        if node is None:
            return
        help_text = suggest(name, known, 'it has')
        if owner == 'the node' and (name in node_calls.OF_RCLPY or name in _ros_members()):
            help_text = node_calls.OF_RCLPY.get(name, f"did you mean 'ros.{name}'?")
        text = f"{owner} has no attribute '{name}'"
        self.run.report('unknown-attribute', scope.module, node, text, help_text)

    def _refuse_parameter(self, node: ast.expr, scope: Scope, name: str = '') -> None:
        named = self._names.value_of(node, scope)
        if isinstance(named, Texts):
            name = named.options[0][0]
        text = f"this does not set the parameter '{name or '…'}'"
        help_text = f'did you mean node.set_parameters(node.name, {{{name!r}: …}})?'
        self.run.report('unset-parameter', scope.module, node, text, help_text)

    def _use_message(self, chain: Chain, node: ast.expr, scope: Scope) -> None:
        run = self.run
        is_write = isinstance(getattr(node, 'ctx', None), ast.Store | ast.Del)
        of_type = chain.path[1] if chain.path[0] == 'made' else None
        path = chain.path[2 if of_type else 1 :]
        is_guarded = run.guards or run.broad_guards or run.fixed
        if path and (is_write or not is_guarded):
            value = self._stored.get(id(node))
            if value is not None:
                self.need(value, scope)
            # The type of a message that the behaviour makes is the same in any system.
            # In a function that is called, an argument may tell which type it is.
            certain = not run.doubts or (bool(of_type) and not run.calls)
            use = MessageUse(path, node, scope.module, is_write, certain, of_type, value)
            run.reading.message_uses.append(use)
        for inner in ast.walk(node):
            if isinstance(inner, ast.Subscript):
                self.visit(inner.slice, scope)

    # Calls

    def _await(self, value: ast.expr, scope: Scope) -> None:
        if not isinstance(value, ast.Call):
            self.visit(value, scope)
            return
        func = self._names.value_of(value.func, scope)
        match func:
            case Chain(path=('node', name)) if name in node_calls.NODE_METHODS - {'call_async'}:
                text = 'what is awaited here is no coroutine'
                self.run.report('missing-await', scope.module, value, text, 'leave out the await')
            case External(name=name) if name in _OF_LOOP and scope.waits:
                is_zero = bool(value.args) and ast.unparse(value.args[0]) in ('0', '0.0')
                if not (name == 'asyncio.sleep' and is_zero):
                    needs = f'{name} needs the event loop of asyncio'
                    text = f'{needs}, and behaviours run in that of ROS'
                    help_text = _INSTEAD.get(name)
                    self.run.report('no-event-loop', scope.module, value, text, help_text)
        self._call(value, scope, is_awaited=True)

    def _call(self, call: ast.Call, scope: Scope, *, is_awaited: bool = False) -> None:
        match call.func:
            case ast.Attribute(
                value=ast.Subscript(value=publishers, slice=key), attr='publish'
            ) if self._names.value_of(publishers, scope) == Chain(('node', 'publishers')):
                # As `node.publish(key, …)`.
                named = ast.Call(publishers, [key, *call.args], call.keywords)
                self._call_node('publish', ast.copy_location(named, call), scope, is_awaited=False)
                return
        func = self._names.value_of(call.func, scope)
        match func:
            case None if getattr(call.func, 'attr', '') in NAMING_METHODS:
                self.run.reading.unresolved += list_nodes([call])
            case Chain():
                self._call_chain(func, call, scope, is_awaited=is_awaited)
                return
            case Function():
                is_later = isinstance(func.definition, ast.AsyncFunctionDef) and not is_awaited
                self._follow(func, call, scope, is_waited=not is_later)
                return
            case Class() as of:
                instance = self._names.instance_of(of, call, scope)
                init = self._names.attribute(instance, '__init__')
                is_plain = not any(map(_is_made_otherwise, self._names.bases_of(of)))
                if isinstance(init, Function) and is_plain:
                    self._follow(init, call, scope, is_waited=True)
                    return
            case External(name='time.sleep') if call.args:
                waiting.note_sleep(self.run, call.args[0], call, scope)
            case External(name=name) if name in _SPINNING and call.args:
                spun = self._names.value_of(call.args[0], scope)
                if spun in (Chain(('node',)), Chain(('node', 'ros'))):
                    text = f'{name} would spin a node that the system spins already'
                    help_text = 'wait with node.call, node.send_goal, await or node.sleep'
                    self.run.report('bad-call', scope.module, call, text, help_text)
            case External(name='composer.AbortedError'):
                for node in call.args[1:2]:
                    payload = Payload('', 'aborted', '', node, scope.module, self.run.is_certain)
                    self.run.reading.payloads.append(payload)
            case External(name=name) if (interface := find_interface(name)) is not None:
                for each in call.keywords:
                    if each.arg and not (self.run.guards or self.run.broad_guards):
                        path, value = (each.arg,), each.value
                        use = MessageUse(path, each, scope.module, True, True, interface, value)
                        self.run.reading.message_uses.append(use)
            case External(name='builtins.hasattr' | 'builtins.getattr' | 'builtins.setattr'):
                if self._call_attribute(func.name, call, scope):
                    return
        owner = call.func.value if isinstance(call.func, ast.Attribute) else None
        made = self._names.value_of(owner, scope) if owner is not None else None
        if isinstance(made, Made) and isinstance(call.func, ast.Attribute):
            waiting.note_method(self.run, made, call, call.func.attr, scope)
        if not isinstance(call.func, ast.Name):
            self.visit(call.func, scope)
        else:
            self._check_defined(call.func, scope)
        self._pass_on(call, func, scope)

    def _pass_on(self, call: ast.Call, func: Value | None, scope: Scope) -> None:
        """Walk through what is given to something unknown; functions may be called by it."""
        nodes = [*call.args, *(each.value for each in call.keywords)]
        inner = [each for node in nodes for each in (getattr(node, 'elts', None) or [node])]
        values = [self._names.value_of(each, scope) for each in inner]
        functions = [each for each in values if isinstance(each, Function)]
        if functions and Chain(('node',)) in values:
            # `Thread(target=work, args=(node,))`, `partial(work, node)`
            given = [value for value in values if not isinstance(value, Function)]
            for function in functions:
                self._hand_on(function, given)
            nodes = [
                node
                for node, value in zip(inner, values, strict=True)
                if not isinstance(value, Function) and value != Chain(('node',))
            ]
        is_harmless = isinstance(func, External) and func.name in _HARMLESS
        for node in nodes:
            value = self._names.value_of(node, scope)
            if is_harmless and isinstance(value, Chain) and value.path[0] == 'node':
                if value.path != ('node',):
                    self._note_read(value, node, scope)
                continue
            self.visit(node, scope)
        if isinstance(func, External) and func.name == waiting.THREAD and scope.waits:
            self._check_target(call, scope)

    def _check_target(self, call: ast.Call, scope: Scope) -> None:
        """Report a target of a thread that is called right here."""
        for keyword in call.keywords:
            target = keyword.value
            if keyword.arg == 'target' and isinstance(target, ast.Call):
                called = self._names.value_of(target.func, scope)
                if isinstance(called, Function) and not _gives(called.definition):
                    text = 'this is called here, and the thread runs nothing'
                    help_text = f'give it {ast.unparse(target.func)}, and args=(…)'
                    self.run.report('no-effect', scope.module, target, text, help_text)

    def _call_chain(self, chain: Chain, call: ast.Call, scope: Scope, *, is_awaited: bool) -> None:
        run = self.run
        is_noted = True
        match chain.path:
            case ('node', method) if method in node_calls.NODE_METHODS:
                self._call_node(method, call, scope, is_awaited=is_awaited)
                return
            case ('node', 'parameters' as owner, 'get') | ('changes' as owner, 'get'):
                named = self._names.value_of(call.args[0], scope) if call.args else None
                has_default = len(call.args) + len(call.keywords) > 1 or owner == 'changes'
                run.ask('parameter', named, has_default=has_default, is_change=owner == 'changes')
            case ('node', 'publishers', *_):
                run.escape(chain)
            case ('changes', *_):
                run.reading.open_kinds.add('parameter')
            case ('node', 'own_state', method):
                self._call_own_state(method, call, scope)
            case ('node', 'state', name, method):
                waiting.note_method_of_state(run, name, call, method, scope)
                is_noted = False
            case ('goal', name, 'result' | 'result_async' as method):
                if scope.waits and not run.doubts and (method == 'result' or is_awaited):
                    run.use('action client', Texts(((name, call, scope.module),)), waits='end')
                self._visit_calls(call.func, scope)
            case ('message', *path, method):
                if method in _MUTATORS and path and isinstance(call.func, ast.Attribute):
                    use = MessageUse(tuple(path), call.func.value, scope.module, is_write=True)
                    run.reading.message_uses.append(use)
                elif path and isinstance(call.func, ast.Attribute):
                    self.visit(call.func.value, scope)
            case _:
                is_noted = False
        if not is_noted:
            self._note_read(chain, call.func, scope)
            self._visit_calls(call.func, scope)
        self._pass_on(call, None, scope)

    def _call_node(self, method: str, call: ast.Call, scope: Scope, *, is_awaited: bool) -> None:
        run = self.run
        if method == 'sleep' and call.args:
            waiting.note_sleep(run, call.args[0], call.args[0], scope)
        later = node_calls.note_call(run, method, call, scope, is_awaited=is_awaited)
        for function, given in later:
            self._hand_on(function, given)
        for position, node in enumerate((*call.args, *(each.value for each in call.keywords))):
            value = self._names.value_of(node, scope)
            if isinstance(value, Function) and method.startswith('create_'):
                continue
            if position and method == 'publish':
                for needed in node.values if isinstance(node, ast.Dict) else [node]:
                    self.need(needed, scope)
            self.visit(node, scope)

    def _call_own_state(self, method: str, call: ast.Call, scope: Scope) -> None:
        keys: list[ast.expr | None] = []
        if method == 'update':
            self.run.reading.own_state_set |= {each.arg for each in call.keywords if each.arg}
            keys = [key for node in call.args for key in getattr(node, 'keys', [None])]
        elif method in ('get', 'setdefault', 'pop'):
            keys = [*call.args[:1]]
            if method == 'pop' and len(call.args) == 1:
                self._read_own_state(call.args[0], scope)
        for key in keys:
            self._set_own_state(key, scope)

    def _call_attribute(self, function: str, call: ast.Call, scope: Scope) -> bool:
        """Note what `hasattr(node.state, 'x')` and the like use; return whether that is all."""
        if len(call.args) < 2:  # noqa: PLR2004 (the object and the name)
            return False
        owner, named = (self._names.value_of(each, scope) for each in call.args[:2])
        texts = named.all if isinstance(named, Texts) else None
        run = self.run
        match owner:
            case Chain(path=('node', 'parameters')):
                run.ask('parameter', named)
            case Chain(path=('node', 'state')) if texts is not None:
                run.reading.state_tested |= texts
                for text in texts if function.endswith('setattr') else ():
                    run.set_state(text, scope, call)
            case None:
                run.reading.unresolved += list_nodes([call])
                return False
            case Chain(path=('node', 'state')):
                run.reading.is_state_open = True
            case _:
                return False
        for node in call.args[2:]:
            self.visit(node, scope)
        return True


def _is_question(method: str) -> bool:
    """Return whether a method of rclpy's node asks for what has nothing to do with its ends."""
    return method.startswith(('count_', 'get_')) and 'parameter' not in method


def _prefix(node: ast.expr, name: str) -> ast.expr | None:
    """Return the part of a chain of attributes that ends with a name, if it is written there."""
    parts = (part for part in ast.walk(node) if isinstance(part, ast.Attribute))
    return next((part for part in parts if part.attr == name), None)


def _is_made_otherwise(of: Class) -> bool:
    """Return whether objects of a class may be made with other arguments than it says."""
    enums = any(name.endswith(('Enum', 'Flag')) for name in words_in(*of.definition.bases))
    return bool(of.definition.keywords or of.definition.decorator_list) or enums


def _compared_with_none(definition: ast.AST) -> set[str]:
    compared = (
        each
        for node in ast.walk(definition)
        if isinstance(node, ast.Compare) and any(map(is_none, node.comparators))
        for each in ast.walk(node)
    )
    return {
        f'{each.value.attr}.{each.attr}'
        for each in compared
        if isinstance(each, ast.Attribute) and isinstance(each.value, ast.Attribute)
    }


def _tests_in(definition: ast.AST) -> list[ast.AST]:
    found: list[ast.AST] = []
    for node in ast.walk(definition):
        match node:
            case ast.If() | ast.IfExp() | ast.While() | ast.Assert():
                found.append(node.test)
            case ast.BoolOp(values=values) | ast.comprehension(ifs=values):
                found += values
            case ast.Match(subject=subject):
                found.append(subject)
    return found


def _is_guard(handler: ast.ExceptHandler) -> bool:
    """Return whether a handler expects wrong names: it catches them, or ignores everything."""
    names = words_in(handler.type) if handler.type else {'BaseException'}
    does_nothing = all(isinstance(each, _DOING_NOTHING) for each in handler.body)
    return bool(names & _CATCHING) or (does_nothing and bool(names & _CATCHING_ALL))


def _is_broad(handler: ast.ExceptHandler) -> bool:
    """Return whether a handler catches everything, and goes on."""
    raises = any(isinstance(node, ast.Raise) for each in handler.body for node in ast.walk(each))
    return (handler.type is None or bool(words_in(handler.type) & _CATCHING_ALL)) and not raises


def _gives(definition: ast.AST) -> bool:
    return isinstance(definition, ast.Lambda) or any(
        isinstance(node, ast.Return | ast.Yield | ast.YieldFrom) for node in ast.walk(definition)
    )


@cache
def _ros_members() -> frozenset[str]:
    """Return the names of the public methods and properties of `node.ros`; without rclpy, none."""
    package = importlib.util.find_spec('rclpy')
    folders = map(Path, package.submodule_search_locations or () if package else ())
    paths = [each / name for each in folders for name in ('node.py', 'lifecycle/node.py')]
    texts = (each.read_text() for each in paths if each.is_file())
    return frozenset(name for text in texts for name in _METHOD.findall(text))
