"""Where code may change what a name or an attribute holds, however it comes to it.

What is only read there, is harmless; what is passed on, kept or returned may be changed by whoever
has it then.
"""

from __future__ import annotations

import ast
from functools import cache
from typing import TYPE_CHECKING

from composer.python_source.local_names import find_parameter
from composer.python_source.syntax import list_children

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.python_source.syntax import FunctionNode

# Methods of containers that change nothing; their other methods may.
_READING = frozenset(
    {
        *('copy', 'count', 'difference', 'elements', 'get', 'index', 'intersection', 'items'),
        *('isdisjoint', 'issubset', 'issuperset', 'keys', 'most_common', 'tolist', 'union'),
        *('symmetric_difference', 'total', 'values', '__contains__', '__getitem__', '__len__'),
        *('__class__', '__name__', '__qualname__', '__doc__', '__module__'),
    }
)
# Methods that change what they are called on.
CHANGING = frozenset(
    {
        *('add', 'append', 'appendleft', 'clear', 'discard', 'extend', 'extendleft', 'insert'),
        *('pop', 'popitem', 'popleft', 'remove', 'reverse', 'rotate', 'setdefault', 'sort'),
        *('subtract', 'update', 'frombytes', 'fromlist', 'move_to_end', 'byteswap', 'fill'),
        *('difference_update', 'intersection_update', 'symmetric_difference_update'),
    }
)
# Functions and methods that change no argument, whatever they are of.
_HARMLESS = frozenset(
    {
        *('abs', 'all', 'any', 'bool', 'dict', 'enumerate', 'float', 'format', 'frozenset'),
        *('hasattr', 'hash', 'id', 'int', 'isinstance', 'issubclass', 'iter', 'len'),
        *('list', 'max', 'min', 'print', 'range', 'repr', 'reversed', 'set', 'sorted', 'str'),
        *('sum', 'super', 'tuple', 'type', 'zip', 'call', 'call_async', 'publish', 'send_goal'),
        *('get_parameters', 'set_parameters', 'deepcopy', 'copy', 'choice', 'dumps', 'join'),
        *('debug', 'info', 'warning', 'warn', 'error', 'asdict', 'chain', 'cycle', 'islice'),
        *('from_iterable', 'fromkeys', 'MappingProxyType', 'product', 'array', 'setattr', 'next'),
        *(
            'fields',
            'is_dataclass',
            'itemgetter',
            'Counter',
            'deque',
            'Lock',
            'field',
            'singledispatch',
        ),
        *('difference', 'intersection', 'issubset', 'issuperset', 'union'),
    }
)
_PLAIN = (
    *(ast.Compare, ast.UnaryOp, ast.Expr, ast.FormattedValue, ast.If, ast.While, ast.Assert),
    *(ast.Delete, ast.Raise, ast.Slice, ast.withitem, ast.Module, ast.ClassDef, ast.AnnAssign),
    *(
        ast.FunctionDef,
        ast.AsyncFunctionDef,
        ast.Call,
        ast.keyword,
        ast.Subscript,
        ast.Await,
        ast.ExceptHandler,
        ast.arg,
    ),
)
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


# How deep in a value something is changed: itself, what is in it, what is in that, …, or nothing.
ALL, INSIDE, NOTHING = 0, 1, 99


