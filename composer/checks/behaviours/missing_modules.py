"""The modules of behaviours import, and use of modules and messages, only what there is.

Nothing is imported. Only imports that are run on no condition count: those at the top of a module,
and those with which a behaviour begins. Of all code of a module, the names are looked up: modules
of Python that are loaded already are asked, and of others, a name is missing if it is no word of
their source.
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
from composer.interfaces.message_types import PARTS, in_python
from composer.node_uses.reading import Problem
from composer.python_source.annotations import dotted_name, find_interface
from composer.python_source.module_finder import MissingModule
from composer.python_source.modules import ModuleSource
from composer.python_source.syntax import (
    bound_names,
    home_of,
    imported_names,
    list_nodes,
    words_in,
)
from composer.records import record
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.interfaces.catalogue import InterfaceKind
    from composer.language.bindings import Binding

_KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')
# What a test mentions that asks what there is.
_ASKING = {'hasattr', 'version_info', '__version__', 'platform', 'implementation'}
_CATCHING = {'AttributeError', 'ImportError', 'ModuleNotFoundError', 'NameError', 'Exception'}
# A module with one of these words may have names that are not in its source.
_OPEN = re.compile(
    r'^def __getattr__|import \*|\bglobals\(|sys\.modules\[__name__\]', re.MULTILINE
)
_WORD = re.compile(r'\b[A-Za-z]\w*')
_OF_CLASSES = {'get_fields_and_field_types', 'SLOT_TYPES', 'Event', *PARTS}
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
        library = _Library(context)
        for importer in walk.importers:
            for missing in library.find_missing(importer.source):
                where = f"'{importer.binding.behaviour.name}' is in this module, or imports it"
                related = [context.related_value(importer.binding.behaviour.path, where)]
                place, rule, advice = missing.place, missing.rule, missing.help
                yield diagnostic_at(place, rule, missing.message, help=advice, related=related)


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


@dataclass(slots=True)
class _Library:
    """What the modules have that are not of the project, each read once."""

    context: CheckContext
    _texts: dict[str, str] = field(default_factory=dict)

    def find_missing(self, module: ModuleSource) -> Iterator[Problem]:
        """Yield the names that the code of a module uses, and that do not exist."""
        nodes = list_nodes(module.body)
        imports = _imports_of(nodes)
        attributes = [node for node in nodes if isinstance(node, ast.Attribute)]
        stored = {node.attr for node in attributes if isinstance(node.ctx, ast.Store)}
        asked = set(map(id, _asked_first(nodes)))
        for node in (each for each in nodes if id(each) not in asked):
            names: list[tuple[str, str, ast.AST]] = []
            rule = 'unknown-attribute'
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                rule = _RULE
                names = [(node.module, alias.name, alias) for alias in node.names]
            elif isinstance(node, ast.Attribute) and node.attr not in stored:
                first, dot, rest = dotted_name(node.value).partition('.')
                if first in imports:
                    names = [(imports[first] + dot + rest, node.attr, node)]
            for owner, name, place in names:
                if problem := self._explain(owner, name, rule):
                    rule, message, advice = problem
                    yield Problem(rule, message, module.span_of(place, name), advice)

    def _explain(self, owner: str, name: str, rule: str) -> tuple[str, str, str | None] | None:
        """Return the rule that a name breaks for certain, if it does, and what is wrong."""
        interface, package = find_interface(owner), owner.partition('.')[0]
        problem: tuple[str, str | None] | None = None
        if name.startswith('_') or name == '*':
            return None
        if interface is not None:
            rule, problem = 'unknown-field', self._missing_in_class(interface, name)
        elif package in self.context.catalogue.packages():
            rule, problem = _RULE, self._missing_in_package(owner, name)
        elif package == 'composer' or not self.context.modules.is_of_project(package):
            problem = self._missing_in_module(owner, name)
        return (rule, *problem) if problem else None

    def _missing_in_class(self, interface: str, name: str) -> tuple[str, str | None] | None:
        types = self.context.types
        description = types.describe(interface)
        is_there = description is None or description.field(name) is not None
        if is_there or name in _OF_CLASSES or types.may_have_constant(interface, name):
            return None
        known = types.constants(interface)
        return f"{in_python(interface)} has no constant '{name}'", suggest(name, known, 'it has')

    def _missing_in_package(self, owner: str, name: str) -> tuple[str, str | None] | None:
        """Return what is wrong with a name of `std_msgs`, or of `std_msgs.msg`."""
        catalogue = self.context.catalogue
        package, _, kind = owner.partition('.')
        kinds = [each for each in _KINDS if catalogue.names(each, package)]
        full = [f'{package}/{each}/{name}' for each in _KINDS]
        elsewhere = [f'{other}/{kind}/{name}' for other in catalogue.packages()]
        if not kind:
            if name in _KINDS or self.context.modules.has(f'{owner}.{name}') or not kinds:
                return None
            found = [each.rpartition('/')[0] for each in full if catalogue.has(each)]
            known: Iterable[str] = kinds
        elif kind in _KINDS and name[:1].isupper():
            names = catalogue.names(kind, package)
            known = {each.rpartition('/')[2] for each in names}
            # The parts of services and actions are called `SetBool_Request` and the like.
            if name.partition('_')[0] in known:
                return None
            whole = f'{package}/{kind}/{name.partition("_")[0]}'
            if advice := self.context.interfaces.explain_left_out(whole):
                return f"'only:' of the package '{package}' leaves out '{name}'", advice
            found = [each for each in (*full, *elsewhere) if catalogue.has(each)]
        else:
            return None
        meant = f"did you mean '{found[0].replace('/', '.')}'?" if found else suggest(name, known)
        return f"{owner} has no '{name}'", meant

    def _missing_in_module(self, owner: str, name: str) -> tuple[str, str | None] | None:
        is_of_python = owner.partition('.')[0] in sys.stdlib_module_names
        loaded = _loaded(owner) if is_of_python else None
        modules = self.context.modules
        if loaded is not None:
            is_there, known = hasattr(loaded, name), dir(loaded)
        else:
            text = self._text_of(owner)
            is_there = not text or re.search(rf'\b{re.escape(name)}\b', text) is not None
            words = [] if is_there else _WORD.findall(text)
            known = [each for each in words if each[0].isupper() == name[0].isupper()]
        if is_there or (isinstance(loaded, type(sys) | None) and modules.has(f'{owner}.{name}')):
            return None
        nearest = find_nearest(name, known)
        if nearest is None and not importlib.util.find_spec('rclpy'):
            # The Python that runs the system may be another one, and have it.
            return None
        return f"{owner} has no '{name}'", suggest(name, known)

    def _text_of(self, name: str) -> str:
        """Return the source of a module, or of its stubs; empty if it does not tell all names."""
        if name not in self._texts:
            found = self.context.modules.find(name) if self.context.modules.has(name) else None
            path = found.path if isinstance(found, ModuleSource) else None
            text = ''
            if path is not None and path.suffix == '.py':
                stubs = path.with_suffix('.pyi')
                text = (stubs if stubs.is_file() else path).read_text(errors='replace')
            is_open = _OPEN.search(text) and name != 'composer'
            self._texts[name] = '' if is_open else text
        return self._texts[name]


def _loaded(full_name: str) -> object:
    """Return a module or class of Python; `None` if it is not loaded, or something else."""
    found: object = None
    for part in full_name.split('.'):
        within = sys.modules.get(part) if found is None else getattr(found, part, None)
        if not isinstance(within, type(sys) | type):
            return None
        found = within
    return found


def _imports_of(nodes: Iterable[ast.AST]) -> dict[str, str]:
    """Return the full names of what imports store, of names that nothing else stores."""
    found: dict[str, set[str]] = {}
    for node in nodes:
        names = dict(imported_names(node))
        for name in bound_names(node):
            found.setdefault(name, set()).add(names.get(name, ''))
    return {name: min(full) for name, full in found.items() if len(full) == 1 and min(full)}


def _asked_first(nodes: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yield what is read only where something has asked whether it is there."""
    for node in nodes:
        match node:
            case ast.Try() | ast.TryStar():
                types = [each.type for each in node.handlers]
                if None in types or words_in(*types) & _CATCHING:
                    yield from list_nodes(node.body)
            case ast.If() | ast.IfExp() | ast.While():
                if words_in(node.test) & _ASKING:
                    yield from ast.walk(node)
            case ast.BoolOp() if words_in(*node.values) & _ASKING:
                yield from ast.walk(node)
