"""Takes a snapshot of a system: reads what its files and the sources of its behaviours say now."""

from __future__ import annotations

import ast
import hashlib
from typing import TYPE_CHECKING

from composer.confidential import hidden_values
from composer.interfaces.search_paths import extend_processes
from composer.language.bindings import system_bindings
from composer.language.parameter_files import read_given_file
from composer.planning.snapshot import Snapshot
from composer.python_source.module_finder import MissingModule
from composer.python_source.modules import ModuleSource

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.language.specs import ComponentSpec, NodeSpec, ParameterFileSpec
    from composer.python_source.module_finder import ModuleFinder
    from composer.ros_parameters.file_reader import ParameterEntry
    from composer.ros_parameters.overrides import MergedFiles

_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_IMPORTS = (ast.Import, ast.ImportFrom)
# A value of these is the same however often the module is executed, and nothing changes it.
_FIXED = (
    *(ast.Constant, ast.UnaryOp, ast.BinOp, ast.Tuple, ast.Name, ast.Attribute),
    *(ast.operator, ast.unaryop, ast.expr_context),
)
_SEES_ALL = {'globals', 'exec', 'eval', 'vars', '__import__', 'setattr', 'delattr'}


def take_snapshot(context: CheckContext, prefixes: Sequence[Path] = ()) -> Snapshot:
    """Return what a system is compared by; everything is read now.

    Args:
        prefixes: Where the interface packages are that were built for the system.
    """
    spec = extend_processes(context.spec, prefixes)
    sources = _Sources(context.modules)
    nodes = [*spec.nodes.values()]
    behaviours = [each.behaviour for each in system_bindings(spec)]
    modules = {each.module for each in behaviours}
    definitions = {
        (package.package, name): text
        for package in context.interfaces.definitions or ()
        if package.package in context.interfaces.folders
        for name, text in package.sources.items()
    }
    reachable = sources.reachable(modules)
    return Snapshot(
        spec,
        context.system.positions,
        {name: sources.digest(name) for name in reachable},
        {name: sources.text(name) for name in reachable},
        definitions,
        _read_overrides([*nodes, *spec.components]),
        tuple(map(str, prefixes)),
        frozenset(_find_generators(context)),
        read_at_start=frozenset(each.span for each in context.system.start.found),
        hidden=hidden_values(),
        classes={
            f'{each.module}:{each.class_name}': sources.class_digest(each.module, each.class_name)
            for each in behaviours
            if each.class_name
        },
    )


def _find_generators(context: CheckContext) -> Iterator[str]:
    for node in context.spec.nodes.values():
        for timer in node.timers.values():
            if (behaviour := timer.behaviour) is None:
                continue
            source = context.modules.find_function(behaviour.module, behaviour.function)
            if source is not None and source.kind is not None and source.kind.is_generator:
                yield behaviour.name


class _Sources:
    """Digests of modules, each read once."""

    def __init__(self, finder: ModuleFinder) -> None:
        self._finder = finder
        self._imported: dict[str, tuple[str, ...]] = {}

    def reachable(self, names: Iterable[str]) -> list[str]:
        """Return modules and all of the project that they import, at first or second hand."""
        found = dict.fromkeys(names)
        pending = list(found)
        while pending:
            new = [each for each in self._imports(pending.pop()) if each not in found]
            found |= dict.fromkeys(new)
            pending += new
        return sorted(found)

    def digest(self, name: str) -> str:
        """Return the digest of a module and of those of the project that it imports."""
        digest = hashlib.sha256()
        for each in self.reachable([name]):
            digest.update(f'{each}\0{self.text(each)}\0'.encode(errors='surrogatepass'))
        return digest.hexdigest()

    def class_digest(self, name: str, class_name: str) -> str:
        """Return the digest of a class and of what it uses; that of its module if in doubt."""
        module = self._finder.find(name)
        code = find_class_code(self.text(name), class_name)
        if code is None or isinstance(module, MissingModule):
            return self.digest(name)
        digest = hashlib.sha256()
        for statement in code:
            digest.update(f'{ast.dump(statement)}\0'.encode(errors='surrogatepass'))
        imports = [
            each
            for statement in code
            for each in ast.walk(statement)
            if isinstance(each, ast.Import | ast.ImportFrom)
        ]
        for each in dict.fromkeys(_names_imported(name, module, imports)):
            if each != name and self._is_reloaded(each) and self._finder.has(each):
                digest.update(f'{each}\0{self.digest(each)}\0'.encode())
        return digest.hexdigest()

    def text(self, name: str) -> str:
        """Return the source of a module."""
        module = self._finder.find(name)
        if isinstance(module, ModuleSource) and module.syntax_error and not module.lines:
            # It cannot be read, and an import of it has to fail.
            return f'raise ImportError({module.syntax_error!r})\n'
        if isinstance(module, MissingModule) or module.path is None or module.unread:
            # An import finds it as Python does.
            return ''
        return '\n'.join(module.lines) + '\n'

    def _imports(self, name: str) -> tuple[str, ...]:
        if name not in self._imported:
            module = self._finder.find(name)
            read = (
                ()
                if isinstance(module, MissingModule)
                else _names_imported(name, module, module.import_statements)
            )
            self._imported[name] = tuple(
                each
                for each in dict.fromkeys(read)
                if self._is_reloaded(each) and self._finder.has(each)
            )
        return self._imported[name]

    def _is_reloaded(self, name: str) -> bool:
        # Composer runs, and stays as it is, also in its own project.
        return name.partition('.')[0] != 'composer' and self._finder.is_of_project(name)


