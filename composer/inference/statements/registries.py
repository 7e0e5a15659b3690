"""Registries: dictionaries and lists at the top of a module that its decorators fill."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, Any, TypeGuard

from composer.inference.evaluation.part import Part
from composer.inference.scopes import Scope
from composer.inference.values import Mapping, Sequence, Value
from composer.python_source.changed_names import CHANGING

if TYPE_CHECKING:
    from composer.python_source.modules import ModuleSource

_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


class Registries(Part):
    """Evaluates registries, once that all that is registered in their modules is."""

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self._found: dict[tuple[int, str], Value | None] = {}

    def find(self, module: ModuleSource, name: str) -> Value | None:
        """Return what a registry holds, which may be more; `None` for other names."""
        key = (id(module), name)
        top = self._evaluator.run.modules.top(module)
        if key not in self._found:
            self._found[key] = None
            statements = top.statements.get(name, [])
            is_changed = len(statements) == 1 and name in top.changed
            if is_changed and isinstance(statements[0][0], ast.Assign | ast.AnnAssign):
                self._fill(module, name, statements[0][0])
        return self._found[key]

    def _fill(self, module: ModuleSource, name: str, made_by: ast.stmt) -> None:
        """Follow the statements at the top of a module that change a registry."""
        fillers = _fillers(module, name)
        if not fillers:
            return
        scope = Scope(module)
        run = self._evaluator.run
        with run.afresh(is_guard=False), run.silence():
            self._evaluator.statements.follow_all([made_by], scope)
            value = (scope.names or {}).get(name)
            if not isinstance(value, Mapping | Sequence) or value.is_lost:
                return
            self._found[id(module), name] = value
            self._evaluator.statements.follow_all(fillers, scope)
            # Other modules may register something, too.
            value.is_open = True


def _fillers(module: ModuleSource, name: str) -> list[ast.stmt] | None:
    """Return what changes a name at the top of a module; `None` if functions do later, too."""
    changing = {
        each.name
        for each in module.body
        if isinstance(each, _FUNCTIONS) and any(_changes(node, name) for node in ast.walk(each))
    }
    found: list[ast.stmt] = []
    used: set[int] = set()
    for statement in module.body:
        if isinstance(statement, _DEFINITIONS):
            names = [each for item in statement.decorator_list for each in ast.walk(item)]
            applied = [each for each in names if _is_one_of(each, changing)]
            used |= {id(each) for each in applied}
            if applied:
                found.append(statement)
            elif isinstance(statement, ast.ClassDef) and _any_changes(statement, name):
                return None
        elif _any_changes(statement, name):
            found.append(statement)
    for statement in module.body:
        for node in ast.walk(statement):
            is_later = _is_one_of(node, changing) and id(node) not in used
            if is_later or (isinstance(node, ast.Global) and name in node.names):
                return None
    return found


def _any_changes(statement: ast.stmt, name: str) -> bool:
    return any(_changes(node, name) for node in ast.walk(statement))


def _changes(node: ast.AST, name: str) -> bool:
    match node:
        case ast.Subscript(value=ast.Name(id=found)):
            return found == name and not isinstance(node.ctx, ast.Load)
        case ast.Call(func=ast.Attribute(value=ast.Name(id=found), attr=method)):
            return found == name and method in CHANGING
        case ast.AugAssign(target=ast.Name(id=found)):
            return found == name
    return False


def _is_one_of(node: ast.AST, names: set[str]) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name) and node.id in names
