"""Have the behaviours of a system checked by pyrefly: stubs, annotated copies, and findings."""

from __future__ import annotations

import ast
import itertools
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.python_source.syntax import words_in
from composer.stubs.checking.annotated_copies import (
    Annotator,
    find_certain_values,
    find_received_values,
)
from composer.stubs.checking.type_checker import run_type_checker, version_of
from composer.stubs.checking.type_findings import OwnCode, TypeFindings
from composer.stubs.message_stubs import SUPPORT
from composer.stubs.node_stubs import NodeShape, merge_shapes, write_nodes
from composer.stubs.project_modules import all_nodes
from composer.stubs.stored_types import find_stored_types, types_kept
from composer.stubs.system_stubs import (
    class_name,
    module_of,
    shapes_of,
    stand_ins,
    text_of,
    write_messages,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import NodeSpec
    from composer.stubs.checking.annotated_copies import AnnotatedCopy
    from composer.stubs.checking.type_checker import TypeReport
    from composer.stubs.project_modules import ProjectModule

_CLASS = re.compile(r'^class (\w+)', re.MULTILINE)
_OF_ROS = re.compile(r'^(composer|rclpy)\.|\.(msg|srv|action)\.')


def find_type_errors(
    program: Path, context: CheckContext, modules: dict[str, ProjectModule]
) -> tuple[str, list[tuple[Diagnostic, range]]]:
    """Return the version of pyrefly, and findings with the lines of the statements they are in.

    Raises:
        TypeCheckerError: Pyrefly does not work.
    """
    module = f'{SUPPORT}.{module_of(context)}'
    nodes = {node.key: node for node in all_nodes(context)}
    functions = find_received_values(context, modules)
    stored = find_stored_types(context, modules, find_certain_values(functions))
    classes = _Classes(module, shapes_of(context, modules, stored), nodes)
    annotator = Annotator(functions, classes.of, types_kept(modules, stored))
    copies = {module.path: annotator.copy(module) for module in modules.values()}
    files = dict(write_messages(context, modules))
    shapes = classes.shapes_by_name()
    files[f'{module.replace(".", "/")}.pyi'] = text_of(write_nodes(module, shapes))
    files |= stand_ins(context.spec.qos)
    version, reports = version_of(program), _run(program, copies, files)
    findings = TypeFindings(
        context,
        classes.nodes_by_name,
        shapes,
        annotator.functions,
        _message_classes(files),
        frozenset(modules),
        _read_own_code(modules, annotator.kept),
    )
    asked = {path: findings.ask(copy, reports[path]) for path, copy in copies.items()}
    if any(asked.values()):
        revealing = {path: copy.revealing(asked[path]) for path, copy in copies.items()}
        for path, several in _run(program, revealing, files).items():
            findings.learn(revealing[path], asked[path], several)
    found = (findings.explain_all(copy, reports[path]) for path, copy in copies.items())
    return version, [*itertools.chain.from_iterable(found)]


def _run(
    program: Path, copies: Mapping[str, AnnotatedCopy], stubs: Mapping[str, str]
) -> dict[str, list[TypeReport]]:
    """Return what the type checker reports of each copy."""
    texts = {path: copy.text for path, copy in copies.items()}
    reports: dict[str, list[TypeReport]] = {path: [] for path in copies}
    for report in run_type_checker(program, texts, stubs):
        reports[report.path].append(report)
    return reports


@dataclass(slots=True)
class _Classes:
    """The classes of nodes, and of nodes together that have a behaviour in common."""

    module: str
    shapes: dict[str, NodeShape]
    nodes: dict[str, NodeSpec]
    _names: dict[NodeShape, str] = field(default_factory=dict)
    nodes_by_name: dict[str, dict[str, NodeSpec]] = field(default_factory=dict)

    def of(self, keys: Iterable[str]) -> tuple[str, str]:
        """Return the module and the name of the class of nodes, by their keys in the file."""
        several = list(keys)
        shape = merge_shapes(self.shapes[key] for key in several)
        name = 'Or'.join(map(class_name, several))
        if name in self._names.values():
            name = f'{name}_{len(self._names)}'
        name = self._names.setdefault(shape, name)
        nodes = self.nodes_by_name.setdefault(name, {})
        nodes.update((key, self.nodes[key]) for key in several)
        return self.module, name

    def shapes_by_name(self) -> dict[str, NodeShape]:
        """Return the shape of each class that was asked for."""
        return {name: shape for shape, name in self._names.items()}


def _message_classes(files: dict[str, str]) -> dict[str, str]:
    """Return the full names of messages by their classes; empty if several have one name."""
    names: dict[str, str] = {}
    for path, text in files.items():
        package, kind, *rest = path.split('/')
        if rest and kind in ('msg', 'srv', 'action'):
            for name in _CLASS.findall(text):
                if kind != 'msg' and '_' not in name:
                    # The type itself, which holds its messages.
                    continue
                names[name] = '' if name in names else f'{package}/{kind}/{name}'
    return names


# Decorators that add no attributes.
_PLAIN_DECORATORS = frozenset({'dataclass', 'dataclasses', 'final', 'total_ordering', 'unique'})


def _read_own_code(modules: Mapping[str, ProjectModule], kept: Collection[str]) -> OwnCode:
    """Return what is known of a project's own code.

    Args:
        kept: The attributes that are of one type by all that is stored there.
    """
    names, stored, annotated, rebound = set[str](), Counter[str](), set[str](), set[str]()
    classes: list[ast.ClassDef] = []
    for module in modules.values():
        imports = module.source.imports.items()
        names |= {name for name, full_name in imports if not _OF_ROS.search(full_name)}
        stored += module.source.top.stored_attributes
        for node in ast.walk(module.tree):
            match node:
                case ast.AugAssign(target=ast.Attribute(attr=name)):
                    # It changes what is there already.
                    stored[name] -= 1
                case ast.ClassDef():
                    classes.append(node)
                case ast.Attribute(value=ast.Name(id=owner), ctx=ast.Store()):
                    names.add(owner)
                case ast.AnnAssign(target=ast.Attribute(attr=name), annotation=annotation):
                    annotated |= {name} if len(words_in(annotation)) == 1 else set()
        # What has another value as well is none of them.
        again = module.source.top.statements.items()
        rebound |= {name for name, several in again if len(several) > 1}
    written = Counter(each.name for each in classes)
    holders = Counter(name for each in classes for name in _attributes_of(each))
    marks = {each.name: _words_of_decorators(each) for each in classes}
    odd = {each.name for each in classes if each.keywords or marks[each.name] - _PLAIN_DECORATORS}
    return OwnCode(
        names=frozenset(names | written.keys()),
        stored=frozenset(+stored),
        classes={
            each.name: each
            for each in classes
            if written[each.name] == 1
            and each.name not in rebound
            and marks[each.name] <= _PLAIN_DECORATORS
            and not each.keywords
            and not words_in(*each.bases) & odd
        },
        bases=frozenset(base for each in classes for base in words_in(*each.bases)),
        kept=frozenset({name for name in annotated if holders[name] == 1}.union(kept)),
    )


def _attributes_of(of: ast.ClassDef) -> set[str]:
    nodes = ast.walk(of)
    stored = (each for each in nodes if isinstance(each, ast.Attribute))
    return {each.attr for each in stored if isinstance(each.ctx, ast.Store)}


def _words_of_decorators(of: ast.ClassDef) -> set[str]:
    return words_in(*(getattr(mark, 'func', mark) for mark in of.decorator_list))
