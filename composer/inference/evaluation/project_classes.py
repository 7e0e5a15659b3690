"""Classes of the project: their objects, and what those have."""

from __future__ import annotations

import ast
from typing import cast

from composer.inference.evaluation.part import Part
from composer.inference.scopes import Scope
from composer.inference.values import (
    UNKNOWN,
    Arguments,
    Class,
    Function,
    Instance,
    Place,
    Value,
)


class Classes(Part):
    """Evaluates classes."""

    def instantiate(self, of: Class, arguments: Arguments) -> Value:
        """Return an object of a class."""
        made = Instance(of)
        init = self.class_attribute(of, '__init__', made)
        if isinstance(init, Function):
            self._evaluator.functions.follow(init, arguments, waits=True)
        elif self._is_dataclass(of):
            fields = [each.target.id for each in _fields(of)]
            # Fields of bases come first.
            fields = [] if of.definition.bases else fields
            for name, argument in zip(fields, arguments.positional, strict=False):
                made.set(name, argument.value)
            for name, argument in arguments.named:
                made.set(name, argument.value)
        else:
            self._evaluator.calls.escape_all(arguments)
            return made if not of.definition.bases else UNKNOWN
        return made

    def fields_of(self, owner: Instance) -> dict[str, tuple[Value, Place]] | None:
        """Return the fields of an object of a dataclass, and where each is declared."""
        of = owner.of
        if not self._is_dataclass(of) or of.definition.bases:
            return None
        found: dict[str, tuple[Value, Place]] = {}
        for each in _fields(of):
            name = each.target.id
            value = owner.attributes.get(name)
            if value is None and each.value is not None:
                value = self._evaluator.evaluate(each.value, self._scope_of(of))
            found[name] = (value or UNKNOWN, Place(of.module, each.target))
        return found

    def _is_dataclass(self, of: Class) -> bool:
        names = {
            ast.unparse(each.func if isinstance(each, ast.Call) else each)
            for each in of.definition.decorator_list
        }
        return bool(names & {'dataclass', 'dataclasses.dataclass'})

    def class_attribute(self, of: Class, name: str, owner: Instance | None) -> Value | None:
        """Return what a class stores under a name; a method is bound to `owner`."""
        for statement in of.definition.body:
            if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
                if statement.name == name:
                    return self._method(of, statement, owner)
            elif isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value:
                targets = (
                    statement.targets if isinstance(statement, ast.Assign) else [statement.target]
                )
                if any(isinstance(each, ast.Name) and each.id == name for each in targets):
                    is_plain = not of.definition.bases and not self._is_dataclass(of)
                    with self._evaluator.run.silence():
                        value = self._evaluator.evaluate(statement.value, self._scope_of(of))
                    return value if is_plain and self.is_stored_once(of, name) else UNKNOWN
        for base in of.definition.bases:
            with self._evaluator.run.silence():
                found = self._evaluator.evaluate(base, self._scope_of(of))
            if isinstance(found, Class) and found is not of:
                inherited = self.class_attribute(found, name, owner)
                if inherited is not None:
                    return inherited
        return None

    def _scope_of(self, of: Class) -> Scope:
        return of.outer or Scope(of.module)

    def _method(
        self, of: Class, node: ast.FunctionDef | ast.AsyncFunctionDef, owner: Instance | None
    ) -> Value:
        decorators = {ast.unparse(each) for each in node.decorator_list}
        function = Function(of.module, node, of.outer)
        if 'staticmethod' in decorators:
            return function
        if 'classmethod' in decorators:
            function.owner = of
            return function
        if owner is None:
            return function
        function.owner = owner
        if decorators & {'property', 'cached_property', 'functools.cached_property'}:
            return self._evaluator.functions.follow(function, Arguments(), waits=True)
        return UNKNOWN if decorators else function

    def is_stored_once(self, of: Class, name: str) -> bool:
        """Return whether the module stores an attribute of this name in one place only."""
        key = (id(of.module), name)
        if key not in self._evaluator.run.modules.attribute_stores:
            self._evaluator.run.modules.attribute_stores[key] = sum(
                isinstance(node, ast.Attribute)
                and node.attr == name
                and not isinstance(node.ctx, ast.Load)
                for statement in of.module.body
                for node in ast.walk(statement)
            )
        return self._evaluator.run.modules.attribute_stores[key] <= 1


class _Field(ast.AnnAssign):
    """A field of a dataclass."""

    target: ast.Name


def _fields(of: Class) -> list[_Field]:
    """Return the statements that declare the fields of a dataclass."""
    return [
        cast('_Field', each)
        for each in of.definition.body
        if isinstance(each, ast.AnnAssign)
        and isinstance(each.target, ast.Name)
        and 'ClassVar' not in ast.unparse(each.annotation)
    ]
