"""Takes a snapshot of a system: reads what its files and the sources of its behaviours say now."""

from __future__ import annotations

import ast
import hashlib
from typing import TYPE_CHECKING

from composer.confidential import hidden_values
from composer.interfaces.search_paths import extend_processes
from composer.language.bindings import system_bindings
from composer.language.parameter_files import read_given_file
from composer.planning.class_code import find_class_code
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
            module = context.modules.find(behaviour.module)
            source = None
            if not isinstance(module, MissingModule):
                source = module.find_function(behaviour.function)
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
