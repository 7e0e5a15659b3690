"""Names that modules of Python, of installed packages and of messages do not have.

All code of a module is looked at, wherever it stands. Nothing is imported: modules of Python that
are loaded already are asked, and of others, a name is missing if it is no word of their source.
"""

from __future__ import annotations

import ast
import re
import sys
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING

from composer.interfaces.message_types import PARTS, in_python
from composer.node_uses.reading import Problem
from composer.python_source.annotations import dotted_name, find_interface
from composer.python_source.modules import ModuleSource
from composer.python_source.syntax import bound_names, imported_names, list_nodes, words_in
from composer.spelling import find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.interfaces.catalogue import InterfaceKind

KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')
# What a test mentions that asks what there is.
_ASKING = {'hasattr', 'version_info', '__version__', 'platform', 'implementation'}
_CATCHING = {'AttributeError', 'ImportError', 'ModuleNotFoundError', 'NameError', 'Exception'}
# A module with one of these words may have names that are not in its source.
_OPEN = re.compile(
    r'^def __getattr__|import \*|\bglobals\(|sys\.modules\[__name__\]', re.MULTILINE
)
_WORD = re.compile(r'\b[A-Za-z]\w*')
_OF_CLASSES = {'get_fields_and_field_types', 'SLOT_TYPES', 'Event', *PARTS}


@dataclass(slots=True)
class Library:
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
        for node in nodes:
            names: list[tuple[str, str, ast.AST]] = []
            rule = 'missing-module' if isinstance(node, ast.ImportFrom) else 'unknown-attribute'
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [(node.module, alias.name, alias) for alias in node.names]
            elif isinstance(node, ast.Attribute) and node.attr not in stored:
                first, dot, rest = dotted_name(node.value).partition('.')
                if first in imports:
                    names = [(imports[first] + dot + rest, node.attr, node)]
            for owner, name, place in names if id(node) not in asked else ():
                own_rule, found = self._explain(owner, name)
                if found is not None:
                    yield Problem(
                        own_rule or rule, found[0], module.span_of(place, name), found[1]
                    )

    def _explain(self, owner: str, name: str) -> tuple[str, tuple[str, str | None] | None]:
        """Return the rule that a name breaks for certain, if it has one, with what is wrong."""
        interface, package = find_interface(owner), owner.partition('.')[0]
        if name.startswith('_') or name == '*':
            return '', None
        if interface is not None:
            return 'unknown-field', self._missing_in_class(interface, name)
        if package in self.context.catalogue.packages():
            return 'missing-module', self._missing_in_package(owner, name)
        if self.context.modules.is_of_project(package) and package != 'composer':
            return '', None
        return '', self._missing_in_module(owner, name)

    def _missing_in_class(self, interface: str, name: str) -> tuple[str, str | None] | None:
        types = self.context.types
        description = types.describe(interface)
        if description is None or name in _OF_CLASSES or types.may_have_constant(interface, name):
            return None
        if description.field(name) is not None:
            return None
        known = types.constants(interface)
        return f"{in_python(interface)} has no constant '{name}'", suggest(name, known, 'it has')

    def _missing_in_package(self, owner: str, name: str) -> tuple[str, str | None] | None:
        """Return what is wrong with a name of `std_msgs`, or of `std_msgs.msg`."""
        catalogue = self.context.catalogue
        package, _, kind = owner.partition('.')
        kinds = [each for each in KINDS if catalogue.names(each, package)]
        full = [f'{package}/{each}/{name}' for each in KINDS]
        elsewhere = [f'{other}/{kind}/{name}' for other in catalogue.packages()]
        if not kind:
            if name in KINDS or self.context.modules.has(f'{owner}.{name}') or not kinds:
                return None
            found = [each.rpartition('/')[0] for each in full if catalogue.has(each)]
            known: Iterable[str] = kinds
        elif kind in KINDS and name[:1].isupper():
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
        if nearest is None and not find_spec('rclpy'):
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
