"""Fields of dataclasses and named tuples."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.inference.evaluation.part import Part
from composer.inference.values import (
    UNKNOWN,
    Arguments,
    Class,
    External,
    Instance,
    Place,
    Value,
)
from composer.records import record
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable


@record
class _Field:
    """A field, and the class that declares it."""

    name: str
    of: Class
    target: ast.expr
    default: ast.expr | None
    kind: str


class MadeFields(Part):
    """Evaluates the fields of objects whose `__init__` Python writes."""

    def has_fields(self, of: Class) -> bool:
        """Return whether Python writes the `__init__` of a class from its fields."""
        return self.is_tuple(of) or self._is_dataclass(of)

    def is_tuple(self, of: Class) -> bool:
        """Return whether a class is that of a named tuple."""
        return 'typing.NamedTuple' in self._evaluator.classes.bodies.externals(of)

    def _is_dataclass(self, of: Class) -> bool:
        return any(
            isinstance(each, Class) and 'dataclasses.dataclass' in self._decorators(each)
            for each in self._evaluator.classes.bodies.line_of(of)
        )

    def is_frozen(self, of: Class, name: str) -> bool:
        """Return whether a name is a field that cannot be stored in."""
        makers = [
            each
            for base in self._evaluator.classes.bodies.line_of(of)
            if isinstance(base, Class)
            for each in base.definition.decorator_list
        ]
        frozen = any(
            isinstance(each, ast.Call)
            and any(getattr(word.value, 'value', False) is True for word in each.keywords)
            for each in makers
        )
        is_record = frozen and self._is_dataclass(of)
        return (is_record or self.is_tuple(of)) and name in self._fields(of)

    def _decorators(self, of: Class) -> set[str]:
        found = set()
        for each in of.definition.decorator_list:
            bare = each.func if isinstance(each, ast.Call) else each
            value = self._evaluator.classes.bodies.evaluate_in(of, bare)
            if isinstance(value, External):
                found.add(value.name)
        return found

    def _fields(self, of: Class) -> dict[str, _Field]:
        """Return the fields of a class, those of its bases first."""
        found: dict[str, _Field] = {}
        line = self._evaluator.classes.bodies.line_of(of)
        for each in reversed([each for each in line if isinstance(each, Class)]):
            for statement in each.definition.body:
                match statement:
                    case ast.AnnAssign(target=ast.Name(id=name) as target, value=default):
                        kind = _kind_of(statement)
                        if kind != 'ClassVar':
                            found[name] = _Field(name, each, target, default, kind)
        return found

    def store(self, instance: Instance, arguments: Arguments) -> None:
        """Store the arguments of a call in the fields, and the defaults of others."""
        fields = self._fields(instance.of)
        marks = [name for name, field in fields.items() if field.kind == 'KW_ONLY']
        by_position = [name for name, field in fields.items() if field.kind in ('', 'InitVar')]
        if marks:
            before = list(fields)[: list(fields).index(marks[0])]
            by_position = [name for name in by_position if name in before]
        given = dict(zip(by_position, arguments.positional, strict=False))
        given |= dict(arguments.named)
        if not arguments.is_open:
            self._check_given(instance.of, fields, given)
        for name, field in fields.items():
            if name in given:
                instance.set(name, given[name].value)
            elif field.default is not None and not arguments.is_open:
                instance.set(name, self._default(field))
            else:
                instance.set(name, UNKNOWN)
        extra = [name for name, field in fields.items() if field.kind == 'InitVar']
        values = [instance.attributes.get(name, UNKNOWN) for name in extra]
        self._evaluator.classes.call_method(instance, '__post_init__', *values)

    def _check_given(self, of: Class, fields: dict[str, _Field], given: Iterable[str]) -> None:
        """Report fields without a default that a call leaves out, and those that there are not."""
        calls = self._evaluator.call_places
        bases = self._evaluator.classes.bodies.line_of(of)
        is_made = any(isinstance(each, ast.Call) for each in of.definition.decorator_list)
        if not calls or not all(isinstance(each, Class | External) for each in bases):
            return
        text = f"'{of.definition.name}' is called with other arguments than it takes: "
        others = [name for name in given if name not in fields]
        if others:
            text += f"got an unexpected keyword argument '{others[0]}'"
            self._evaluator.run.report('bad-call', calls[-1], text, suggest(others[0], fields))
        missing = [
            name
            for name, field in fields.items()
            if field.kind in ('', 'InitVar')
            and not is_made
            and field.default is None
            and name not in given
            and (self.is_tuple(of) or 'dataclasses.dataclass' in self._decorators(field.of))
        ]
        if missing:
            text += f"missing a required argument: '{missing[0]}'"
            self._evaluator.run.report('bad-call', calls[-1], text)

    def _default(self, field: _Field) -> Value:
        bodies = self._evaluator.classes.bodies
        default = field.default
        value: Value = UNKNOWN
        if isinstance(default, ast.Call):
            maker = bodies.evaluate_in(field.of, default.func)
            if maker == External('dataclasses.field'):
                given = {each.arg: each.value for each in default.keywords}
                if 'default' in given:
                    value = bodies.evaluate_in(field.of, given['default'])
                elif 'default_factory' in given:
                    factory = bodies.evaluate_in(field.of, given['default_factory'])
                    place = Place(field.of.module, given['default_factory'])
                    value = self._evaluator.calls.invoke(factory, Arguments(), place)
                return value
        if default is not None:
            value = bodies.evaluate_in(field.of, default)
        return value

    def fields_of(self, owner: Instance) -> dict[str, tuple[Value, Place]] | None:
        """Return the fields of an object, and where each is declared."""
        if not self.has_fields(owner.of):
            return None
        return {
            name: (owner.attributes.get(name, UNKNOWN), Place(field.of.module, field.target))
            for name, field in self._fields(owner.of).items()
        }

    def items_of(self, owner: Instance) -> list[Value] | None:
        """Return the items of a named tuple; `None` for other objects."""
        if not self.is_tuple(owner.of):
            return None
        return [owner.attributes.get(name, UNKNOWN) for name in self._fields(owner.of)]


def _kind_of(statement: ast.AnnAssign) -> str:
    """Return what is special about a field: `no init` is set by the class itself."""
    for mark in ('ClassVar', 'InitVar', 'KW_ONLY'):
        if mark in ast.unparse(statement.annotation):
            return mark
    if isinstance(statement.value, ast.Call):
        for keyword in statement.value.keywords:
            if keyword.arg == 'init' and ast.unparse(keyword.value) == 'False':
                return 'no init'
            if keyword.arg == 'kw_only' and ast.unparse(keyword.value) == 'True':
                return 'no init'
    return ''
