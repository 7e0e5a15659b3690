"""The parts that evaluate a behaviour, and what they share: names, functions and classes."""

from __future__ import annotations

import ast
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, cast

from composer.inference.classes.project_classes import Classes
from composer.inference.evaluation.attributes import Attributes
from composer.inference.evaluation.calling import Calls
from composer.inference.evaluation.containers import Containers
from composer.inference.evaluation.expressions import Expressions
from composer.inference.evaluation.function_calls import Functions
from composer.inference.evaluation.imports import Imports
from composer.inference.evaluation.library.known_values import refusal
from composer.inference.evaluation.library.library_calls import LibraryCalls
from composer.inference.evaluation.library.method_calls import MethodCalls
from composer.inference.evaluation.node_calls import NodeCalls
from composer.inference.evaluation.operators import explain_unset
from composer.inference.evaluation.payload_fits import Payloads
from composer.inference.evaluation.read_only_writes import ReadOnlyWrites
from composer.inference.evaluation.sleeping import Sleeping
from composer.inference.evaluation.waiting import WAITING, Waiting
from composer.inference.message_types import item_of
from composer.inference.reading import SENDING_METHODS
from composer.inference.scopes import Scope
from composer.inference.statements.guards import Guards
from composer.inference.statements.loop_rounds import Loops
from composer.inference.statements.match_cases import MatchCases
from composer.inference.statements.narrowing import Narrowing
from composer.inference.statements.statement_flow import Statements
from composer.inference.values import (
    BY_PARAMETER,
    BY_STATE,
    CHOSEN,
    NODE,
    NONE,
    UNKNOWN,
    Alternatives,
    ArrayField,
    Awaitable,
    BoundMethod,
    Class,
    Constant,
    Function,
    Generated,
    Held,
    Instance,
    Mapping,
    Message,
    NodeValue,
    Partial,
    PartOfNode,
    Place,
    Primitive,
    ProjectModule,
    Scalar,
    Sequence,
    Super,
    Unknown,
    Value,
    alternatives,
    before_set,
    constant,
    held_by,
    is_chosen,
    join,
    share,
    truth_of,
)
from composer.python_source.changed_names import ALL, NOTHING, changed_in
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from composer.inference.current_run import Run
    from composer.python_source.modules import ModuleSource


# What is kept in the state as a value of these, is one of them later.
_LASTING = (bool, int, float, str, list)


