"""The modules of a project that its behaviours are in, and those that these import."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.language.bindings import node_bindings
from composer.python_source.module_finder import MissingModule, project_search_path
from composer.python_source.syntax import imported_modules
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.language.specs import NodeSpec
    from composer.python_source.modules import ModuleSource

# A project with more modules than these is checked in part.
_MOST_MODULES = 300


@record
class ProjectModule:
    """A module of the project, with the dotted names that may be modules which it imports."""

    name: str
    source: ModuleSource
    tree: ast.Module
    imports: tuple[str, ...]

    @property
    def path(self) -> str:
        """Its path in a folder of modules."""
        inner = self.name.replace('.', '/')
        return f'{inner}/__init__.py' if self.source.is_package else f'{inner}.py'


def all_nodes(context: CheckContext) -> list[NodeSpec]:
    """Return the nodes of a system, with those and all of them that is left out this time."""
    unused = context.system.unused
    return [*{**context.spec.nodes, **(unused.nodes if unused else {})}.values()]


def find_project_modules(context: CheckContext) -> dict[str, ProjectModule]:
    """Return the modules of behaviours in the project, with those that they import, by name."""
    roots = project_search_path(context.system.files)
    names = [
        binding.behaviour.module for node in all_nodes(context) for binding in node_bindings(node)
    ]
    found: dict[str, ProjectModule] = {}
    pending = list(dict.fromkeys(reversed(names)))
    while pending and len(found) < _MOST_MODULES:
        name = pending.pop()
        if name in found or not name or name.partition('.')[0] == 'composer':
            continue
        module = _read(context, name, roots)
        if module is not None:
            found[name] = module
            pending += module.imports
            pending.append(name.rpartition('.')[0])
    return found


def reach_of(node: NodeSpec, modules: Mapping[str, ProjectModule]) -> set[str]:
    """Return the names of the modules that the behaviours of a node are in, or import."""
    reached: set[str] = set()
    pending = [binding.behaviour.module for binding in node_bindings(node)]
    while pending:
        name = pending.pop()
        if name in modules and name not in reached:
            reached.add(name)
            pending += modules[name].imports
    return reached


def _read(context: CheckContext, name: str, roots: list[Path]) -> ProjectModule | None:
    source = context.modules.find(name)
    if isinstance(source, MissingModule) or source.path is None or source.content is None:
        return None
    tree = ast.Module([*source.body], [])
    imports: list[str] = []
    for node in source.import_statements:
        imports += imported_modules(node, name, is_package=source.is_package)
    module = ProjectModule(name, source, tree, tuple(dict.fromkeys(imports)))
    return module if any(root / module.path == source.path for root in roots) else None
