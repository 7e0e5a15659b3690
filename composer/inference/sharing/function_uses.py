"""What one function does with objects that several nodes may have."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.inference.sharing.object_classes import QUEUING
from composer.inference.sharing.object_resolver import ObjectResolver, is_load
from composer.python_source.changed_names import CHANGING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Span
    from composer.inference.sharing.object_classes import ObjectClasses
    from composer.inference.sharing.shared_functions import (
        SharedFunction,
        SharedFunctions,
        SharedName,
    )

_CHANGING = CHANGING | QUEUING


@dataclass(slots=True)
class NameUses:
    """What a behaviour does with objects: the first place of each.

    Attributes:
        made: What it makes if it is not there, or takes away: each process may do so for itself.
    """

    read: dict[SharedName, Span] = field(default_factory=dict)
    changed: dict[SharedName, Span] = field(default_factory=dict)
    made: dict[SharedName, Span] = field(default_factory=dict)


class FunctionReader:
    """Reads one function.

    Args:
        uses: What it reads and changes is added to it.
    """

    def __init__(
        self,
        functions: SharedFunctions,
        classes: ObjectClasses,
        function: SharedFunction,
        uses: NameUses,
    ) -> None:
        self._functions = functions
        self._classes = classes
        self._function = function
        self._uses = uses
        self._objects = ObjectResolver(functions, classes, function)

    def read(self) -> list[SharedFunction]:
        """Note what the function reads and changes; return the functions that it refers to."""
        made = dict(self._list_made())
        # The object of a change is not read: in `STATE['x'] = 1`, nobody learns what it holds.
        passed = {
            id(part) for node in self._objects.nodes for part in self._note_change(node, made)
        }
        methods: set[int] = set()
        referred: list[SharedFunction] = []
        for node in self._objects.nodes:
            if isinstance(node, ast.Call):
                referred += self._objects.find_called(node)
                methods.add(id(node.func))
            elif not isinstance(node, ast.Name | ast.Attribute) or not is_load(node):
                continue
            elif id(node) in methods:
                # What is known of `STATE.get` is that it reads `STATE`.
                if isinstance(node, ast.Attribute):
                    continue
            elif id(node) not in passed:
                referred += self._objects.find_functions(node)
            self._note_read(node, passed)
        return referred

    def _note_read(self, node: ast.Name | ast.Attribute | ast.Call, passed: set[int]) -> None:
        name = self._objects.resolve(node) if id(node) not in passed else None
        is_read = name is not None and not self._functions.is_definition(name)
        if name is not None and is_read:
            self._uses.read.setdefault(name, self._place(node))
        # Of `WORLD.robot.pose`, the pose is read, and not all that the robot has.
        if isinstance(node, ast.Attribute) and (is_read or id(node) in passed):
            passed.add(id(node.value))

    def _note_change(self, node: ast.AST, made: dict[int, SharedName]) -> Iterator[ast.AST]:
        """Note what a node changes; yield the parts of it that only lead there."""
        method = ''
        match node:
            case ast.Name() | ast.Attribute() if not is_load(node):
                changed: ast.AST = node
            case ast.Subscript(value=inner) if not is_load(node):
                changed = inner
            case ast.Call(func=ast.Attribute(value=inner, attr=method) as function):
                # A function of this name, of a module or a class, is followed.
                if method not in _CHANGING or self._objects.find_functions(function):
                    return
                changed = inner
            case _:
                return
        name = None if self._objects.is_own(node) else self._objects.resolve(changed)
        while name is None and isinstance(changed, ast.Attribute | ast.Subscript):
            changed = changed.value
            name = self._objects.resolve(changed)
        if name is None or self._classes.is_elsewhere(name, method):
            return
        whole = made.get(id(node))
        is_made = whole is not None and f'{name[1]}.'.startswith(f'{whole[1]}.')
        known = self._uses.made if is_made else self._uses.changed
        known.setdefault(name, self._place(node))
        yield from ast.walk(changed)
        yield from (each for each in [getattr(node, 'func', None)] if each)

    def _list_made(self) -> Iterator[tuple[int, SharedName]]:
        """Yield the nodes that make an object if there is none, or take it away, and which."""
        for node in self._objects.nodes:
            match node:
                case ast.If(test=test, body=body):
                    inner = [part for statement in body for part in ast.walk(statement)]
                    stored = {
                        self._objects.resolve(part)
                        for part in inner
                        if isinstance(part, ast.Name | ast.Attribute) and not is_load(part)
                    }
                    for name in {
                        self._objects.resolve(each) for each in _list_missing(test)
                    } & stored:
                        if name is not None:
                            yield from ((id(part), name) for part in inner)
                case ast.Assign(targets=targets, value=ast.Constant(value=None)):
                    for target in targets:
                        if (name := self._objects.resolve(target)) is not None:
                            yield id(target), name

    def _place(self, node: ast.AST) -> Span:
        return self._function.source.place_of(getattr(node, 'lineno', 1))


def _list_missing(test: ast.expr) -> Iterator[ast.expr]:
    """Yield the expressions that a test finds to be `None`, empty or not there."""
    match test:
        case ast.BoolOp(op=ast.Or(), values=values):
            for each in values:
                yield from _list_missing(each)
        case ast.Compare(left=left, ops=[ast.Is() | ast.Eq()], comparators=[ast.Constant(None)]):
            yield left
        case ast.UnaryOp(
            op=ast.Not(),
            operand=ast.Call(func=ast.Name('hasattr'), args=[value, ast.Constant(str(name))]),
        ):
            yield ast.Attribute(value=value, attr=name, ctx=ast.Load())
        case ast.UnaryOp(op=ast.Not(), operand=(ast.Name() | ast.Attribute()) as operand):
            yield operand