class Evaluator:
    """Evaluates expressions and follows statements and functions, in one run.

    Attributes:
        kept: Objects of classes of the project that are kept in the state, by their names there.
        call_places: Where the calls under way are written.
    """

    def __init__(self, run: Run) -> None:
        self.run = run
        self.expressions = Expressions(self)
        self.statements = Statements(self)
        self.loops = Loops(self)
        self.guards = Guards(self)
        self.match_cases = MatchCases(self)
        self.narrowing = Narrowing(self)
        self.calls = Calls(self)
        self.node_calls = NodeCalls(self)
        self.containers = Containers(self)
        self.library = LibraryCalls(self)
        self.methods = MethodCalls(self)
        self.functions = Functions(self)
        self.classes = Classes(self)
        self.imports = Imports(self)
        self.attributes = Attributes(self)
        self.payloads = Payloads(self)
        self.read_only = ReadOnlyWrites(self)
        self.waiting = Waiting(self)
        self.sleeping = Sleeping(self)
        self.call_places: list[Place] = []
        self.kept: dict[str, Value] = {}

    def evaluate(self, node: ast.expr, scope: Scope) -> Value:
        """Return what an expression may be."""
        return self.expressions.evaluate(node, scope)

    def look_up(self, node: ast.Name, scope: Scope) -> Value:
        """Return what a name stands for."""
        name = node.id
        if name == '__debug__':
            return CHOSEN
        current: Scope | None = scope
        while current is not None:
            is_later = current.is_body and name not in (current.names or ())
            if current is scope and name not in current.local and name in (current.names or ()):
                held = current.names[name] if current.names else UNKNOWN
                if all(isinstance(each, Instance | Unknown) for each in alternatives(held)):
                    # A global one that was just stored.
                    return held
            if name in current.local and not is_later:
                value = current.latest(name) if current is not scope else None
                if current.names is not None and name in current.names:
                    value = current.names[name]
                if value is None and current is scope and not current.looped:
                    self._refuse_unbound(name, current, Place(scope.module, node))
                return UNKNOWN if value is None else value
            current = current.outer
        modules = self.run.modules
        if not modules.has_name(scope.module, name):
            place = Place(scope.module, node)
            known = [*modules.top(scope.module).statements, *scope.all_names()]
            message = f"'{name}' is not defined"
            self.run.report('undefined-name', place, message, suggest(name, known))
            return UNKNOWN
        if self.run.probed is not None and name in modules.top(scope.module).changed:
            self.run.probed.add(Held(str(scope.module.path), name))
        return self.top_value(scope.module, name)

    def _refuse_unbound(self, name: str, scope: Scope, place: Place) -> None:
        """Report a name of a function that no statement before a place has stored."""
        if scope.names is not None and scope.function is not None and name not in scope.stored:
            text = f"'{name}' has no value here: this function stores it later, or elsewhere"
            self.run.report('undefined-name', place, text)

    def top_value(self, module: ModuleSource, name: str) -> Value:
        """Return what a name at the top of a module stands for."""
        self.run.reading.modules.setdefault(id(module), module)
        home = self.run.modules.star_home(module, name)
        if home is not None:
            return self.top_value(home, name)

        def evaluate(statement: ast.AST, is_conditional: bool) -> Value:  # noqa: FBT001
            scope = Scope(module)
            with self.run.afresh(is_guard=is_conditional):
                if isinstance(statement, ast.Import | ast.ImportFrom):
                    return self.imports.imported(module, statement, name)
                self.statements.follow_all([cast('ast.stmt', statement)], scope)
            value = (scope.names or {}).get(name, UNKNOWN)
            self._lose(value, self.run.modules.change_of(module, name))
            is_fixed = isinstance(value, Function | Class | Instance | ProjectModule)
            is_stored = self.run.modules.is_stored_anyhow(module, name)
            return UNKNOWN if is_stored and not is_fixed else value

        return self.run.modules.value(module, name, evaluate)

    def _lose(self, value: Value, depth: int) -> None:
        """Note how deep other code changes what a module holds."""
        if depth == ALL and isinstance(value, Mapping | Sequence | Instance | Class):
            self.escape(value)
        for each in held_by(value) if ALL < depth < NOTHING else ():
            self._lose(each, depth - 1)

    def read_target(self, target: ast.expr, scope: Scope) -> Value:
        """Return what the target of `+=` holds."""
        if isinstance(target, ast.Name):
            return self.look_up(target, scope)
        if isinstance(target, ast.Attribute):
            owner = self.evaluate(target.value, scope)
            return self.attributes.read(owner, target.attr, Place(scope.module, target))
        if isinstance(target, ast.Subscript):
            owner = self.evaluate(target.value, scope)
            index = self.evaluate(target.slice, scope)
            self.attributes.read_item(owner, index, Place(scope.module, target.slice))
        return UNKNOWN

    def awaited(self, node: ast.expr, scope: Scope) -> Value:
        """Return what an operand may be, which should be no coroutine."""
        value = self.evaluate(node, scope)
        if isinstance(value, Awaitable):
            text = 'this is a coroutine, which has not been awaited'
            self.run.report(
                'missing-await', Place(scope.module, node), text, 'put await before it'
            )
            return value.result
        return value

    def refuse(
        self, place: Place, function: Callable[..., object], *arguments: Value, **named: Value
    ) -> None:
        """Report that Python refuses the types of what a function is called with."""
        problem = refusal(function, *arguments, **named)
        unset = next(filter(None, (getattr(each, 'unset', '') for each in arguments)), '')
        if problem is not None:
            self.run.report('bad-call', place, problem)
        elif unset and refusal(function, *map(before_set, arguments), **named):
            self.run.report('no-value', place, *explain_unset(unset))

    def tested(self, node: ast.expr, scope: Scope) -> Value:
        """Return what a condition may be: a coroutine is always true."""
        return self.awaited(node, scope)

    def iterated(self, node: ast.expr, scope: Scope, is_async: int) -> Value:
        """Return what a loop goes through."""
        value = self.awaited(node, scope)
        if isinstance(value, Generated) and value.is_async and not is_async:
            text = 'this is an async generator'
            place = Place(scope.module, node)
            self.run.report('missing-await', place, text, "go through it with 'async for'")
        elif is_async and all(map(_is_plain, alternatives(value))):
            text = 'this is no async generator'
            place = Place(scope.module, node)
            self.run.report('missing-await', place, text, "go through it with 'for'")
        else:
            self.refuse(Place(scope.module, node), iter, value)
        return value

    @contextmanager
    def branch(self, test: Value, *, is_taken: bool) -> Iterator[None]:
        """Read a branch: one that is never taken has no problems, and may use names.

        What the file decides on may be decided otherwise by the next file, or a parameter.
        """
        self.run.decide(test)
        truth = truth_of(test)
        is_dead = truth is not None and truth != is_taken
        is_doubt = is_dead or (truth is None and is_chosen(test) > 0)
        with ExitStack() as around:
            chosen = is_chosen(test)
            around.enter_context(
                self.run.condition(is_doubt=is_doubt, chosen=chosen, decided=chosen > BY_STATE)
            )
            if is_dead and chosen != BY_PARAMETER:
                around.enter_context(self.run.dead_branch())
            yield

    def home_of(self, scope: Scope) -> Scope:
        """Return the scope of the function itself: comprehensions have their own."""
        while scope.function is not None and scope.outer is not None:
            if scope.outer.function is not scope.function:
                break
            scope = scope.outer
        return scope

    def item_of(self, value: Value) -> Value:
        """Return what an item of something iterated is."""
        return join(self._item_of(each) for each in alternatives(value))

    def _item_of(self, value: Value) -> Value:
        match value:
            case ArrayField():
                return item_of(value)
            case Sequence():
                return value.item()
            case Generated():
                return value.yielded
            case Instance() | Class():
                return self._item_of_object(value)
            case Mapping() if not (value.is_open or value.is_lost) and value.entries:
                return join(constant(key) for key in value.entries)
            case Constant() | Scalar() if value.kind is str:
                return Scalar(str)
            case PartOfNode(name='parameters'):
                self.run.reading.open_kinds.add('parameter')
        return Unknown(is_chosen(value))

    def _item_of_object(self, value: Instance | Class) -> Value:
        items = self.loops.items_of(value)
        if items is not None:
            return join(items)
        if isinstance(value, Class):
            return UNKNOWN
        iterator = self.classes.call_method(value, '__iter__')
        if iterator is None:
            iterator = self.classes.call_method(value, '__aiter__')
        if isinstance(iterator, Instance):
            item = self.classes.call_method(iterator, '__next__')
            if item is None:
                item = self.classes.call_method(iterator, '__anext__')
            return item.result if isinstance(item, Awaitable) else item or UNKNOWN
        return UNKNOWN if iterator is None else self.item_of(iterator)

    def entered(self, value: Value) -> Value:
        """Return what `with value as name` stores."""
        return join(self._entered(each) for each in alternatives(value))

    def _entered(self, value: Value) -> Value:
        if isinstance(value, Instance):
            entered = self.classes.call_method(value, '__enter__')
            if entered is None:
                entered = self.classes.call_method(value, '__aenter__')
                return entered.result if isinstance(entered, Awaitable) else UNKNOWN
            return entered
        return value.yielded if isinstance(value, Generated) else UNKNOWN

    def left(self, value: Value) -> Value | None:
        """Return what the end of `with value` gives: true if it catches what was raised."""
        if not isinstance(value, Instance):
            return None
        reason = (UNKNOWN, UNKNOWN, UNKNOWN)
        ended = self.classes.call_method(value, '__exit__', *reason)
        if ended is None:
            ended = self.classes.call_method(value, '__aexit__', *reason)
            return ended.result if isinstance(ended, Awaitable) else ended
        return ended

    def keep(self, name: str, value: Value) -> None:
        """Note that an object is kept in `node.state` or `node.own_state`, to be used later."""
        kept = self.run.reading.kept
        if is_chosen(value) > BY_STATE or self.run.decided or not self.run.is_sure:
            self.run.reading.kept_by_file.add(name)
        found = join(map(lasting, alternatives(value)))
        kept[name] = join([kept[name], found]) if name in kept else found
        if isinstance(value, Instance) and not value.is_member:
            share(value)
            self.kept[name] = join([value, self.kept[name]]) if name in self.kept else value
        else:
            self.escape(value)

    def kept_value(self, name: str) -> Value:
        """Return what is kept under a name in `node.state`; `[name]` is of `node.own_state`."""
        return self.kept[name] if name in self.kept else self.run.facts.kept_value(name)

    def escape(self, value: Value) -> None:
        """Note that something unknown has a value: it may change it, or call it.

        This holds for all that can be reached from it, too.
        """
        match value:
            case NodeValue():
                self.run.reading.open_all()
            case Constant(value=str(text)):
                self.run.reading.mentioned.add(text)
            case PartOfNode():
                self._escape_part(value)
            case BoundMethod(owner=owner) if owner in (NODE, PartOfNode('parameters')):
                self._escape_method(value)
            case BoundMethod(owner=Primitive() as owner, name=name):
                owner.is_lost |= name not in WAITING.get(owner.kind, ())
            case Primitive():
                value.is_lost = True
            case Mapping() | Sequence() | Instance() | Class():
                self._escape_object(value)
            case Function() if value.definition not in self.functions.active:
                self._escape_function(value)
            case Partial():
                self.calls.invoke_later(value)
            case Alternatives() | BoundMethod() | Super() | Generated() | Awaitable():
                for each in held_by(value):
                    self.escape(each)

    def _escape_part(self, value: PartOfNode) -> None:
        reading = self.run.reading
        reading.open_kinds |= {'parameter'} if value.name == 'parameters' else set()
        reading.is_state_open |= value.name == 'state'
        reading.is_own_state_open |= value.name == 'own_state'

    def _escape_object(self, value: Mapping | Sequence | Instance | Class) -> None:
        is_known = value.is_open if isinstance(value, Instance | Class) else value.is_lost
        if is_known or (isinstance(value, Instance) and value.is_member):
            return
        self.run.changes += 1
        if isinstance(value, Instance | Class):
            value.is_open = True
        else:
            value.is_lost = not (isinstance(value, Sequence) and value.is_fixed)
        of = value.of if isinstance(value, Instance) else value
        if isinstance(of, Class) and of.outer is not None:
            # Its methods reach what is around it.
            for name in self.classes.bodies.names_of(of):
                owner = value if isinstance(value, Instance) else None
                self.escape(self.classes.class_attribute(of, name, owner) or UNKNOWN)
        for each in held_by(value):
            self.escape(each)

    def _escape_function(self, function: Function) -> None:
        """Read a function that may be called with anything, as often as something likes."""
        if isinstance(function.owner, Instance):
            function.owner.is_shared = True
        if not function.is_read or function.outer is not None:
            self.functions.follow_later(function)
        scope = function.outer
        while scope is not None:
            for name in scope.local & changed_in(function.definition):
                self.escape((scope.names or scope.stored).get(name, UNKNOWN))
            scope = scope.outer

    def _escape_method(self, method: BoundMethod) -> None:
        kind = {**SENDING_METHODS, 'get': 'parameter'}.get(method.name)
        if kind is not None:
            self.run.reading.open_kinds.add(kind)
        elif method.name == 'get_parameters':
            self.run.reading.reads_others = True


def lasting(value: Value) -> Value:
    """Return what of a value holds in other calls, too."""
    match value:
        case Message():
            return Message(value.type, is_made=True, is_read_only=value.is_read_only)
        case Constant(value=None):
            return NONE
        case Constant(member=None) | Scalar(unset='') | Sequence() if value.kind in _LASTING:
            return Scalar(value.kind)
        case PartOfNode(name='time' | 'goal'):
            return value
    return UNKNOWN


def _is_plain(value: Value) -> bool:
    """Return whether a value is gone through without waiting."""
    if isinstance(value, Generated):
        return not value.is_async
    return isinstance(value, Sequence | Mapping | ArrayField | Constant | Scalar)
