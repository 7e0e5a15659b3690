"""The bodies and bases of classes."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any

from composer.inference.evaluation.part import Part
from composer.inference.scopes import Names, Scope, own_nodes
from composer.inference.values import UNKNOWN, Class, External, Value
from composer.python_source.local_names import nested_names, stored_names

if TYPE_CHECKING:
    from collections.abc import Sequence

# Bases that bring no attributes which a behaviour would read of its object.
_HARMLESS = {
    *(f'builtins.{name}' for name in ('object', 'str', 'int', 'float')),
    *(f'typing.{name}' for name in ('Generic', 'NamedTuple', 'Protocol', 'TypedDict')),
    *(
        'types.SimpleNamespace',
        'abc.ABC',
        'enum.Enum',
        'enum.IntEnum',
        'enum.StrEnum',
        'enum.Flag',
        'enum.IntFlag',
    ),
}
_METACLASSES = {'abc.ABCMeta'}


class ClassBodies(Part):
    """Reads the bodies of classes, each once."""

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self._names: dict[tuple[int, int], Names] = {}
        self._lines: dict[tuple[int, int], list[Value]] = {}

    def names_of(self, of: Class) -> Names:
        """Return what the statements in the body of a class store."""
        key = (id(of.definition), id(of.outer))
        if key not in self._names:
            self._names[key] = {}
            scope = self.scope_of(of)
            run = self._evaluator.run
            with run.afresh(is_guard=False), run.silence():
                self._evaluator.statements.follow_all(of.definition.body, scope)
            self._names[key] = scope.names or {}
        return self._names[key]

    def scope_of(self, of: Class, names: Names | None = None) -> Scope:
        """Return the scope of a body; functions in it do not see its names."""
        own = list(own_nodes(of.definition))
        local = frozenset({each.id for each in stored_names(own)} | nested_names(own))
        return Scope(of.module, None, of.outer, local, names=dict(names or {}), is_body=True)

    def evaluate_in(self, of: Class, expression: ast.expr) -> Value:
        """Return what an expression in the body of a class may be."""
        with self._evaluator.run.silence():
            scope = self.scope_of(of, self.names_of(of))
            value: Value = self._evaluator.evaluate(expression, scope)
        return value

    def line_of(self, of: Class) -> list[Value]:
        """Return a class and its bases, in the order in which Python looks into them."""
        key = (id(of.definition), id(of.outer))
        if key not in self._lines:
            self._lines[key] = [of]
            bases = self.bases_of(of)
            lines = [self.line_of(each) if isinstance(each, Class) else [each] for each in bases]
            self._lines[key] = [of, *_merge([*lines, bases])]
        return self._lines[key]

    def bases_of(self, of: Class) -> list[Value]:
        """Return what a class inherits from."""
        found: list[Value] = []
        with self._evaluator.run.silence():
            scope = of.outer or Scope(of.module)
            for base in of.definition.bases:
                bare = base.value if isinstance(base, ast.Subscript) else base
                if isinstance(bare, ast.Name) and '.' in bare.id:
                    # Of a class that the library makes: `namedtuple('Step', …)`.
                    found.append(External(bare.id))
                else:
                    found.append(self._evaluator.evaluate(bare, scope))
            for keyword in of.definition.keywords:
                value = self._evaluator.evaluate(keyword.value, scope)
                is_known = isinstance(value, External) and value.name in _METACLASSES
                if keyword.arg == 'metaclass' and not is_known:
                    found.append(UNKNOWN)
        return found

    def externals(self, of: Class) -> set[str]:
        """Return the full names of the bases that are not of the project."""
        return {each.name for each in self.line_of(of) if isinstance(each, External)}

    def find(self, of: Class, name: str, after: Class | None = None) -> tuple[Value, Class] | None:
        """Return what a class or its bases store under a name, and the class that does.

        Args:
            after: A base to go on after, as `super()` does.
        """
        line = self.line_of(of)
        if after is not None:
            line = line[line.index(after) + 1 :] if after in line else [UNKNOWN]
        for each in line:
            if isinstance(each, Class):
                names = self.names_of(each)
                if name in names:
                    return names[name], each
            elif not isinstance(each, External) or each.name not in _HARMLESS:
                return UNKNOWN, of
        return None


def _merge(lines: Sequence[Sequence[Value]]) -> list[Value]:
    """Return the bases of several lines, each after all that it comes after in one of these."""
    merged: list[Value] = []
    rest = [list(line) for line in lines if line]
    while rest:
        heads = [line[0] for line in rest]
        free = (each for each in heads if not any(each in line[1:] for line in rest))
        chosen = next(free, heads[0])
        merged.append(chosen)
        rest = [[each for each in line if each != chosen] for line in rest]
        rest = [line for line in rest if line]
    return merged
