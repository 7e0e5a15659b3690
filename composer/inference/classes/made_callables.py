"""What Python's library makes that can be called: `attrgetter`, `singledispatch` and the like."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.inference.current_run import name_place
from composer.inference.evaluation.part import Part
from composer.inference.scopes import Scope
from composer.inference.values import (
    UNKNOWN,
    Argument,
    Arguments,
    Class,
    Constant,
    Descriptor,
    External,
    Function,
    Instance,
    Message,
    MessageClass,
    Partial,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    join,
)

if TYPE_CHECKING:
    from collections.abc import Callable

# The functions that make something to be called; what this is called with comes last then.
_MAKERS = {
    *('functools.singledispatch', 'operator.attrgetter', 'operator.itemgetter'),
    'operator.methodcaller',
}


class MadeCallables(Part):
    """Evaluates calls of what Python's library makes."""

    def call(self, name: str, arguments: Arguments, place: Place) -> Value | None:
        """Return what a call of a function of the library gives; `None` for other functions."""
        if name in _MAKERS and arguments.positional and not arguments.is_open:
            return Partial(External(f'{name}()'), arguments)
        calls: dict[str, Callable[[Arguments, Place], Value]] = {
            'builtins.property': self._make_property,
            'functools.partialmethod': self._make_method,
            'functools.singledispatch()': self._dispatch,
            'operator.attrgetter()': self._read_attributes,
            'operator.itemgetter()': self._read_items,
            'operator.methodcaller()': self._call_method,
        }
        return calls[name](arguments, place) if name in calls else None

    def _make_method(self, arguments: Arguments, _: Place) -> Value:
        if not arguments.positional:
            return UNKNOWN
        rest = Arguments(arguments.positional[1:], arguments.named, arguments.is_open)
        return Descriptor('partialmethod', Partial(arguments.positional[0].value, rest))

    def _make_property(self, arguments: Arguments, _: Place) -> Value:
        getter, setter = arguments.get(0, 'fget'), arguments.get(1, 'fset')
        stored = setter.value if setter else None
        return Descriptor('property', getter.value, stored) if getter else UNKNOWN

    def _read_attributes(self, arguments: Arguments, place: Place) -> Value:
        *names, owner = arguments.positional
        found = [(self._read_path(owner.value, each), place) for each in names]
        return found[0][0] if len(found) == 1 else Sequence(found, tuple)

    def _read_path(self, owner: Value, path: Argument) -> Value:
        if not isinstance(path.value, Constant) or not isinstance(path.value.value, str):
            self._evaluator.escape(owner)
            return UNKNOWN
        for name in path.value.value.split('.'):
            where = name_place(path, path.value)
            owner = self._evaluator.attributes.read(owner, name, where)
        return owner

    def _read_items(self, arguments: Arguments, place: Place) -> Value:
        *keys, owner = arguments.positional
        found = [
            (self._evaluator.expressions.read_item(owner.value, each.value, each.place), place)
            for each in keys
        ]
        return found[0][0] if len(found) == 1 else Sequence(found, tuple)

    def _call_method(self, arguments: Arguments, place: Place) -> Value:
        name, *given, owner = arguments.positional
        if not isinstance(name.value, Constant) or not isinstance(name.value.value, str):
            self._evaluator.calls.escape_all(arguments)
            return UNKNOWN
        where = name_place(name, name.value)
        method = self._evaluator.attributes.read(owner.value, name.value.value, where)
        rest = Arguments(tuple(given), arguments.named)
        result: Value = self._evaluator.calls.invoke(method, rest, place)
        return result

    def _dispatch(self, arguments: Arguments, place: Place) -> Value:
        """Call the function that is registered for the class of the first argument."""
        base, *given = arguments.positional
        rest = Arguments(tuple(given), arguments.named, arguments.is_open)
        if not given or not isinstance(base.value, Function):
            self._evaluator.calls.escape_all(rest)
            return UNKNOWN
        chosen = [self._registered(base.value, each) for each in alternatives(given[0].value)]
        if None in chosen:
            self._evaluator.calls.escape_all(rest)
            return UNKNOWN
        return join(self._evaluator.calls.invoke(each, rest, place) for each in chosen)

    def _registered(self, base: Function, value: Value) -> Function | None:
        """Return the function for a value; `None` if that may be any."""
        line = self._line_of(value)
        name = getattr(base.definition, 'name', '')
        known = [each for each in base.module.body if isinstance(each, ast.FunctionDef)]
        if line is None:
            return None
        registered: list[tuple[Value, Function]] = []
        for each in known:
            for decorator in each.decorator_list:
                call = decorator if isinstance(decorator, ast.Call) else None
                if ast.unparse(call.func if call else decorator) != f'{name}.register':
                    continue
                first = [*each.args.posonlyargs, *each.args.args][:1]
                classes = call.args if call else [item.annotation for item in first]
                function = Function(base.module, each)
                registered += [
                    (self._class_at(function, item), function) for item in classes if item
                ]
        if not all(_is_class(each) for each, _ in registered):
            return None
        ranked = [function for one in line for each, function in registered if each == one]
        return ranked[0] if ranked else base

    def _line_of(self, value: Value) -> list[Value] | None:
        """Return the class of a value and its bases; `None` if they are not known."""
        match value:
            case Message(type=name):
                return [MessageClass(name)]
            case Instance(of=of):
                line: list[Value] = self._evaluator.classes.bodies.line_of(of)
                return line
            case Constant(kind=kind) | Scalar(kind=kind):
                return [External(f'builtins.{each.__name__}') for each in kind.__mro__]
        return None

    def _class_at(self, function: Function, expression: ast.expr) -> Value:
        scope = Scope(function.module)
        with self._evaluator.run.silence():
            value: Value = self._evaluator.evaluate(expression, scope)
        return value


def _is_class(value: Value) -> bool:
    is_plain = isinstance(value, External) and value.name.startswith('builtins.')
    return is_plain or isinstance(value, Class | MessageClass)