def _names_imported(
    name: str, module: ModuleSource, statements: Iterable[ast.Import | ast.ImportFrom]
) -> Iterator[str]:
    """Yield what statements of a module import; of `from a import b` both `a` and `a.b`."""
    is_package = module.path is not None and module.path.name == '__init__.py'
    package = name.split('.') if is_package else name.split('.')[:-1]
    yield from ('.'.join(package[:depth]) for depth in range(1, len(package) + 1))
    for node in statements:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
            continue
        base = package[: len(package) - node.level + 1] if node.level else []
        parts = [*base, *(node.module.split('.') if node.module else ())]
        yield '.'.join(parts)
        yield from ('.'.join([*parts, alias.name]) for alias in node.names)


def _read_overrides(
    nodes: Sequence[NodeSpec | ComponentSpec],
) -> dict[str, Mapping[str, ParameterEntry]]:
    if not any(node.parameter_files for node in nodes):
        return {}
    # Most systems have no parameter files.
    from composer.ros_parameters.overrides import MergedFiles

    merged: dict[tuple[ParameterFileSpec, ...], MergedFiles] = {}
    overrides = {}
    for node in nodes:
        if files := node.parameter_files:
            if files not in merged:
                merged[files] = MergedFiles(map(read_given_file, files))
            overrides[node.full_name] = merged[files].find_overrides(node.full_name)
    return overrides


def find_class_code(source: str, name: str) -> list[ast.stmt] | None:
    """Return the statements of a module that a class depends on, the class among them.

    Returns:
        `None` if that cannot be told: if the class shares something with the rest of the module
            that may change, a class that is kept would have another one of it.
    """
    try:
        body = ast.parse(source).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
    parts = [(statement, _bound(statement), _used(statement)) for statement in body]
    every = set().union(*(used for _, _, used in parts), *(bound for _, bound, _ in parts))
    if every & _SEES_ALL or '*' in every:
        return None
    wanted, chosen, rest = {name}, list[ast.stmt](), parts
    while True:
        more = [part for part in rest if part[1] & wanted or _acts_on(part, wanted)]
        if not more:
            break
        chosen += [statement for statement, _, _ in more]
        wanted = wanted.union(*(bound | used for _, bound, used in more))
        rest = [part for part in rest if part not in more]
    assigned = {
        each
        for node in ast.walk(ast.Module(body, []))
        if isinstance(node, ast.Global)
        for each in node.names
    }
    is_shared = bool(assigned & wanted) or any(name in used for _, _, used in rest)
    return None if is_shared or not _are_fixed(chosen) else chosen


def _acts_on(part: tuple[ast.stmt, set[str], set[str]], names: set[str]) -> bool:
    """Return whether a statement may do something with these names when it is executed."""
    statement, _, used = part
    return not isinstance(statement, (*_DEFINITIONS, ast.Assign, ast.AnnAssign)) and bool(
        used & names
    )


def _are_fixed(statements: Iterable[ast.stmt]) -> bool:
    return all(map(_is_fixed, statements))


def _is_fixed(statement: ast.stmt) -> bool:
    if isinstance(statement, ast.If):
        return _are_fixed([*statement.body, *statement.orelse])
    if isinstance(statement, ast.Assign | ast.AnnAssign):
        value = statement.value
        return value is None or all(isinstance(each, _FIXED) for each in ast.walk(value))
    return isinstance(statement, (*_DEFINITIONS, *_IMPORTS))


def _bound(statement: ast.stmt) -> set[str]:
    """Return the names that a statement of a module may give a meaning."""
    if isinstance(statement, _DEFINITIONS):
        return {statement.name}
    bound = set()
    for node in ast.walk(statement):
        if isinstance(node, _DEFINITIONS):
            bound.add(node.name)
        elif isinstance(node, _IMPORTS):
            bound |= {each.asname or each.name.partition('.')[0] for each in node.names}
        elif isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
            bound.add(node.id)
    return bound


def _used(statement: ast.stmt) -> set[str]:
    return {node.id for node in ast.walk(statement) if isinstance(node, ast.Name)}
