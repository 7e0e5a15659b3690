"""The types of what a project stores as attributes: of `node.state`, and of its own objects."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING, TypeAlias

from composer.interfaces.descriptions import FieldType
from composer.node_uses.names import Chain, Class, External, Instance, Names, Scope
from composer.python_source.syntax import bound_names, own_nodes, positional_names
from composer.stubs.message_stubs import FieldTypes, StubImports

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.interfaces.message_types import MessageTypes
    from composer.node_uses.names import Value
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.project_modules import ProjectModule

# The types that a module stores, by the names of attributes; `None` if it may set any name.
StoredTypes: TypeAlias = 'Mapping[str, set[str]] | None'

ANYTHING = 'Any'
# Whoever uses these may set names that no check can see.
_OPEN = frozenset({'__dict__', '__setattr__', 'vars'})
_NUMBERS = frozenset({'int', 'float'})
# What makes or returns something of rclpy.
_TIMES = {
    f'rclpy.{name.lower()}.{name}{end}': f'rclpy.{name.lower()}:{name}'
    for name in ('Time', 'Duration')
    for end in ('', '.from_msg')
}


def find_stored_types(
    context: CheckContext,
    modules: Mapping[str, ProjectModule],
    given: Mapping[int, dict[str, Value]],
) -> dict[str, StoredTypes]:
    """Return the types that each module stores.

    Names of classes have a colon after their module, those of messages are full.

    Args:
        given: What the parameters of functions stand for, by the identity of the definition.
    """
    values = _Values(context, given)
    return {name: _find_stored(module, values) for name, module in modules.items()}


def types_of_state(
    values: Iterable[object], stored: Iterable[Mapping[str, set[str]]], name: str
) -> tuple[str, ...]:
    """Return the types of a name of the state: of its value in the file, and of all stored.

    Args:
        values: The value in the file, if there is one.
    """
    declared = {type(value).__name__ for value in values}
    types = declared.union(*(names.get(name, set()) for names in stored))
    none = types & {'NoneType'}
    if declared == {'float'} and types <= {*_NUMBERS, '+=', 'NoneType', ANYTHING}:
        # What the file declares as a number is one, whatever computes it.
        types = {'float'} | none
    if '+=' in types:
        # A number stays one, with whatever it is added to or multiplied by.
        types = types - {'+='} | ({'float'} if types & _NUMBERS else {ANYTHING})
    known = types - none
    if not known or {ANYTHING, 'list', 'dict'} & known:
        return (ANYTHING,)
    return (*sorted(known), *(['None'] if none else []))


def types_kept(
    modules: Mapping[str, ProjectModule], stored: Mapping[str, StoredTypes]
) -> dict[str, str]:
    """Return the types of attributes that are one type wherever they are not `None`."""
    nodes = (node for module in modules.values() for node in ast.walk(module.tree))
    bodies = (own_nodes(node) for node in nodes if isinstance(node, ast.ClassDef))
    # A class may make it a property.
    names = {name: {ANYTHING} for body in bodies for node in body for name in bound_names(node)}
    for module in stored.values():
        if module is None:
            return {}
        for name, types in module.items():
            names.setdefault(name, set()).update(types - {'NoneType'})
    return {
        name: types.pop()
        for name, types in names.items()
        if len(types) == 1 and not types & {ANYTHING, '+='}
    }


def _find_stored(module: ProjectModule, values: _Values) -> StoredTypes:
    """Return every name that a module sets as an attribute of anything, with the types of values.

    It need not be `node.state` itself that it names: that may be passed on, or have another name.
    """
    values.find_module(module.name)
    nodes = [*values.nodes_in(module.tree, Scope(module.source))]
    called = {id(node.func) for node, _ in nodes if isinstance(node, ast.Call)}
    types = values.types_assigned(nodes)
    found: dict[str, set[str]] = {}
    for node, scope in nodes:
        match node:
            case ast.Attribute(value=owner, attr=name, ctx=ast.Store() | ast.Del()):
                is_field = '/' in values.type_of(owner, scope)
                stored = set() if is_field else {types.get(id(node), ANYTHING)}
                found.setdefault(name, set()).update(stored)
            case ast.Call(func=ast.Name(id='setattr') | ast.Attribute(attr='setattr'), args=args):
                if len(args) <= 1 or not isinstance(args[1], ast.Constant):
                    return None
                found.setdefault(str(args[1].value), set()).add(ANYTHING)
            case ast.Name(id=name) | ast.Attribute(attr=name):
                if name in _OPEN or (name == 'setattr' and id(node) not in called):
                    return None
    return found


class _Values(Names):
    """Finds the types of values; what is not certain has any type."""

    def __init__(self, context: CheckContext, given: Mapping[int, dict[str, Value]]) -> None:
        super().__init__(context.modules)
        self._types = context.types
        self._given = given

    def nodes_in(
        self, inside: ast.AST, scope: Scope, of: Instance | None = None
    ) -> Iterator[tuple[ast.AST, Scope]]:
        """Yield the syntax nodes of a module, class or function, each with its scope."""
        for node in own_nodes(inside):
            yield node, scope
            if isinstance(node, ast.ClassDef):
                yield from self.nodes_in(node, scope, Instance(Class(scope.module, node)))
            elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
                given = self._given.get(id(node), {})
                if of is not None and not getattr(node, 'decorator_list', ()):
                    given = dict.fromkeys(positional_names(node)[:1], of) | given
                yield from self.nodes_in(node, Scope(scope.module, node, given, scope))

    def types_assigned(self, nodes: Iterable[tuple[ast.AST, Scope]]) -> dict[int, str]:
        """Return the types that targets are assigned, by the identity of the target."""
        types: dict[int, str] = {}
        has_arrays = False
        for node, scope in nodes:
            match node:
                case ast.Import(names=names):
                    # Arrays of NumPy turn what they are added to into an array.
                    has_arrays |= any(each.name.partition('.')[0] == 'numpy' for each in names)
                case ast.Assign(targets=targets, value=value):
                    types.update((id(each), self.type_of(value, scope)) for each in targets)
                case ast.AugAssign(
                    target=target, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div()
                ):
                    types[id(target)] = '+='
        return {
            key: ANYTHING if has_arrays and each == '+=' else each for key, each in types.items()
        }

    def type_of(self, value: ast.expr, scope: Scope) -> str:
        """Return the type of a value."""
        match value:
            case ast.Constant():
                return type(value.value).__name__
            case ast.JoinedStr():
                return 'str'
            case ast.Compare(ops=[ast.Is() | ast.IsNot() | ast.In() | ast.NotIn(), *_]):
                return 'bool'
        match self.value_of(value, scope):
            case Chain(path=('made', name)) if ':' in name:
                return name
            case Chain(path=('made', name, *path)):
                return type_in(self._types, name, path)
            case Instance(of=of) if of.definition in of.module.body:
                return f'{self.name_of(of.module)}:{of.definition.name}'
        return ANYTHING

    def named(self, name: str, scope: Scope) -> Value | None:
        """Return what a name stands for; a parameter that is changed is not known."""
        is_changed = name in scope.arguments and name in self.stored_in(scope.definition)
        return None if is_changed else super().named(name, scope)

    def _given_in(self, method: FunctionNode, instance: Instance) -> dict[str, Value]:
        return super()._given_in(method, instance) | self._given.get(id(method), {})

    def _result_of(self, call: ast.Call, scope: Scope) -> Value | None:
        match self.value_of(call.func, scope):
            case Chain(path=('node', 'now')):
                return Chain(('made', 'rclpy.time:Time'))
            case Chain(path=('node', 'send_goal')):
                return Chain(('made', 'composer_stubs:Goal'))
            case Chain(path=('made', name, 'to_msg')) if ':' in name:
                return Chain(('made', f'builtin_interfaces/msg/{name.partition(":")[2]}'))
            case External(name=name) if name in _TIMES:
                return Chain(('made', _TIMES[name]))
        return super()._result_of(call, scope)


def type_in(types: MessageTypes, name: str, path: Iterable[str]) -> str:
    """Return the type of a message, or of a field in it."""
    found = FieldType('message', name)
    for each in path:
        nested = types.describe(found.nested) if found.nested else None
        field = nested.field(each) if nested and not found.array else None
        if field is not None:
            found = field.type
        elif found.array and found.nested and each.startswith('['):
            found = found.item
        else:
            return ANYTHING
    if found.array or (found.nested and types.describe(found.nested) is None):
        return ANYTHING
    return found.nested or FieldTypes(StubImports('')).read(found)
