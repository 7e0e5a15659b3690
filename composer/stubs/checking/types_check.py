"""Have the behaviours of a system checked by pyrefly: stubs, annotated copies, and findings."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.stubs.checking.annotated_copies import (
    Annotator,
    find_certain_values,
    find_received_values,
)
from composer.stubs.checking.type_checker import run_type_checker
from composer.stubs.checking.type_findings import TypeFindings
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
    from collections.abc import Iterable
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import NodeSpec
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
    texts = {path: copy.text for path, copy in copies.items()}
    version, reports = run_type_checker(program, texts, files)
    own, defined = _own_names(modules)
    findings = TypeFindings(
        context,
        classes.nodes_by_name,
        shapes,
        annotator.functions,
        _message_classes(files),
        own,
        frozenset(modules),
        defined,
    )
    return version, [
        finding
        for path, copy in copies.items()
        for finding in findings.explain_all(copy, [each for each in reports if each.path == path])
    ]


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


def _own_names(modules: dict[str, ProjectModule]) -> tuple[frozenset[str], frozenset[str]]:
    """Return the names of classes of which the stubs do not tell all, and all that are defined.

    The first are classes that the modules define, import from anywhere but ROS, or add attributes
    to; the second all names that their code may give to something, with an empty one for any.
    """
    own: set[str] = set()
    defined: set[str] = set()
    for module in modules.values():
        imports, top = module.source.imports.items(), module.source.top
        own |= {name for name, full_name in imports if not _OF_ROS.search(full_name)}
        stored = top.stored_attributes.copy()
        for node in ast.walk(module.tree):
            match node:
                case ast.AugAssign(target=ast.Attribute(attr=name)):
                    # It changes what is there already.
                    stored[name] -= 1
                case ast.ClassDef(name=name):
                    own.add(name)
                case ast.Attribute(value=ast.Name(id=owner), ctx=ast.Store()):
                    own.add(owner)
                case ast.Constant(value=str(name)) if name:
                    defined.add(name)
        defined |= {*+stored} | top.all_stored - {name for name, _ in imports}
    return frozenset(own), frozenset(defined)
