"""Functions of the project: how they are made and called."""

from __future__ import annotations

import ast
from contextlib import nullcontext
from typing import Any

from composer.inference.evaluation.part import Part
from composer.inference.evaluation.signatures import explain_misfit
from composer.inference.scopes import LocalNames, Scope, find_local_names
from composer.inference.values import (
    AGAIN,
    NEVER,
    NONE,
    UNKNOWN,
    Alternatives,
    Argument,
    Arguments,
    Awaitable,
    Constant,
    Descriptor,
    External,
    Function,
    Generated,
    Instance,
    Mapping,
    Place,
    Sequence,
    Value,
    constant,
    join,
)
from composer.python_source.changed_names import changed_in
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.modules import FunctionSource, read_signature
from composer.python_source.return_values import ends_without_value, never_returns

# How deep helpers of helpers are followed.
_DEEPEST = 12
_TRANSPARENT = {
    'contextlib.contextmanager',
    'functools.cache',
    'functools.lru_cache',
    'functools.wraps',
    'abc.abstractmethod',
    'dataclasses.dataclass',
    'enum.unique',
    'functools.total_ordering',
    'typing.dataclass_transform',
    'typing.final',
    'typing.no_type_check',
    'typing.runtime_checkable',
    'typing_extensions.override',
    'typing.override',
}
_DESCRIPTORS = {
    'builtins.classmethod': 'classmethod',
    'builtins.property': 'property',
    'builtins.staticmethod': 'staticmethod',
    'functools.cached_property': 'property',
}
_OF_PROPERTY = ('getter', 'setter', 'deleter')


