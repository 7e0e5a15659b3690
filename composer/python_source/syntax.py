"""Parse the source of a module, within limits on time and memory."""

from __future__ import annotations

import ast
import re
from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, TypeAlias

from composer.errors import ComposerError
from composer.input_limits import MAX_MODULE_TOKENS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

FunctionNode: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)

_TOKEN = re.compile(rb'\w+|[^\w ]')
# The compiler compares those of one scope with each other: ten thousand equal ones take seconds.
_CODE_OBJECT = re.compile(rb'\b(?:def|lambda)\b|\bfor\b[^\n]*?\bin\b')
_MOST_CODE_OBJECTS = 4000
# It copies each `finally` for each way out of its `try`: nested ones make gigabytes of a line.
_MOST_COMPILED_NODES = 300_000
_WAYS_OUT = (ast.Return, ast.Break, ast.Continue)
# What a decorator may ask of a function, and of a node.
_LOGGED = frozenset({'__name__', '__qualname__', 'logger'})
SCOPES = (*FUNCTIONS, ast.ClassDef, ast.Lambda)


class UnreadModuleError(ComposerError):
    """A module may be valid, and is not read: it is too large, or nests too deep."""


def list_children(node: ast.AST) -> list[ast.AST]:
    """Return the nodes right below a node, without the contexts of names, three times as fast."""
    found: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if value.__class__ is list:
            found += [each for each in value if isinstance(each, ast.AST)]
        elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
            found.append(value)
    return found


def list_nodes(body: Iterable[ast.AST]) -> list[ast.AST]:
    """Return nodes and all below them, without the contexts of names."""
    nodes = [*body]
    for node in nodes:
        nodes += list_children(node)
    return nodes


def own_nodes(definition: ast.AST | None) -> Iterator[ast.AST]:
    """Yield the nodes of a function, and not those of functions and classes in it."""
    body = getattr(definition, 'body', [])
    pending: list[ast.AST] = list(body) if isinstance(body, list) else [body]
    while pending:
        node = pending.pop()
        yield node
        if not isinstance(node, SCOPES):
            pending += list_children(node)


def bound_names(node: ast.AST) -> list[str]:
    """Return the names that a node itself binds or deletes, without those that parts of it do."""
    match node:
        case ast.Name(id=name, ctx=ast.Store() | ast.Del()) | ast.arg(arg=name):
            return [name]
        case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
            return [name]
        case ast.ClassDef(name=name) | ast.ExceptHandler(name=str(name)):
            return [name]
        case ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
            return [name]
        case ast.MatchMapping(rest=str(name)):
            return [name]
        case ast.Import() | ast.ImportFrom():
            return [name for name, _ in imported_names(node)]
    return []


def visible_names(definition: ast.AST) -> frozenset[str]:
    """Return the names that a function takes or binds, in classes in it as well."""
    found: set[str] = set()
    pending = list_children(definition)
    while pending:
        node = pending.pop()
        found.update(bound_names(node))
        if not isinstance(node, (*FUNCTIONS, ast.Lambda)):
            pending += list_children(node)
    return frozenset(found)


def stored_names(node: ast.AST) -> set[str]:
    """Return the names that code assigns or deletes, in functions in it as well."""
    names = [each for each in ast.walk(node) if isinstance(each, ast.Name)]
    return {name.id for name in names if not isinstance(name.ctx, ast.Load)}


def imported_names(
    statement: ast.AST, module: str = '', *, is_package: bool = False
) -> Iterator[tuple[str, str]]:
    """Yield the names that an import binds, with the full names of what they are, if known.

    Args:
        module: The name of the module with the import, to which it may be relative.
        is_package: Whether this is the `__init__.py` of a package.
    """
    if isinstance(statement, ast.Import):
        for alias in statement.names:
            first = alias.name.partition('.')[0]
            yield alias.asname or first, alias.name if alias.asname else first
    elif isinstance(statement, ast.ImportFrom):
        home = home_of(statement, module, is_package=is_package)
        for alias in statement.names:
            yield alias.asname or alias.name, f'{home}.{alias.name}' if home else ''


def home_of(statement: ast.ImportFrom, module: str, *, is_package: bool) -> str:
    """Return the full name of the module that names are imported from; empty if unknown."""
    if not statement.level:
        return statement.module or ''
    parts = module.split('.') if module else []
    package = parts[: max(0, len(parts) - statement.level + is_package)]
    return '.'.join([*package, *filter(None, [statement.module])]) if package else ''


def imported_modules(
    statement: ast.Import | ast.ImportFrom, module: str, *, is_package: bool
) -> list[str]:
    """Return the full names of what may be modules in an import."""
    if isinstance(statement, ast.Import):
        return [alias.name for alias in statement.names]
    home = home_of(statement, module, is_package=is_package)
    return [home, *(f'{home}.{alias.name}' for alias in statement.names)]


def list_arguments(arguments: ast.arguments) -> list[ast.arg]:
    """Return all parameters, `*args` and `**kwargs` included."""
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return [*named, *filter(None, (arguments.vararg, arguments.kwarg))]


def positional_names(definition: FunctionNode | ast.Lambda) -> list[str]:
    """Return the names of the parameters that are given by their positions."""
    return [each.arg for each in (*definition.args.posonlyargs, *definition.args.args)]


def inner_of(definition: ast.AST | None) -> FunctionNode | None:
    """Return the function that another one defines last, and returns."""
    match definition:
        case ast.FunctionDef(body=[*_, inner, ast.Return(value=ast.Name(id=name))]):
            return inner if isinstance(inner, FUNCTIONS) and inner.name == name else None
    return None


