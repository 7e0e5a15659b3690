"""Classes that calls make: `namedtuple`, `SimpleNamespace` and the like."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any

from composer.inference.evaluation.part import Part
from composer.inference.scopes import Scope
from composer.inference.values import (
    UNKNOWN,
    Arguments,
    Class,
    Constant,
    External,
    Place,
    Sequence,
    Value,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

_TUPLE = ('NamedTuple', 'typing.NamedTuple')
_DATACLASS = ('dataclass', 'dataclasses.dataclass')


class MadeRecords(Part):
    """Evaluates calls that make a class, or an object of a class of its own.

    Such a class is one of the project, whose fields are written where the call names them.
    """

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        # By their identities, other parts know their syntax trees.
        self._made: list[Class] = []

    def handlers(self) -> dict[str, Callable[[Arguments, Place], Value]]:
        """Return what evaluates each function, by its full name."""
        return {
            'argparse.Namespace': self._namespace,
            'collections.namedtuple': self._tuple,
            'dataclasses.make_dataclass': self._dataclass,
            'types.SimpleNamespace': self._namespace,
            'typing.NamedTuple': self._tuple,
            'typing.TypedDict': lambda _, __: External('builtins.dict'),
        }

    def _tuple(self, arguments: Arguments, place: Place) -> Value:
        return self._make_of(arguments, place, _TUPLE, {'defaults', 'rename'})

    def _dataclass(self, arguments: Arguments, place: Place) -> Value:
        return self._make_of(arguments, place, _DATACLASS, {'bases', 'namespace'})

    def _make_of(
        self, arguments: Arguments, place: Place, base: tuple[str, str], others: set[str]
    ) -> Value:
        fields = arguments.get(1, 'field_names')
        names = None if fields is None else _names_in(fields.value, fields.place)
        if names is None or arguments.is_open or others & set(dict(arguments.named)):
            self._evaluator.calls.escape_all(arguments)
            return UNKNOWN
        return self._make(names, place, base)

    def _namespace(self, arguments: Arguments, place: Place) -> Value:
        if arguments.positional or arguments.is_open:
            self._evaluator.calls.escape_all(arguments)
            return UNKNOWN
        names = [(name, argument.place) for name, argument in arguments.named]
        made: Value = self._evaluator.classes.instantiate(
            self._make(names, place, _DATACLASS), arguments
        )
        return made

    def _make(
        self, fields: Iterable[tuple[str, Place]], place: Place, base: tuple[str, str]
    ) -> Class:
        name, full_name = base
        body: list[ast.stmt] = []
        for field, where in fields:
            target = ast.copy_location(ast.Name(field, ast.Store()), where.node)
            body.append(ast.AnnAssign(target, ast.Name('object', ast.Load()), None, 1))
        by: list[ast.expr] = [ast.Name(name, ast.Load())]
        definition = ast.ClassDef(
            name='record',
            bases=by if base == _TUPLE else [],
            keywords=[],
            body=body,
            decorator_list=by if base == _DATACLASS else [],
        )
        outer = Scope(place.module, local=frozenset({name}), names={name: External(full_name)})
        made = Class(place.module, ast.copy_location(definition, place.node), outer)
        self._made.append(made)
        return made


def _names_in(value: Value, place: Place) -> list[tuple[str, Place]] | None:
    """Return the names of fields and where they are written, as `namedtuple` takes them."""
    match value:
        case Constant(value=str(text), origin=origin):
            return [(name, origin or place) for name in text.replace(',', ' ').split()]
        case Sequence() if value.is_whole:
            found: list[tuple[str, Place]] = []
            for item, where in value.items:
                # Those of `NamedTuple` and `make_dataclass` have types.
                pair = item.items[0] if isinstance(item, Sequence) and item.items else None
                name, at = pair or (item, where)
                if not isinstance(name, Constant) or not isinstance(name.value, str):
                    return None
                found.append((name.value, at))
            return found
    return None
