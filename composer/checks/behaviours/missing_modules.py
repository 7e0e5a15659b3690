"""The modules of behaviours import only what there is.

Nothing is imported. Only imports that are run on no condition count: those at the top of a module,
and those with which a behaviour begins.
"""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
from dataclasses import dataclass, field
from itertools import takewhile
from typing import TYPE_CHECKING

from composer.diagnostics import diagnostic_at
from composer.python_source.module_finder import MissingModule
from composer.python_source.modules import ModuleSource
from composer.python_source.syntax import (
    home_of,
)
from composer.records import record
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.interfaces.catalogue import InterfaceKind
    from composer.language.bindings import Binding

_KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')
_RULE = 'missing-module'
_Import = ast.Import | ast.ImportFrom
# A module with one of these may find modules, or make some, where nobody knows.
_CHANGES_THE_SEARCH = re.compile(
    r'\bsys\.(path|modules|meta_path)\b|\bpath\.(append|extend|insert)\(|\baddsitedir\b|__path__'
)
# Each is read as a whole, and a small part of a large project is enough for a system.
_MOST_MODULES = 50
# Statements after which a function goes on in any case.
_PLAIN = (ast.Import, ast.ImportFrom, ast.Expr, ast.Assign, ast.AnnAssign)


def check_missing_modules(context: CheckContext) -> Iterator[Diagnostic]:
    """Check the imports of the modules of behaviours, and of what these import of the project."""
    walk = _Walk(context)
    for binding in context.all_bindings():
        if not context.was_dropped(binding.behaviour.path):
            walk.visit(binding.behaviour.module, binding)
            walk.visit_function(binding)
    modules = [each.source for each in walk.importers]
    if not any(_CHANGES_THE_SEARCH.search('\n'.join(module.lines)) for module in modules):
        yield from walk.findings


@record
class _Importer:
    """A module with an import, and the first behaviour that needs it."""

    name: str
    source: ModuleSource
    binding: Binding


