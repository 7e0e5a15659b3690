"""Check the behaviours of a system with a type checker that is installed."""

from __future__ import annotations

import ast
import os
import re
import shutil
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import SourceFile, Span, diagnostic_at
from composer.interfaces.build.build_cache import find_cache
from composer.spelling import did_you_mean, find_nearest
from composer.stubs.annotated_copies import AnnotatedCopy, Annotator
from composer.stubs.field_types import SUPPORT
from composer.stubs.node_shapes import NodeShape, merge_shapes
from composer.stubs.node_stubs import write_nodes
from composer.stubs.project_modules import all_nodes, find_project_modules
from composer.stubs.received_values import find_received_values
from composer.stubs.relevant_reports import RelevantReports
from composer.stubs.system_stubs import (
    class_name,
    module_of,
    shapes_of,
    stand_ins,
    text_of,
    write_messages,
)
from composer.stubs.type_checkers import TypeChecker, run_type_checker

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import NodeSpec
    from composer.stubs.project_modules import ProjectModule
    from composer.stubs.type_checkers import TypeReport

_LITERAL = re.compile(r"Literal\['([^']*)'\]")
_TEXT = re.compile(r"""'([^']*)'|"([^"]*)\"""")
# A behaviour of more nodes than these has a class that is named after the first ones.
_MOST_NAMED = 3


@dataclass(slots=True)
class TypesCheck:
    """Writes stubs and annotated copies of behaviours, and has them checked."""

    checker: TypeChecker

    def __call__(self, context: CheckContext, found: list[Diagnostic]) -> Iterator[Diagnostic]:
        """Yield what the type checker finds where the other checks find nothing.

        Raises:
            TypeCheckerError: It does not work.
        """
        modules = find_project_modules(context)
        if not modules:
            return
        with _temporary_folder() as folder:
            stubs, copies = folder / 'stubs', folder / 'modules'
            classes = _Classes(module_of(context), shapes_of(context, modules), all_nodes(context))
            annotator = Annotator(find_received_values(context, modules), classes.of)
            written = {path: annotator.copy(module) for path, module in _by_path(modules)}
            files = dict(write_messages(context, modules))
            files |= classes.files()
            files |= stand_ins(context.spec.qos)
            _write(stubs, files)
            _write(copies, {path: copy.text for path, copy in written.items()})
            reports = run_type_checker(
                self.checker, copies, (copies, stubs), find_cache().parent / 'types'
            )
        names = _class_names(files) - _changed_classes(modules)
        if any('declare_parameter' in line for line in _lines(modules)):
            names = frozenset(name for name in names if not name.endswith('Parameters'))
        told = {
            span.place
            for each in found
            for span in (each.span, *(related.span for related in each.related))
            if span
        }
        packages = frozenset(path.partition('/')[0] for path in files)
        for path, copy in written.items():
            own = [report for report in reports if report.path == copies / path]
            relevant = RelevantReports(copy, names, packages)
            for finding in (_finding(copy, report) for report in relevant.select(own)):
                if finding.span and finding.span.place not in told:
                    yield finding


@dataclass(slots=True)
class _Classes:
    """The classes of nodes, and of nodes together that have a behaviour in common."""

    module: str
    shapes: dict[str, NodeShape]
    nodes: list[NodeSpec]
    _names: dict[NodeShape, str] | None = None

    def of(self, keys: Iterable[str]) -> tuple[str, str]:
        """Return the module and the name of the class of nodes, by their keys in the file."""
        if self._names is None:
            self._names = {}
        several = list(keys)
        shape = merge_shapes(self.shapes[key] for key in several)
        if shape not in self._names:
            name = 'Or'.join(map(class_name, several[:_MOST_NAMED]))
            taken = name in self._names.values()
            self._names[shape] = f'{name}_{len(self._names)}' if taken else name
        return f'{SUPPORT}.{self.module}', self._names[shape]

    def files(self) -> dict[str, str]:
        """Return the stub with the classes that were asked for, by its path."""
        classes = {name: shape for shape, name in (self._names or {}).items()}
        text = text_of(write_nodes(f'{SUPPORT}.{self.module}', classes, self.nodes))
        return {f'{SUPPORT}/{self.module}.pyi': text}


def _by_path(modules: dict[str, ProjectModule]) -> Iterator[tuple[str, ProjectModule]]:
    yield from ((module.path, module) for module in modules.values())


def _class_names(files: dict[str, str]) -> frozenset[str]:
    names: set[str] = set()
    for text in files.values():
        for line in text.splitlines():
            if line.startswith('class '):
                names.add(line.removeprefix('class ').partition('(')[0].partition(':')[0])
    return frozenset(names)


def _changed_classes(modules: dict[str, ProjectModule]) -> frozenset[str]:
    """Return the names of the classes to which the modules add attributes."""
    return frozenset(
        node.value.id
        for module in modules.values()
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and isinstance(node.value, ast.Name)
    )


def _lines(modules: dict[str, ProjectModule]) -> Iterator[str]:
    return (line for module in modules.values() for line in module.source.lines)


def _finding(copy: AnnotatedCopy, report: TypeReport) -> Diagnostic:
    source = _source_of(copy)
    column = copy.original_column(report.line, report.column)
    end = copy.original_column(report.line, report.end)
    span = Span(source, report.line, column, max(end - column, 1))
    return diagnostic_at(span, 'type-error', report.message, help=_nearest(span, report))


def _nearest(span: Span, report: TypeReport) -> str | None:
    """Return the declared name that a wrong one in the code may mean."""
    names = _LITERAL.findall(' '.join([report.message, *report.notes]))
    written = [a or b for a, b in _TEXT.findall(span.text)]
    declared = set(names) - set(written)
    if not written or written[0] in names[1:]:
        return None
    return did_you_mean(find_nearest(written[0], declared))


def _source_of(copy: AnnotatedCopy) -> SourceFile:
    return copy.module.source.place_of(1).source


def _write(folder: Path, files: dict[str, str]) -> None:
    for path, text in files.items():
        place = folder / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding='utf-8')


@contextmanager
def _temporary_folder() -> Iterator[Path]:
    folder = Path(os.path.realpath(tempfile.mkdtemp(prefix='composer-types-')))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
