"""What names, attributes and calls stand for in the code of behaviours.

Each has one value, wherever it is assigned once.
"""

from __future__ import annotations

import ast
import builtins
import sys
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, reduce
from itertools import takewhile
from typing import TYPE_CHECKING, TypeAlias, TypeGuard

from composer.python_source.annotations import find_interface
from composer.python_source.modules import MOST_BASES, FunctionSource, ModuleSource
from composer.python_source.syntax import (
    FUNCTIONS,
    FunctionNode,
    bound_names,
    home_of,
    imported_names,
    inner_of,
    is_none,
    list_arguments,
    own_nodes,
    positional_names,
    visible_names,
    wrapper_of,
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.python_source.function_kinds import FunctionKind
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.syntax import FunctionNode


@record
class Chain:
    """Something that a behaviour is given, or an attribute of it: `('node', 'state', 'count')`.

    The first name is `node`, `message`, `changes`, `goal` with the name of an action client, or
    `made` with the type of a message that the code makes.
    """

    path: tuple[str, ...]


@record
class Texts:
    """One of some texts, each with where it is written."""

    options: tuple[tuple[str, ast.expr, ModuleSource], ...]

    @property
    def all(self) -> set[str]:
        """The texts alone."""
        return {text for text, _, _ in self.options}


@record
class Function:
    """A function of the project; a method has its first argument already.

    Attributes:
        makers: The modules of its decorators, which call it with all that they are given.
        is_returned: Whether these return what it returns.
    """

    module: ModuleSource
    definition: FunctionNode | ast.Lambda
    bound: Value | None = None
    scope: Scope | None = None
    makers: tuple[ModuleSource, ...] = ()
    is_returned: bool = True

    @property
    def parameters(self) -> list[str]:
        """The names of those that a call gives by their positions."""
        return positional_names(self.definition)[self.bound is not None :]


@record
class Class:
    """A class of the project."""

    module: ModuleSource
    definition: ast.ClassDef


@record
class Instance:
    """An object of a class of the project, and what is known of the arguments of its making."""

    of: Class
    given: tuple[tuple[str, Value], ...] = ()


@record
class Module:
    """A module of the project."""

    source: ModuleSource


@record
class External:
    """Something of Python or of an installed package, by its full name."""

    name: str


@record
class Made:
    """An object that threads wait for, or a thread: `threading.Event()`."""

    kind: str
    module: ModuleSource
    node: ast.expr


def only_text(value: Value | None) -> str | None:
    """Return the text that a value is, if it is one, and no other one."""
    is_one = isinstance(value, Texts) and len(value.options) == 1
    return value.options[0][0] if is_one else None  # type: ignore[union-attr]


Value: TypeAlias = Chain | Texts | Function | Class | Instance | Module | External | Made


@dataclass(eq=False)
class Scope:
    """A function whose code is looked at, or the top of a module.

    Attributes:
        definition: The function; `None` for the top of a module.
        given: What its parameters stand for, as far as that is known.
        outer: The function around it.
        waits: Whether who calls the behaviour waits for it.
    """

    module: ModuleSource
    definition: FunctionNode | ast.Lambda | None = None
    given: dict[str, Value] = field(default_factory=dict)
    outer: Scope | None = None
    waits: bool = True

    @cached_property
    def arguments(self) -> frozenset[str]:
        """The names of all that the function takes."""
        arguments = list_arguments(self.definition.args) if self.definition else ()
        return frozenset(each.arg for each in arguments)


# The classes whose objects threads wait for.
_MADE = frozenset(
    {
        *(f'threading.{each}' for each in ('Condition', 'Event', 'Lock', 'Thread')),
        *(f'queue.{each}' for each in ('LifoQueue', 'PriorityQueue', 'Queue', 'SimpleQueue')),
    }
)
_WRAPS = External('functools.wraps')
_INSTALLED = {'site-packages', 'dist-packages'}
# An expression that is assigned to a name, or whose items are; `None` for what is not shown.
Stored: TypeAlias = 'tuple[ast.expr | FunctionNode | ast.Import | ast.ImportFrom | None, bool]'
# The arguments of `getattr` without a default.
_GETATTR = 2
# Longer ways from a name to its value are not followed.
_MOST_STEPS = 25


def is_of_project(module: ModuleSource, name: str, finder: ModuleFinder) -> bool:
    """Return whether a module is neither installed, but with the system, nor of Python itself."""
    if module.path is None or not module.body:
        return False
    if finder.is_of_ros_package(name):
        return True
    parts = set(module.path.parts)
    return not (parts & _INSTALLED) and not module.path.is_relative_to(sys.base_prefix)


class Names:
    """Finds what the expressions of a project stand for."""

    def __init__(self, finder: ModuleFinder) -> None:
        self._finder = finder
        self._module_names: dict[int, str] = {}
        self._followed: set[tuple[int, str]] = set()
        # How many expressions were walked through.
        self.walked = 0
        self.kind_of = cache(_kind_of)
        self.stored_in = cache(find_stored)
        self._visible_in = cache(visible_names)
        self._members_of = cache(_Members)
        self._steps = 0

    def find_module(self, name: str) -> ModuleSource | None:
        """Return a module of the project, if it is one and can be read."""
        top_level = name.partition('.')[0]
        if not name or top_level in sys.stdlib_module_names or top_level in ('rclpy', 'composer'):
            return None
        module = self._finder.find(name)
        if not isinstance(module, ModuleSource) or not is_of_project(module, name, self._finder):
            return None
        self._module_names.setdefault(id(module), name)
        return module

    def name_of(self, module: ModuleSource) -> str:
        """Return the name of a module that was found."""
        return self._module_names.get(id(module), '')

    def alias_of(self, name: str, scope: Scope) -> ast.AST | None:
        """Return what a function assigns to a name, where it does once."""
        stored = self.stored_in(scope.definition).get(name, [])
        return stored[0][0] if len(stored) == 1 and not stored[0][1] else None

    def is_local(self, name: str, scope: Scope) -> bool:
        """Return whether a name is one of a function."""
        return name in self.stored_in(scope.definition) or name in scope.arguments

    def defined_in(self, scope: Scope) -> frozenset[str]:
        """Return the names that a function, those around it, and its module define."""
        if scope.definition is None:
            return frozenset({*scope.module.top.statements, *scope.module.top.stored_again})
        outer = scope.outer or Scope(scope.module)
        return self._visible_in(scope.definition) | self.defined_in(outer)

    # Expressions

    def value_of(self, node: ast.expr, scope: Scope) -> Value | None:
        """Return what an expression stands for, `None` if that is not known."""
        if self._steps > _MOST_STEPS:
            return None
        self._steps += 1
        try:
            return self._value_of(node, scope)
        finally:
            self._steps -= 1

    def _value_of(self, node: ast.expr, scope: Scope) -> Value | None:
        match node:
            case ast.Name(id=name):
                return self.named(name, scope)
            case ast.Constant(value=str(text)):
                return Texts(((text, node, scope.module),))
            case ast.IfExp(body=body, orelse=other):
                return _either(self.value_of(body, scope), self.value_of(other, scope))
            case ast.Attribute(value=inner, attr=name):
                owner = self.value_of(inner, scope)
                return None if owner is None else self.attribute(owner, name)
            case ast.Subscript(value=inner, slice=index):
                return self._item_of(self.value_of(inner, scope), index)
            case ast.Call():
                return self._result_of(node, scope)
            case ast.Lambda():
                return Function(scope.module, node, None, scope)
        return None

    def named(self, name: str, scope: Scope) -> Value | None:
        """Return what a name stands for in a scope."""
        within: Scope | None = scope
        while within is not None and within.definition is not None:
            stored = self.stored_in(within.definition).get(name)
            if stored is not None:
                return self._stored_value(name, stored, within)
            if name in within.given:
                return within.given[name]
            if name in within.arguments:
                return None
            within = within.outer
        return self.top_value(scope.module, name)

    def _stored_value(self, name: str, stored: list[Stored], scope: Scope) -> Value | None:
        expression, is_item = stored[0]
        if len(stored) > 1 or expression is None:
            return None
        if isinstance(expression, FUNCTIONS):
            is_plain = not expression.decorator_list
            return Function(scope.module, expression, None, scope) if is_plain else None
        if isinstance(expression, ast.Import | ast.ImportFrom):
            return self._imported(self.full_name(scope.module, expression, name))
        if not is_item:
            return self.value_of(expression, scope)
        if isinstance(expression, ast.Tuple | ast.List):
            values = [self.value_of(item, scope) for item in expression.elts]
            return reduce(_either, values) if values else None
        return self._item_of(self.value_of(expression, scope))

    def _item_of(self, owner: Value | None, index: ast.expr | None = None) -> Value | None:
        """Return an item of something in a message."""
        if not _is_of_message(owner):
            return None
        match index:
            case ast.Constant(value=int(number)):
                return Chain((*owner.path, f'[{number}]'))
        return None if isinstance(index, ast.Slice) else Chain((*owner.path, '[]'))

    def top_value(self, module: ModuleSource, name: str) -> Value | None:
        """Return what a name at the top of a module stands for."""
        top = module.top
        statements = top.statements.get(name, [])
        if not statements:
            is_builtin = not top.is_open and hasattr(builtins, name)
            return External(f'builtins.{name}') if is_builtin else self._starred(module, name)
        statement, is_conditional = statements[0]
        is_import = isinstance(statement, ast.Import | ast.ImportFrom)
        starred = [each for each, _ in top.statements.get('*', ())]
        if any(each.lineno > statement.lineno for each in starred):  # type: ignore[attr-defined]
            # It may bring another one.
            return None
        if name in top.stored_again and not isinstance(statement, ast.Assign):
            return None
        if (len(statements) > 1 or is_conditional) and not is_import:
            return None
        key = id(module), name
        # Modules may import a name of each other.
        if key in self._followed:
            return None
        self._followed.add(key)
        try:
            return self._top_value(module, statement, name)
        finally:
            self._followed.discard(key)

    def _starred(self, module: ModuleSource, name: str) -> Value | None:
        """Return what a name stands for in a module from which all names are imported."""
        starred = [each for each, _ in module.top.statements.get('*', ())]
        own = self.name_of(module)
        for statement in reversed(starred) if name[:1] not in ('*', '_') else ():
            if isinstance(statement, ast.ImportFrom):
                home = self.find_module(home_of(statement, own, is_package=module.is_package))
                if home is None or home is module or '__all__' in home.top.statements:
                    return None
                if name in home.top.statements:
                    return self.top_value(home, name)
        return None

    def _top_value(self, module: ModuleSource, statement: ast.AST, name: str) -> Value | None:
        match statement:
            case ast.FunctionDef() | ast.AsyncFunctionDef():
                return self._decorated(Function(module, statement), statement.decorator_list)
            case ast.ClassDef():
                return Class(module, statement)
            case ast.Import() | ast.ImportFrom():
                return self._imported(self.full_name(module, statement, name))
        for target, value, is_item in assignments(statement):
            is_changed = name in module.top.stored_again and isinstance(value, ast.Constant)
            if isinstance(target, ast.Name) and target.id == name and not is_item:
                return None if is_changed else self.value_of(value, Scope(module))
        return None

    def _decorated(self, function: Function, decorators: list[ast.expr]) -> Function | None:
        """Return a function, if decorators of the project call it with all they are given."""
        for decorator in decorators:
            made_by = decorator.func if isinstance(decorator, ast.Call) else decorator
            maker = self.value_of(made_by, Scope(function.module))
            if not isinstance(maker, Function) or maker.bound or maker.makers:
                return None
            around = maker.definition if made_by is decorator else inner_of(maker.definition)
            wrapper, mark, is_returned = wrapper_of(around) or (None, made_by, False)
            if wrapper is None or self.value_of(mark, Scope(maker.module)) != _WRAPS:
                return None
            # Other code that calls it gets a coroutine, or a generator, all the same.
            if not is_returned and self.kind_of(wrapper) is not self.kind_of(function.definition):
                return None
            is_returned &= function.is_returned
            makers = (*function.makers, maker.module)
            function = replace(function, makers=makers, is_returned=is_returned)
        return function

    def _method(self, of: Class, method: FunctionNode, bound: Instance | None) -> Function | None:
        match [ast.unparse(each) for each in method.decorator_list]:
            case ['staticmethod']:
                return Function(of.module, method)
            case ['classmethod']:
                return Function(of.module, method, of)
        return self._decorated(Function(of.module, method, bound), method.decorator_list)

    def full_name(self, module: ModuleSource, statement: ast.AST, name: str) -> str:
        """Return the full name of what an import stores under a name; empty if unknown."""
        own = self.name_of(module)
        return dict(imported_names(statement, own, is_package=module.is_package)).get(name, '')

    def _imported(self, full_name: str) -> Value | None:
        if not full_name:
            return None
        module = self.find_module(full_name)
        if module is not None:
            return Module(module)
        home, _, name = full_name.rpartition('.')
        module = self.find_module(home)
        return External(full_name) if module is None else self.top_value(module, name)

    # Attributes

    def attribute(self, owner: Value, name: str) -> Value | None:
        """Return what an attribute stands for."""
        match owner:
            case Chain():
                return Chain((*owner.path, name))
            case External():
                return External(f'{owner.name}.{name}')
            case Module():
                own = self.top_value(owner.source, name)
                inner = f'{self._module_names.get(id(owner.source), "")}.{name}'
                return own or self._imported(inner)
            case Instance():
                return self._attribute_of(owner.of, name, owner)
            case Class():
                return self._attribute_of(owner, name, None)
        return None

    def _attribute_of(self, of: Class, name: str, instance: Instance | None) -> Value | None:
        for each in self.bases_of(of):
            members = self._members_of(each.definition)
            value = members.assigned.get(name)
            if name in members.methods:
                # A class may replace it: `get = classmethod(get)`.
                is_plain = value is None and name not in members.stored
                return self._method(each, members.methods[name], instance) if is_plain else None
            if value is not None and not self._is_stored(each.module, name):
                known = self.value_of(value, Scope(each.module))
                # A function is bound to the object by that.
                return None if isinstance(known, Function) else known
            stored = members.stored.get(name, [])
            if stored and instance is not None:
                method, kept = stored[0]
                if len(stored) > 1 or self._is_stored(each.module, name, 1):
                    return None
                given = self._given_in(method, instance)
                return self.value_of(kept, Scope(each.module, method, given))
        return None

    def _given_in(self, method: FunctionNode, instance: Instance) -> dict[str, Value]:
        """Return what is known of the arguments of a method."""
        given: dict[str, Value] = dict(instance.given) if method.name == '__init__' else {}
        return given | dict.fromkeys(positional_names(method)[:1], instance)

    def _is_stored(self, module: ModuleSource, name: str, times: int = 0) -> bool:
        """Return whether code may store an attribute more often than that."""
        stored = module.top.stored_attributes
        return stored[''] > 0 or stored[name] > times

    def bases_of(self, of: Class) -> Iterator[Class]:
        """Yield a class, and those of the project that it inherits from."""
        pending = [of]
        for _ in range(MOST_BASES):
            if not pending:
                return
            each = pending.pop(0)
            yield each
            for base in each.definition.bases:
                value = self.value_of(base, Scope(each.module))
                pending += [value] if isinstance(value, Class) else []

    def instance_of(self, of: Class, call: ast.Call | None, scope: Scope) -> Instance:
        """Return an object of a class that a call makes."""
        init = self._attribute_of(of, '__init__', Instance(of))
        if not isinstance(init, Function) or call is None:
            return Instance(of)
        bound = self.bind(init, call, scope).items()
        return Instance(of, tuple((name, value) for name, value in bound if value is not None))

    def bind(self, function: Function, call: ast.Call, scope: Scope) -> dict[str, Value | None]:
        """Return what the parameters of a function stand for in a call, without its `self`."""
        plain = takewhile(lambda value: not isinstance(value, ast.Starred), call.args)
        pairs = list(zip(function.parameters, plain, strict=False))
        pairs += [(each.arg, each.value) for each in call.keywords if each.arg]
        return {name: self.value_of(node, scope) for name, node in pairs}

    def _result_of(self, call: ast.Call, scope: Scope) -> Value | None:
        match self.value_of(call.func, scope):
            case External(name=name) if name in _MADE:
                return Made(name, scope.module, call)
            case External(name=name) if (interface := find_interface(name)) is not None:
                return Chain(('made', interface))
            case Class() as of:
                return self.instance_of(of, call, scope)
            case External(name='builtins.getattr') if len(call.args) == _GETATTR:
                owner, named = (self.value_of(each, scope) for each in call.args)
                method = only_text(named)
                return Chain(('node', method)) if method and owner == Chain(('node',)) else None
            case Chain(path=('node', 'send_goal')):
                sent = self.value_of(call.args[0], scope) if call.args else None
                client = only_text(sent)
                return None if client is None else Chain(('goal', client))
        return None


def _kind_of(definition: FunctionNode) -> FunctionKind | None:
    return FunctionSource(definition).kind


def find_stored(definition: ast.AST | None) -> dict[str, list[Stored]]:
    """Return the names that a function stores, and what it assigns to each."""
    nodes = list(own_nodes(definition))
    found: dict[str, list[Stored]] = {}
    shown: set[int] = set()
    shared: set[str] = set()
    for node in nodes:
        shared |= {*node.names} if isinstance(node, ast.Global | ast.Nonlocal) else set()
        for target, value, is_item in assignments(node):
            if isinstance(target, ast.Name):
                shown.add(id(target))
                found.setdefault(target.id, []).append((value, is_item))
    for node in nodes:
        known = node if isinstance(node, (*FUNCTIONS, ast.Import, ast.ImportFrom)) else None
        for name in bound_names(node) if id(node) not in shown else ():
            found.setdefault(name, []).append((known, False))
    # What a function in it stores has no one value.
    inner = ast.walk(definition) if definition is not None else ()
    for name in {each for node in inner if isinstance(node, ast.Nonlocal) for each in node.names}:
        found[name] = [(None, False), *found.get(name, ())]
    return {name: several for name, several in found.items() if name not in shared}


def assignments(node: ast.AST) -> Iterator[tuple[ast.expr, ast.expr, bool]]:
    """Yield targets with what is assigned to them, and whether that is one of its items."""
    match node:
        case ast.Assign(targets=targets, value=value):
            for target in targets:
                if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                    pairs = zip(target.elts, value.elts, strict=False)
                    yield from ((one, other, False) for one, other in pairs)
                else:
                    yield target, value, False
        case (
            ast.AnnAssign(target=target, value=ast.expr() as value)
            | ast.NamedExpr(target=target, value=value)
        ):
            yield target, value, False
        case ast.For(target=target, iter=value) | ast.comprehension(target=target, iter=value):
            yield from _items_of(target, value)


def _items_of(target: ast.expr, value: ast.expr) -> Iterator[tuple[ast.expr, ast.expr, bool]]:
    match target, value:
        case ast.Tuple(elts=[_, inner]), ast.Call(func=ast.Name(id='enumerate'), args=[of, *_]):
            yield from _items_of(inner, of)
        case ast.Tuple(elts=names), ast.Call(func=ast.Name(id='zip'), args=several):
            for one, of in zip(names, several, strict=False):
                yield from _items_of(one, of)
        case _, ast.Call(func=ast.Name(id='reversed' | 'sorted' | 'list'), args=[of]):
            yield target, of, True
        case _:
            yield target, value, True


class _Members:
    """The methods of a class, and what its body and its methods assign to its attributes."""

    def __init__(self, definition: ast.ClassDef) -> None:
        self.methods: dict[str, FunctionNode] = {}
        self.assigned: dict[str, ast.expr] = {}
        self.stored: dict[str, list[tuple[FunctionNode, ast.expr]]] = {}
        for statement in definition.body:
            match statement:
                case ast.FunctionDef() | ast.AsyncFunctionDef():
                    self.methods[statement.name] = statement
                    self._read(statement)
                case ast.Assign(targets=[ast.Name(id=name)], value=value) if not is_none(value):
                    self.assigned[name] = value

    def _read(self, method: FunctionNode) -> None:
        own_name = next(iter(positional_names(method)), '')
        for node in own_nodes(method):
            for target, value, _ in assignments(node):
                match target:
                    case ast.Attribute(value=ast.Name(id=owner), attr=name):
                        if owner == own_name and not is_none(value):
                            self.stored.setdefault(name, []).append((method, value))


def _either(one: Value | None, other: Value | None) -> Value | None:
    if isinstance(one, Texts) and isinstance(other, Texts):
        return Texts((*one.options, *other.options))
    return one if one == other else None


def _is_of_message(value: Value | None) -> TypeGuard[Chain]:
    return isinstance(value, Chain) and value.path[0] in ('message', 'made')