@dataclass(slots=True)
class _Walk:
    """Follows the imports of a project, each module once."""

    context: CheckContext
    findings: list[Diagnostic] = field(default_factory=list)
    importers: list[_Importer] = field(default_factory=list)
    _visited: set[str] = field(default_factory=set)

    def visit(self, name: str, binding: Binding) -> None:
        """Check the imports of a module of the project, and of the packages that it is in."""
        pending = [name]
        while pending:
            each = pending.pop()
            if each in self._visited:
                continue
            self._visited.add(each)
            if len(self.importers) >= _MOST_MODULES or not self._is_of_project(each):
                continue
            pending += [each.rpartition('.')[0]] if '.' in each else []
            module = self.context.modules.find(each)
            if isinstance(module, ModuleSource) and module.path is not None:
                importer = _Importer(each, module, binding)
                self.importers.append(importer)
                for statement in module.body:
                    if isinstance(statement, _Import):
                        pending += self._check(statement, importer)

    def visit_function(self, binding: Binding) -> None:
        """Check the imports with which a behaviour begins."""
        behaviour = binding.behaviour
        module = self.context.modules.find(behaviour.module)
        if isinstance(module, MissingModule) or behaviour.name in self._visited:
            return
        self._visited.add(behaviour.name)
        function = module.find_function(behaviour.function)
        body = function.definition.body if function and function.definition else ()
        for statement in takewhile(lambda each: isinstance(each, _PLAIN), body):
            if isinstance(statement, _Import):
                importer = _Importer(behaviour.module, module, binding)
                for name in self._check(statement, importer):
                    self.visit(name, binding)

    def _check(self, statement: _Import, importer: _Importer) -> list[str]:
        """Check an import; return the modules that it imports."""
        if isinstance(statement, ast.Import):
            for alias in statement.names:
                place = importer.source.span_of(alias, alias.name)
                self._check_module(alias.name, importer, place)
            return [alias.name for alias in statement.names]
        written = '.' * statement.level + (statement.module or '')
        place = importer.source.place_of(statement.lineno).narrowed_to(written, first=True)
        home = home_of(statement, importer.name, is_package=importer.source.is_package)
        if not home:
            message = f"'{importer.name}' is in no package that '{'.' * statement.level}' means"
            self._report(message, 'import it by its full name', importer, place)
            return []
        if not self._check_module(home, importer, place):
            return []
        aliases = [each for each in statement.names if each.name != '*']
        for alias in aliases:
            if self._is_of_project(home) and not self._is_of_interfaces(home):
                self._check_member(home, alias, importer)
        return [home, *(f'{home}.{alias.name}' for alias in aliases)]

    def _check_module(self, name: str, importer: _Importer, place: Span) -> bool:
        """Check that a module exists; return whether it does."""
        modules = self.context.modules
        # Those of the project may be gone since a running system has loaded them.
        is_loaded = name in sys.modules and not self._is_of_project(name)
        if is_loaded or name in sys.stdlib_module_names:
            return True
        if modules.has(name):
            return True
        if self._is_of_interfaces(name):
            # What is declared may be built only later.
            kind = name.split('.')[1] if '.' in name else ''
            if kind and kind not in _KINDS:
                help_text = did_you_mean(find_nearest(kind, _KINDS))
                self._report(f"there is no module '{name}'", help_text, importer, place)
            return True
        missing = modules.find_missing(name)
        if missing is not None and self._is_certain(missing.missing):
            otherwise = 'correct its name, or install the package that has it'
            help_text = did_you_mean(missing.nearest, otherwise)
            self._report(f"there is no module '{missing.missing}'", help_text, importer, place)
        return False

    def _is_certain(self, missing: str) -> bool:
        """Return whether a module is missing wherever the system can run."""
        top, _, inner = missing.partition('.')
        modules = self.context.modules
        if inner and self._is_of_project(top):
            return True
        if inner:
            # Packages that are installed may make their modules themselves.
            is_of_python = top in sys.stdlib_module_names
            return is_of_python and modules.is_package(missing.rpartition('.')[0])
        # A Python without ROS cannot run the system: another one has what it needs.
        return bool(importlib.util.find_spec('rclpy'))

    def _is_of_project(self, name: str) -> bool:
        # Where Composer is developed, it is one itself.
        is_composer = name.partition('.')[0] == 'composer'
        return not is_composer and self.context.modules.is_of_project(name)

    def _is_of_interfaces(self, name: str) -> bool:
        top = name.partition('.')[0]
        return top in self.context.spec.interfaces or top in self.context.catalogue.packages()

    def _check_member(self, home: str, alias: ast.alias, importer: _Importer) -> None:
        """Check a name that is imported from a module or package of the project."""
        source, name = self.context.modules.find(home), f'{home}.{alias.name}'
        if not isinstance(source, ModuleSource) or self.context.modules.has(name):
            return
        place, top = importer.source.span_of(alias, alias.name), source.top
        bound = {*top.statements, *top.stored_again}
        if source.path is None:
            missing = self.context.modules.find_missing(name)
            help_text = did_you_mean(missing.nearest if missing else None)
            self._report(f"there is no module '{name}'", help_text, importer, place)
        elif not (
            source.syntax_error
            or (source.is_open or top.is_dynamic)
            or (alias.name in bound or alias.name.startswith('__'))
        ):
            known = {*source.functions, *source.constants} or bound
            help_text = suggest(alias.name, known, 'it has')
            self._report(f"{home} has no '{alias.name}'", help_text, importer, place)

    def _report(
        self, message: str, help_text: str | None, importer: _Importer, place: Span
    ) -> None:
        behaviour = importer.binding.behaviour
        where = f"'{behaviour.name}' cannot be imported without it"
        related = [self.context.related_value(behaviour.path, where)]
        self.findings.append(diagnostic_at(place, _RULE, message, help=help_text, related=related))