def wrapper_of(maker: ast.AST | None) -> tuple[FunctionNode, ast.expr, bool] | None:
    """Return the wrapper that a decorator makes, which calls a function with all it is given.

    With it come what marks it, as `functools.wraps`, and whether it returns what the function
    does. `None` if more than logging may happen to these, or if it may drop an error.
    """
    wrapper = inner_of(maker)
    if wrapper is None or not isinstance(maker, ast.FunctionDef) or maker.decorator_list:
        return None
    match list_arguments(maker.args), wrapper.decorator_list:
        case [ast.arg(arg=name)], [ast.Call(func=mark, args=[ast.Name(id=same)])] if name == same:
            nodes, own = list_nodes([maker]), [*own_nodes(wrapper)]
        case _:
            return None
    stars = {id(wrapper.args.vararg): '*', id(wrapper.args.kwarg): '**'}
    given = {arg.arg: stars.get(id(arg), '') for arg in list_arguments(wrapper.args)}
    text = f'{name}({", ".join(star + argument for argument, star in given.items())})'
    calls = [node for node in own if isinstance(node, ast.Call) and ast.unparse(node) == text]
    logged = [node for node in nodes if isinstance(node, ast.Attribute) and node.attr in _LOGGED]
    known = {id(part) for part in list_nodes(calls)} | {id(node.value) for node in logged}
    used = [node for node in nodes if id(node) not in known]
    left = Counter(key for node in used for key in bound_names(node) or [getattr(node, 'id', '')])
    # Each is left as a parameter, and the function as the argument of `functools.wraps`.
    is_plain = calls and all(left[each] == 1 + (each == name) for each in (name, *given))
    if not is_plain or wrapper.args.defaults or wrapper.args.kwonlyargs or any(map(_catches, own)):
        return None
    returned = [node.value for node in own if isinstance(node, ast.Return)]
    returned += [node.value for node in returned if isinstance(node, ast.Await)]
    return wrapper, mark, all(call in returned for call in calls)


def _catches(node: ast.AST) -> bool:
    # A `return` in a `finally` drops the error.
    drops = any(isinstance(part, _WAYS_OUT) for part in list_nodes(getattr(node, 'finalbody', ())))
    raises = any(isinstance(part, ast.Raise) for part in ast.walk(node))
    return drops or (isinstance(node, ast.ExceptHandler | ast.With | ast.AsyncWith) and not raises)


def is_none(expression: ast.expr | None) -> bool:
    """Return whether an expression is `None`, or is missing."""
    return expression is None or (
        isinstance(expression, ast.Constant) and expression.value is None
    )


def owner_of(node: ast.expr) -> ast.expr:
    """Return what `a` is in `a.b` and `a[0].c`."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        node = node.value
    return node


def words_in(*nodes: ast.AST | None) -> set[str]:
    """Return the names and attributes in expressions."""
    inner = [each for node in nodes if node is not None for each in ast.walk(node)]
    return {
        each.id if isinstance(each, ast.Name) else each.attr
        for each in inner
        if isinstance(each, ast.Name | ast.Attribute)
    }


def count_characters(line: str, offset: int) -> int:
    """Return how many characters the first bytes of a line are."""
    return offset if line.isascii() else len(line.encode()[:offset].decode(errors='ignore'))


def count_tokens(content: bytes, path: Path, most: int) -> int:
    """Return how many words and signs a source has, which is what its syntax tree grows with.

    Raises:
        UnreadModuleError: They are more than a module may have, or than `most`.
    """
    enough = min(MAX_MODULE_TOKENS, most) + 1
    count = sum(1 for _ in islice(_TOKEN.finditer(content), enough))
    if count > MAX_MODULE_TOKENS:
        message = f'{path} has more than {MAX_MODULE_TOKENS:,} words and signs'
        raise UnreadModuleError(message)
    if count > most:
        message = f'{path} and the modules before it are too many to be read'
        raise UnreadModuleError(message)
    return count


def parse_source(content: bytes, path: Path) -> ast.Module:
    """Return the syntax tree of a module.

    Raises:
        SyntaxError: It is not valid Python.
        ValueError: As `SyntaxError`, of what Python does not even tokenize.
        RecursionError: As `SyntaxError`: Python itself cannot read what nests so deep.
        MemoryError: Likewise.
        UnreadModuleError: It is valid, and nests too deep.
    """
    try:
        tree = ast.parse(content, str(path))
    except (RecursionError, MemoryError) as error:
        # Python may read what is too deep for a syntax tree.
        compile(content, str(path), 'exec', dont_inherit=True)
        message = f'{path} nests too deep'
        raise UnreadModuleError(message) from error
    few_code_objects = len(_CODE_OBJECT.findall(content)) <= _MOST_CODE_OBJECTS
    if few_code_objects and _measure(tree.body)[0] <= _MOST_COMPILED_NODES:
        # The compiler finds more errors than the parser, such as `return` outside a function.
        compile(content, str(path), 'exec', dont_inherit=True)
    return tree


def _measure(nodes: Iterable[ast.AST]) -> tuple[int, int]:
    """Return how many nodes the compiler makes of these, and how many ways lead out of them."""
    size = ways_out = 0
    pending = [*nodes]
    while pending:
        node = pending.pop()
        size += 1
        ways_out += isinstance(node, _WAYS_OUT)
        if isinstance(node, ast.Try | ast.TryStar) and node.finalbody:
            inner = _measure([*node.body, *node.handlers, *node.orelse])
            last = _measure(node.finalbody)
            copies = 2 + inner[1]
            size += inner[0] + last[0] * copies
            ways_out += inner[1] + last[1] * copies
        else:
            pending += list_children(node)
    return size, ways_out
