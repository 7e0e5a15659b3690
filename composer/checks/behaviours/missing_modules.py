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
from composer.python_source.modules import ModuleSource
from composer.python_source.syntax import (
    bound_names,
    home_of,
    imported_modules,
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
    from composer.language.specs import BehaviourSpec

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
    importers = _find_importers(context)
    if any(_CHANGES_THE_SEARCH.search('\n'.join(each.source.lines)) for each in importers):
        return
    imports, library = _Imports(context), _Library(context)
    for importer in importers:
        behaviour = importer.behaviour
        where = f"'{behaviour.name}' is in this module, or imports it"
        related = [context.related_value(behaviour.path, where)]
        for each in (*imports.check(importer), *library.find_missing(importer.source)):
            yield diagnostic_at(
                each.place, each.rule, each.message, help=each.help, related=related
            )


@record
class _Importer:
    """A module of the project, its imports on no condition, and the first behaviour with it."""

    name: str
    source: ModuleSource
    imports: list[_Import]
    behaviour: BehaviourSpec


def _find_importers(context: CheckContext) -> list[_Importer]:
    """Follow the imports of the modules of behaviours, each once."""
    behaviours: dict[str, dict[str, BehaviourSpec]] = {}
    for binding in context.all_bindings():
        behaviour = binding.behaviour
        if not context.was_dropped(behaviour.path):
            behaviours.setdefault(behaviour.module, {}).setdefault(behaviour.function, behaviour)
    found: dict[str, _Importer] = {}
    pending = [(name, next(iter(of.values()))) for name, of in reversed(behaviours.items())]
    while pending and len(found) < _MOST_MODULES:
        name, behaviour = pending.pop()
        if not name or name in found or not _is_of_project(context, name):
            continue
        pending.append((name.rpartition('.')[0], behaviour))
        source = context.modules.find(name)
        if isinstance(source, ModuleSource) and source.path is not None:
            imports = _certain_imports(source, behaviours.get(name, ()))
            found[name] = _Importer(name, source, imports, behaviour)
            for each in imports:
                modules = imported_modules(each, name, is_package=source.is_package)
                pending += [(module, behaviour) for module in modules]
    return [*found.values()]


def _certain_imports(module: ModuleSource, functions: Iterable[str]) -> list[_Import]:
    """Return the imports at the top of a module, and those with which functions begin."""
    statements = [*module.body]
    for name in functions:
        function = module.find_function(name)
        body = function.definition.body if function and function.definition else ()
        statements += takewhile(lambda each: isinstance(each, _PLAIN), body)
    return [each for each in statements if isinstance(each, _Import)]


def _is_of_project(context: CheckContext, name: str) -> bool:
    # Where Composer is developed, it is one itself.
    return name.partition('.')[0] != 'composer' and context.modules.is_of_project(name)


@record
class _Imports:
    """What there is to import."""

    context: CheckContext

    def check(self, importer: _Importer) -> Iterator[Problem]:
        """Check the imports of a module."""
        source = importer.source
        for statement in importer.imports:
            if isinstance(statement, ast.Import):
                for alias in statement.names:
                    yield from self._check_module(alias.name, source.span_of(alias, alias.name))
                continue
            dots = '.' * statement.level
            written = dots + (statement.module or '')
            place = source.place_of(statement.lineno).narrowed_to(written, first=True)
            home = home_of(statement, importer.name, is_package=source.is_package)
            if home:
                yield from self._check_module(home, place)
                yield from self._check_members(home, statement.names, source)
            else:
                message = f"'{importer.name}' is in no package that '{dots}' means"
                yield Problem(_RULE, message, place, 'import it by its full name')

    def _check_module(self, name: str, place: Span) -> Iterator[Problem]:
        """Check that a module exists."""
        missing = self.context.modules.find_missing(name)
        # Those of the project may be gone since a running system has loaded them.
        is_loaded = name in sys.modules and not _is_of_project(self.context, name)
        if missing is None or is_loaded or name in sys.stdlib_module_names:
            return
        wrong, advice = '', None
        if self._is_of_interfaces(name):
            # What is declared may be built only later.
            kind = name.partition('.')[2].partition('.')[0]
            if kind not in ('', *_KINDS):
                wrong, advice = name, did_you_mean(find_nearest(kind, _KINDS))
        elif self._is_certain(missing.missing):
            otherwise = 'correct its name, or install the package that has it'
            wrong, advice = missing.missing, did_you_mean(missing.nearest, otherwise)
        if wrong:
            yield Problem(_RULE, f"there is no module '{wrong}'", place, advice)

    def _is_certain(self, missing: str) -> bool:
        """Return whether a module is missing wherever the system can run."""
        top, _, inner = missing.partition('.')
        if not inner:
            # A Python without ROS cannot run the system: another one has what it needs.
            return bool(importlib.util.find_spec('rclpy'))
        if _is_of_project(self.context, top):
            return True
        # Packages that are installed may make their modules themselves.
        is_of_python = top in sys.stdlib_module_names
        return is_of_python and self.context.modules.is_package(missing.rpartition('.')[0])

    def _is_of_interfaces(self, name: str) -> bool:
        top = name.partition('.')[0]
        return top in self.context.spec.interfaces or top in self.context.catalogue.packages()

    def _check_members(
        self, home: str, names: list[ast.alias], importer: ModuleSource
    ) -> Iterator[Problem]:
        """Check names that are imported from a module or package of the project."""
        source, modules = self.context.modules.find(home), self.context.modules
        is_own = _is_of_project(self.context, home) and not self._is_of_interfaces(home)
        if not isinstance(source, ModuleSource) or not is_own or source.syntax_error:
            return
        bound = {*source.top.statements, *source.top.stored_again}
        known = {*source.functions, *source.constants} or bound
        is_open = source.is_open or source.top.is_dynamic
        for alias in names:
            name, place = alias.name, importer.span_of(alias, alias.name)
            if name == '*' or name.startswith('__'):
                continue
            if source.path is None:
                yield from self._check_module(f'{home}.{name}', place)
            elif not (is_open or name in bound or modules.has(f'{home}.{name}')):
                advice = suggest(name, known, 'it has')
                yield Problem(_RULE, f"{home} has no '{name}'", place, advice)


@dataclass(slots=True)
class _Library:
    """What the modules have that are not of the project, each read once."""

    context: CheckContext
    _texts: dict[str, str] = field(default_factory=dict)

    def find_missing(self, module: ModuleSource) -> Iterator[Problem]:
        """Yield the names that the code of a module uses, and that do not exist."""
        nodes = list_nodes(module.body)
        imports, asked = _imports_of(nodes), set(map(id, _asked_first(nodes)))
        attributes = [node for node in nodes if isinstance(node, ast.Attribute)]
        stored = {node.attr for node in attributes if isinstance(node.ctx, ast.Store)}
        used: list[tuple[str, str, ast.AST]] = []
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                used += [(node.module, alias.name, alias) for alias in node.names]
            elif isinstance(node, ast.Attribute) and node.attr not in stored:
                first, dot, rest = dotted_name(node.value).partition('.')
                used += (
                    [(imports[first] + dot + rest, node.attr, node)] if first in imports else []
                )
        for owner, name, place in used:
            rule = _RULE if isinstance(place, ast.alias) else 'unknown-attribute'
            problem = None if id(place) in asked else self._explain(owner, name, rule)
            if problem:
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