class Functions(Part):
    """Follows calls of functions.

    Args:
        evaluator: Evaluates what is in them, and knows the run.

    Attributes:
        active: The functions under way.
    """

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self.active: list[ast.AST] = []
        self._results: dict[tuple[object, ...], Value] = {}
        self._local_names: dict[int, LocalNames] = {}

    def define(
        self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda, scope: Scope
    ) -> Function:
        """Return the function that a definition makes."""
        is_top = scope.function is None and scope.outer is None
        around = None if is_top else scope
        function = Function(scope.module, node, scope.outer if scope.is_body else around)
        expressions = [each for each in (*node.args.defaults, *node.args.kw_defaults) if each]
        defaults = {each: self._evaluator.evaluate(each, scope) for each in expressions}
        if not is_top and not scope.is_body:
            # In each round of a loop, they may be others.
            function.defaults = defaults
            self._evaluator.home_of(scope).inner.append(function)
        return function

    def decorate(
        self,
        value: Value,
        node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef,
        scope: Scope,
    ) -> Value:
        """Return what the decorators of a definition make of it."""
        for decorator in reversed(node.decorator_list):
            place = Place(scope.module, decorator)
            if isinstance(decorator, ast.Call):
                maker = self._evaluator.evaluate(decorator.func, scope)
                if isinstance(maker, External) and maker.name in _TRANSPARENT:
                    continue
            elif isinstance(decorator, ast.Attribute) and decorator.attr in _OF_PROPERTY:
                held = self._evaluator.evaluate(decorator.value, scope)
                if isinstance(held, Descriptor):
                    is_setter = decorator.attr == 'setter'
                    value = Descriptor(
                        held.kind, held.function, value if is_setter else held.setter
                    )
                    continue
            by = self._evaluator.evaluate(decorator, scope)
            if isinstance(by, External) and by.name in _DESCRIPTORS:
                value = Descriptor(_DESCRIPTORS[by.name], value)
            elif not isinstance(by, External) or by.name not in _TRANSPARENT:
                arguments = Arguments((Argument(value, place),))
                value = self._evaluator.calls.invoke(by, arguments, place)
        return value

    def kind_of(self, function: Function) -> FunctionKind:
        """Return what a call of a function returns."""
        definition = function.definition
        if isinstance(definition, ast.Lambda):
            return FunctionKind.PLAIN
        kinds = self._evaluator.run.modules.kinds
        if id(definition) not in kinds:
            kinds[id(definition)] = FunctionSource(definition).kind or FunctionKind.PLAIN
        found: FunctionKind = kinds[id(definition)]
        return found

    def is_coroutine(self, function: Function) -> bool:
        """Return whether a call returns a coroutine, which runs when it is awaited."""
        return self.kind_of(function) is FunctionKind.COROUTINE

    def follow(self, function: Function, arguments: Arguments, *, waits: bool) -> Value:
        """Return what a call of a function may return, and read what it does."""
        function.is_read = True
        key = self._key_of(function, arguments, waits=waits)
        if key is not None and key in self._results and self._evaluator.run.probed is None:
            self._evaluator.run.tried += 1
            return self._results[key]
        # With known numbers and texts, one that calls itself comes to an end.
        is_simple = all(isinstance(each.value, Constant) for each in arguments.all())
        is_again = function.definition in self.active and not (is_simple and key)
        if is_again or len(self.active) >= _DEEPEST:
            self._evaluator.calls.escape_all(arguments)
            # What a call of itself gives, the other ways through it give, too.
            is_plain = self.kind_of(function) is FunctionKind.PLAIN
            return AGAIN if is_plain and function.definition in self.active else UNKNOWN
        if not self.fits(function, arguments):
            return UNKNOWN
        run, kind = self._evaluator.run, self.kind_of(function)
        # Generators and coroutines run later, if at all.
        is_late = kind.is_generator or (kind is FunctionKind.COROUTINE and not waits)
        changes = run.changes
        with run.condition() if is_late else nullcontext():
            scope = self.enter(function, arguments, waits=waits)
        result = result_of(kind, scope)
        if key is not None and run.changes == changes:
            self._results[key] = result
        return result

    def fits(self, function: Function, arguments: Arguments) -> bool:
        """Return whether a function can be called so; report it if not."""
        if arguments.is_open:
            return True
        given = arguments
        if function.owner is not None:
            me = Argument(function.owner, Place(function.module, function.definition))
            given = Arguments((me, *arguments.positional), arguments.named)
        signature = read_signature(function.definition.args)
        misfit = explain_misfit(signature, given) if signature else None
        if misfit is None or not self._evaluator.call_places:
            return misfit is None
        definition = function.definition
        name = 'the lambda' if isinstance(definition, ast.Lambda) else f"'{definition.name}'"
        message = f'{name} is called with other arguments than it takes: {misfit}'
        self._evaluator.run.report('bad-call', self._evaluator.call_places[-1], message)
        return False

    def _key_of(
        self, function: Function, arguments: Arguments, *, waits: bool
    ) -> tuple[object, ...] | None:
        """Return what a call has to have in common with another one to give the same."""
        values = [argument.value for argument in arguments.all()]
        if any(isinstance(each, Mapping | Sequence | Instance | Alternatives) for each in values):
            return None
        names = tuple(name for name, _ in arguments.named)
        run = self._evaluator.run
        at = (
            bool(run.doubts),
            run.is_sure,
            bool(run.decided),
            bool(run.guards),
            run.is_silent,
            waits,
            tuple(id(lock) for lock, _ in run.held_locks),
            arguments.is_open,
        )
        owner: object = function.owner
        if isinstance(owner, Instance):
            owner = (id(owner), owner.version)
        # What is around it may have changed since the last call.
        around = function.outer.all_versions() if function.outer is not None else 0
        made = (id(function.definition), id(function.outer), around, *function.defaults.values())
        return (made, owner, names, at, *values)

    def enter(self, function: Function, arguments: Arguments, *, waits: bool) -> Scope:
        """Follow the body of a function; return its scope at its end."""
        definition = function.definition
        if id(definition) not in self._local_names:
            self._local_names[id(definition)] = find_local_names(definition)
        names = self._local_names[id(definition)]
        scope = Scope(
            function.module, function, function.outer, names.local, names.unsure, waits=waits
        )
        self._bind(function, arguments, scope)
        self.active.append(definition)
        self._evaluator.run.modules.followed.add(id(definition))
        run = self._evaluator.run
        standing = run.standing
        before, run.waits = run.waits, waits
        try:
            if isinstance(definition, ast.Lambda):
                value = self._evaluator.evaluate(definition.body, scope)
                scope.returned.append((value, Place(function.module, definition.body)))
                scope.names = None
            else:
                self._evaluator.statements.follow_all(definition.body, scope)
                # Past tests that may leave out nothing, there may be no way to the end.
                is_over = scope.names is None or (
                    scope.returned and definition not in ends_without_value(definition)
                )
                if not is_over:
                    if run.doubts:
                        scope.doubtful.add(id(definition))
                    end = Place(function.module, definition)
                    scope.returned.append((constant(None, end), end))
            for inner in scope.inner:
                if not inner.is_read:
                    # Nobody seems to call it.
                    self._evaluator.run.doubts += 1
                    self.follow_later(inner)
                    self._evaluator.run.doubts -= 1
        finally:
            run.waits = before
            run.standing = standing
            self.active.pop()
        return scope

    def follow_later(self, function: Function) -> None:
        """Read a function that something else may call, with anything."""
        with self._evaluator.run.condition():
            self.follow(function, Arguments(is_open=True), waits=False)

    def _bind(self, function: Function, arguments: Arguments, scope: Scope) -> None:
        """Store the arguments of a call in the parameters."""
        parameters = function.definition.args
        positional = [*parameters.posonlyargs, *parameters.args]
        given = list(arguments.positional)
        if function.owner is not None:
            given.insert(0, Argument(function.owner, Place(function.module, function.definition)))
        named = dict(arguments.named)
        for parameter, argument in zip(positional, given, strict=False):
            scope.set(parameter.arg, argument.value)
        rest = given[len(positional) :]
        defaults = dict(
            zip(
                [each.arg for each in reversed(positional)],
                reversed(parameters.defaults),
                strict=False,
            )
        )
        defaults |= {
            each.arg: default
            for each, default in zip(parameters.kwonlyargs, parameters.kw_defaults, strict=True)
            if default is not None
        }
        for parameter in (*positional[len(given) :], *parameters.kwonlyargs):
            name = parameter.arg
            if name in named:
                scope.set(name, named.pop(name).value)
            elif name in defaults and not arguments.is_open:
                value = self._default(function, defaults[name])
                if name in changed_in(function.definition):
                    # Each call finds what the calls before it have left.
                    self._evaluator.escape(value)
                scope.set(name, value)
            else:
                scope.set(name, UNKNOWN)
        if parameters.vararg:
            items = [(argument.value, argument.place) for argument in rest]
            scope.set(parameters.vararg.arg, Sequence(items, tuple, arguments.is_open))
        if parameters.kwarg:
            entries: dict[object, tuple[Value, Place]] = {
                name: (argument.value, argument.place) for name, argument in named.items()
            }
            scope.set(
                parameters.kwarg.arg,
                Mapping(entries, arguments.is_open, self._evaluator.run.conditions),
            )

    def _default(self, function: Function, expression: ast.expr) -> Value:
        if expression in function.defaults:
            return function.defaults[expression]
        with self._evaluator.run.silence():
            outer = function.outer or Scope(function.module)
            value: Value = self._evaluator.evaluate(expression, outer)
        return value


def result_of(kind: FunctionKind, scope: Scope) -> Value:
    """Return what a call gave, from the scope of the function at its end."""
    returned = join([value for value, _ in scope.returned]) if scope.returned else NONE
    definition = scope.function.definition if scope.function else None
    is_said = isinstance(definition, ast.FunctionDef) and never_returns(definition)
    if kind is FunctionKind.PLAIN and (is_said or not scope.returned):
        return NEVER
    if kind is FunctionKind.COROUTINE:
        return Awaitable(returned)
    if kind.is_generator:
        yielded = join([value for value, _ in scope.yielded]) if scope.yielded else UNKNOWN
        return Generated(yielded, returned, is_async=kind is FunctionKind.ASYNC_GENERATOR)
    return returned