class ChangedNames:
    """The names in a piece of code, and how deep what they hold may be changed."""

    def __init__(self, body: Iterable[ast.AST]) -> None:
        self._parents: dict[ast.AST, ast.AST] = {}
        self._names: dict[str, list[ast.Name]] = {}
        self._functions: dict[str, list[FunctionNode]] = {}
        self._known: dict[object, int] = {}
        pending = [*body]
        for node in pending:
            children = list_children(node)
            self._parents |= dict.fromkeys(children, node)
            pending += children
            if isinstance(node, ast.Name):
                self._names.setdefault(node.id, []).append(node)
            elif isinstance(node, _FUNCTIONS):
                self._functions.setdefault(node.name, []).append(node)

    def change_of(self, name: str) -> int:
        """Return how deep what a name holds may be changed, wherever it stands."""
        return min(map(self.change_at, self._names.get(name, ())), default=NOTHING)

    def all_changes(self) -> dict[str, int]:
        """Return all names, and how deep what they hold may be changed."""
        return {name: self.change_of(name) for name in self._names}

    def change_at(self, node: ast.expr) -> int:
        """Return how deep the code around an expression may change its value."""
        if node not in self._known:
            # What comes back to it, adds nothing.
            self._known[node] = NOTHING
            self._known[node] = self._change_by(node, self._parents.get(node))
        return self._known[node]

    def is_changed_here(self, node: ast.expr) -> bool:
        """Return whether a method is called that changes a value, or an item of it is stored."""
        parent = self._parents.get(node)
        if isinstance(parent, ast.Subscript):
            return not isinstance(parent.ctx, ast.Load)
        call = self._parents.get(parent) if isinstance(parent, ast.Attribute) else None
        return isinstance(call, ast.Call) and call.func is parent

    def is_given(self, node: ast.expr) -> bool:
        """Return whether an object is given to something else, which may store attributes."""
        parent = self._parents.get(node)
        if isinstance(parent, ast.Attribute):
            return parent.attr == '__dict__'
        return self.change_at(node) == ALL

    def _change_by(self, node: ast.expr, parent: ast.AST | None) -> int:
        if isinstance(getattr(node, 'ctx', None), ast.Store | ast.Del):
            is_own = isinstance(node, ast.Name | ast.Attribute | ast.Tuple | ast.List)
            return ALL if isinstance(parent, ast.AugAssign) or not is_own else NOTHING
        match parent:
            case ast.Attribute():
                return self._change_by_attribute(parent)
            case ast.Subscript(value=value, ctx=context) if value is node:
                is_read = isinstance(context, ast.Load)
                return _inside(self.change_at(parent)) if is_read else ALL
            case ast.Call(func=function) if function is not node:
                return self._change_by_call(parent, node)
            case ast.keyword(arg=name) if isinstance(call := self._parents[parent], ast.Call):
                return self._change_by_call(call, node, name)
            case ast.Return():
                return self._change_by_callers(node)
        return self._change_by_store(node, parent)

    def _change_by_store(self, node: ast.expr, parent: ast.AST | None) -> int:
        match parent:
            case ast.For(target=target) | ast.comprehension(target=target):
                return _inside(self._change_of_target(target, node))
            case ast.Assign(targets=targets):
                return min(self._change_of_target(each, node) for each in targets)
            case ast.AnnAssign(target=target, value=value) if value is node:
                return self._change_of_target(target, node)
            case ast.NamedExpr(target=target):
                return min(self._change_of_target(target, node), self.change_at(parent))
            case ast.BinOp():
                return max(INSIDE, self.change_at(parent))
            case ast.BoolOp() | ast.IfExp():
                is_test = getattr(parent, 'test', None) is node
                return NOTHING if is_test else self.change_at(parent)
            case ast.List() | ast.Tuple() | ast.Set() | ast.Dict():
                change = self.change_at(parent)
                return change if change == NOTHING else max(ALL, change - 1)
        is_spread = isinstance(parent, ast.AugAssign | ast.Starred)
        is_plain = parent is None or isinstance(parent, _PLAIN)
        return NOTHING if is_plain else INSIDE if is_spread else ALL

    def _change_by_attribute(self, attribute: ast.Attribute) -> int:
        if attribute.attr not in _READING:
            is_change = attribute.attr in CHANGING or attribute.attr.startswith('__')
            return ALL if is_change else NOTHING
        call = self._parents.get(attribute)
        if not isinstance(call, ast.Call) or call.func is not attribute:
            return NOTHING
        change = self.change_at(call)
        return _inside(change) if attribute.attr == 'get' else _outside(change)

    def _change_by_call(self, call: ast.Call, node: ast.expr, name: str | None = '') -> int:
        if name is None:
            return INSIDE
        called = _name_of(call.func)
        if called in _HARMLESS:
            return _outside(self.change_at(call))
        found: list[int] = []
        for each in self._functions.get(called, ()):
            is_method = isinstance(self._parents.get(each), ast.ClassDef)
            position = name or call.args.index(node) + is_method
            parameter = find_parameter(each, position)
            found.append(self._change_in(each, parameter) if parameter else ALL)
        return min(found, default=ALL)

    def _change_of_target(self, target: ast.expr, node: ast.AST) -> int:
        """Return how deep what a target is given is changed."""
        if isinstance(target, ast.Tuple | ast.List):
            changes = (self._change_of_target(each, node) for each in target.elts)
            return _inside(min(changes, default=NOTHING))
        if not isinstance(target, ast.Name):
            return ALL
        while node in self._parents and not isinstance(node, _FUNCTIONS):
            node = self._parents[node]
        return self._change_in(node, target.id)

    def _change_in(self, scope: ast.AST, name: str) -> int:
        if (scope, name) not in self._known:
            self._known[scope, name] = NOTHING
            inside = (each for each in self._names.get(name, ()) if self._is_in(each, scope))
            self._known[scope, name] = min(map(self.change_at, inside), default=NOTHING)
        return self._known[scope, name]

    def _is_in(self, node: ast.AST | None, scope: ast.AST) -> bool:
        if not isinstance(scope, _FUNCTIONS):
            return True
        while node is not None and node is not scope:
            node = self._parents.get(node)
        return node is scope

    def _change_by_callers(self, node: ast.AST) -> int:
        """Return how deep those change a result who call the function around a place."""
        while node in self._parents and not isinstance(node, _FUNCTIONS):
            node = self._parents[node]
        name = getattr(node, 'name', '')
        if getattr(node, 'decorator_list', ()):
            return ALL
        found = []
        for each, parent in self._parents.items():
            if _name_of(each) == name:
                is_call = isinstance(parent, ast.Call) and parent.func is each
                found.append(self.change_at(parent) if is_call else ALL)  # type: ignore[arg-type]
        return min(found, default=NOTHING)


def _name_of(node: ast.AST) -> str:
    return str(getattr(node, 'id', None) or getattr(node, 'attr', ''))


def _inside(change: int) -> int:
    """Return how deep something is changed in what holds it."""
    return min(change + 1, NOTHING)


def _outside(change: int) -> int:
    """Return how deep something is changed whose items are changed in another container."""
    return change if change == NOTHING else max(INSIDE, change - 1)


@cache
def changed_in(function: ast.AST) -> frozenset[str]:
    """Return the names in a function of whose values something may be changed there."""
    changes = ChangedNames([function]).all_changes()
    return frozenset(name for name, change in changes.items() if change != NOTHING)
