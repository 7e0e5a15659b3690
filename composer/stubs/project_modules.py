"""The modules of a project that its behaviours are in, and those that these import."""

from __future__ import annotations

import ast
from functools import lru_cache
from typing import TYPE_CHECKING

from composer.language.bindings import node_bindings
from composer.python_source.module_finder import MissingModule, project_search_path
from composer.python_source.syntax import UnreadModuleError, parse_source
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.language.specs import NodeSpec
    from composer.python_source.modules import ModuleSource

# A project with more modules than these is checked in part.
_MOST_MODULES = 300


@record
class ProjectModule:
    """A module of the project.

    Attributes:
        name: Its dotted name.
        is_package: Whether it is the `__init__.py` of a package.
        packages: The interface packages and others that it imports from, by their first names.
    """

    name: str
    source: ModuleSource
    tree: ast.Module
    is_package: bool
    imports: tuple[str, ...]

    @property
    def path(self) -> str:
        """Its path in a folder of modules."""
        inner = self.name.replace('.', '/')
        return f'{inner}/__init__.py' if self.is_package else f'{inner}.py'


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
    is_package = source.path.name == '__init__.py'
    inner = name.replace('.', '/')
    wanted = f'{inner}/__init__.py' if is_package else f'{inner}.py'
    if not any(root / wanted == source.path for root in roots):
        return None
    try:
        tree = _parse(source.content, source.path)
    except (SyntaxError, ValueError, RecursionError, MemoryError, UnreadModuleError):
        return None
    imports = tuple(dict.fromkeys(_imported(tree, name, is_package=is_package)))
    return ProjectModule(name, source, tree, is_package, imports)


@lru_cache(_MOST_MODULES)
def _parse(content: bytes, path: Path) -> ast.Module:
    return parse_source(content, path)


def _imported(tree: ast.Module, name: str, *, is_package: bool) -> Iterator[str]:
    """Yield the dotted names that may be modules which a module imports."""
    package = name.split('.') if is_package else name.split('.')[:-1]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            start = '.'.join([*above, *filter(None, [node.module])])
            yield start
            yield from (f'{start}.{alias.name}' for alias in node.names)
