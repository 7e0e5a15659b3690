"""Read Python modules without importing them."""

from __future__ import annotations

import ast
import copy
import inspect
import re
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import SourceFile, Span
from composer.input_limits import (
    MAX_MODULE_BYTES,
    MAX_MODULE_TOKENS,
    UnreadableFileError,
    read_file,
)
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.syntax import (
    SCOPES,
    FunctionNode,
    UnreadModuleError,
    bound_names,
    count_characters,
    count_tokens,
    imported_names,
    list_children,
    list_nodes,
    own_nodes,
    parse_source,
    positional_names,
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable

# Longer lines of classes are not followed.
MOST_BASES = 20
_LINE_END = re.compile(r'\r\n?|\n')
_STATEMENTS = (ast.stmt, ast.ExceptHandler, ast.match_case)
_BINDING = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


@record
class FunctionSource:
    """A function of a module.

    Attributes:
        definition: Its syntax tree; `None` if only running the module could tell what it is.
        class_definition: The syntax tree of a class, which can be called as well.
        first: The name of the parameter that a method has without being given it.
    """

    definition: FunctionNode | None = None
    class_definition: ast.ClassDef | None = None
    first: str = ''

    @cached_property
    def kind(self) -> FunctionKind | None:
        """What it returns, if that is known."""
        if self.definition is None:
            return None
        yields = self.first_yield is not None
        if isinstance(self.definition, ast.AsyncFunctionDef):
            return FunctionKind.ASYNC_GENERATOR if yields else FunctionKind.COROUTINE
        return FunctionKind.GENERATOR if yields else FunctionKind.PLAIN

    @cached_property
    def first_yield(self) -> int | None:
        """The line of its first `yield`, if it has one."""
        nodes = own_nodes(self.definition) if self.definition else ()
        lines = [node.lineno for node in nodes if isinstance(node, ast.Yield | ast.YieldFrom)]
        return min(lines, default=None)

    @cached_property
    def signature(self) -> inspect.Signature | None:
        """Its parameters, if they are known."""
        if self.class_definition:
            return _read_constructor(self.class_definition)
        return read_signature(self.definition.args) if self.definition else None


class TopNames:
    """The names that the statements of a module store, each with whether on a condition.

    Attributes:
        is_open: Whether there may be others.
    """

    def __init__(self, body: Iterable[ast.stmt] = ()) -> None:
        self.statements: dict[str, list[tuple[ast.AST, bool]]] = {}
        self.is_open = False
        self._body = list(body)
        pending: list[tuple[ast.AST, ast.AST, bool]]
        pending = [(statement, statement, False) for statement in reversed(self._body)]
        while pending:
            node, statement, is_conditional = pending.pop()
            for name in bound_names(node):
                self.statements.setdefault(name, []).append((statement, is_conditional))
                self.is_open |= name in ('*', '__getattr__')
            self.is_open |= _may_store_any(node)
            for child in () if isinstance(node, SCOPES) else reversed(list_children(node)):
                if isinstance(child, _STATEMENTS):
                    pending.append((child, child, True))
                elif not isinstance(child, ast.comprehension):
                    pending.append((child, statement, is_conditional))

    @cached_property
    def is_dynamic(self) -> bool:
        """Whether code may store any name: `globals()['x'] = 1`, `exec`, `sys.modules`."""
        return any(map(_may_store_any, self._nodes))

    @cached_property
    def stored_again(self) -> frozenset[str]:
        """Names that functions store, and those of which items are stored."""
        found: set[str] = set()
        for node in self._nodes:
            match node:
                case ast.Global(names=names):
                    found |= set(names)
                case ast.Subscript(value=ast.Name(id=name), ctx=ast.Store() | ast.Del()):
                    found.add(name)
                case ast.AugAssign(target=ast.Name(id=name)):
                    found.add(name)
        return frozenset(found)

    @cached_property
    def stored_attributes(self) -> Counter[str]:
        """How often code stores attributes, by their names; empty for one that is computed."""
        return _stored_attributes(self._nodes)

    @cached_property
    def _nodes(self) -> list[ast.AST]:
        return list_nodes(self._body)


def _may_store_any(node: ast.AST) -> bool:
    match node:
        case ast.Call(func=ast.Name('exec' | 'eval' | 'globals' | 'locals' | 'vars')):
            return True
        case ast.Attribute(attr='modules' | '__dict__') | ast.alias(name='modules'):
            return True
        case ast.Call(func=ast.Name('setattr'), args=[ast.Name(), key, _]):
            return not isinstance(key, ast.Constant)
    return False


def _stored_attributes(nodes: Iterable[ast.AST]) -> Counter[str]:
    found: Counter[str] = Counter()
    for node in nodes:
        match node:
            case ast.Attribute(attr='__dict__' | '__setattr__') | ast.Name(id='vars'):
                found[''] += 1
            case ast.Attribute(attr=name, ctx=ast.Store()):
                found[name] += 1
            case ast.Call(func=ast.Name('setattr'), args=[_, ast.Constant(str(name)), _]):
                found[name] += 2
            case ast.Call(func=ast.Name('setattr'), args=[ast.Name(), *_]):
                found[''] += 1
    return found


@dataclass(eq=False)
class ModuleSource:
    """The names that a module defines.

    Attributes:
        is_open: Whether it may have further names (star imports, `__getattr__`, no source).
        error_line: The line of this error, counted from 1, if it is known.
        unread: Why its source is not read although it may be valid, or `None`.
        tokens: How many words and signs it has.
        content: Its source, if it was read and is valid.
    """

    path: Path | None
    lines: tuple[str, ...] = ()
    is_open: bool = False
    syntax_error: str | None = None
    error_line: int | None = None
    unread: str | None = None
    tokens: int = 0
    body: tuple[ast.stmt, ...] = field(default=(), repr=False)
    top: TopNames = field(default_factory=TopNames, repr=False)
    content: bytes | None = field(default=None, repr=False)

    @property
    def is_package(self) -> bool:
        """Whether it is the `__init__.py` of a package."""
        return self.path is not None and self.path.name == '__init__.py'

    @cached_property
    def functions(self) -> dict[str, FunctionSource]:
        """The names that can be called, or perhaps can."""
        meanings = self._meanings.items()
        return {name: what for name, what in meanings if isinstance(what, FunctionSource)}

    @cached_property
    def constants(self) -> dict[str, str]:
        """The names that cannot be called, and what they are."""
        return {name: what for name, what in self._meanings.items() if isinstance(what, str)}

    @cached_property
    def imports(self) -> dict[str, str]:
        """The full dotted names of what is imported, by names that have one meaning.

        Imports for type checkers count as well.
        """
        meanings = {
            name: {dict(imported_names(node)).get(name, '') for node, _ in statements}
            for name, statements in self.top.statements.items()
        }
        return {name: full for name, (full, *others) in meanings.items() if full and not others}

    @cached_property
    def _meanings(self) -> dict[str, FunctionSource | str]:
        """What each name is; of one that a conditional statement binds again, nothing is known."""
        found: dict[str, FunctionSource | str] = {}
        for name, statements in self.top.statements.items():
            for node, is_conditional in statements:
                meaning = _meaning_of(node, name)
                if meaning is not None and name != '*':
                    is_either = is_conditional and name in found
                    found[name] = FunctionSource() if is_either else meaning
        return found

    def find_function(self, name: str) -> FunctionSource | None:
        """Return a function by its name, or a method as `Class.method`, without its `self`."""
        owner, _, method = name.rpartition('.')
        if not owner:
            return self.functions.get(name)
        of = self.functions.get(owner)
        if of is None or of.definition is not None:
            return None
        return self._find_method(of, method, MOST_BASES)

    def _find_method(self, of: FunctionSource, name: str, depth: int) -> FunctionSource | None:
        """Return a method of a class; one that nobody knows if it may have others than these."""
        definition = of.class_definition
        if definition is None or not depth:
            return FunctionSource()
        own = [each for each in definition.body if getattr(each, 'name', '') == name]
        if own and isinstance(own[-1], ast.FunctionDef | ast.AsyncFunctionDef):
            return _as_method(own[-1])
        is_bound = any(name in bound_names(node) for node in ast.walk(definition))
        if is_bound or definition.decorator_list or definition.keywords:
            return FunctionSource()
        for base in definition.bases:
            simple = base.id if isinstance(base, ast.Name) else ''
            if simple == 'object':
                continue
            known = self.functions.get(simple)
            found = self._find_method(known or FunctionSource(), name, depth - 1)
            if found is not None:
                return found
        return None

    @cached_property
    def source(self) -> SourceFile:
        """Its text; the path is relative to the current folder if possible."""
        path, here = self.path or Path(), Path.cwd()
        name = str(path.relative_to(here) if path.is_relative_to(here) else path)
        return SourceFile(name, self.lines)

    @cached_property
    def import_statements(self) -> list[ast.Import | ast.ImportFrom]:
        """All statements that import something, also in functions."""
        nodes = list_nodes(self.body)
        return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]

    def place_of(self, line: int) -> Span:
        """Return the span of a line."""
        text = self.source.line(line)
        return Span(
            self.source, line, len(text) - len(text.lstrip()) + 1, max(len(text.strip()), 1)
        )

    def span_of(self, node: ast.AST, name: str = '') -> Span:
        """Return the characters of an expression on its last line; of a text, its content.

        Args:
            name: What to mark in it: the text, or the last name of a chain of attributes.
        """
        first_line: int = getattr(node, 'lineno', 1)
        line: int = getattr(node, 'end_lineno', first_line)
        start: int = getattr(node, 'col_offset', 0) if first_line == line else 0
        end: int = getattr(node, 'end_col_offset', None) or start + 1
        if isinstance(node, ast.Attribute):
            name = node.attr
        elif isinstance(node, ast.keyword) and node.arg:
            line, start, end = (
                first_line,
                node.col_offset,
                node.col_offset + len(node.arg.encode()),
            )
        elif isinstance(node, _BINDING):
            line, name = first_line, node.name
            start, end = 0, len(self.source.line(line).encode())
        text = self.source.line(line)
        first, last = count_characters(text, start), count_characters(text, end)
        found = text[first:last].rfind(name) if name else -1
        if found >= 0:
            first += found
            last = first + len(name)
        return Span(self.source, line, first + 1, max(last - first, 1))


def read_module(
    path: Path, most_tokens: int = MAX_MODULE_TOKENS, before: ModuleSource | None = None
) -> ModuleSource:
    """Read a module; none of its code runs.

    Args:
        most_tokens: How many words and signs it may have.
        before: The module as it was read before; it is kept if its source is the same.
    """
    if path.suffix != '.py':
        return ModuleSource(path, is_open=True)
    lines: tuple[str, ...] = ()
    try:
        text = read_file(path, MAX_MODULE_BYTES)
        if before is not None and before.content == text and before.tokens <= most_tokens:
            return before
        tokens = count_tokens(text, path, most_tokens)
        # A form feed ends no line.
        lines = tuple(_LINE_END.split(text.decode(errors='replace').removesuffix('\n')))
        tree = parse_source(text, path)
    except UnreadableFileError as error:
        if error.is_too_large:
            return ModuleSource(path, is_open=True, unread=f'{path}: {error}')
        return ModuleSource(path, syntax_error=f'{path}: {error}')
    except UnreadModuleError as error:
        return ModuleSource(path, is_open=True, unread=str(error))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, 'lineno', None)
        where = f'{path}:{line}' if line else str(path)
        reason = f'{where}: {getattr(error, "msg", error)}'
        return ModuleSource(path, lines=lines, syntax_error=reason, error_line=line)
    body, top = tuple(tree.body), TopNames(tree.body)
    return ModuleSource(path, lines, top.is_open, tokens=tokens, body=body, top=top, content=text)


def _meaning_of(statement: ast.AST, name: str) -> FunctionSource | str | None:
    """Return what a statement makes of a name: something to call, or what else."""
    match statement:
        case ast.FunctionDef() | ast.AsyncFunctionDef():
            # Decorators may change both kind and signature.
            return FunctionSource(None if statement.decorator_list else statement)
        case ast.ClassDef():
            return FunctionSource(class_definition=statement)
        case ast.Import():
            return 'a module'
        case ast.AnnAssign(value=None):
            return None
        case ast.Assign() | ast.AnnAssign() if isinstance(statement.value, ast.Constant):
            targets = getattr(statement, 'targets', [getattr(statement, 'target', None)])
            if any(isinstance(each, ast.Name) and each.id == name for each in targets):
                return _describe_constant(statement.value.value)
    return FunctionSource()


def _as_method(node: FunctionNode) -> FunctionSource:
    """Return a function of a class as it is called: without its first parameter."""
    decorators = [ast.unparse(each) for each in node.decorator_list]
    if decorators == ['staticmethod']:
        return FunctionSource(node)
    if decorators not in ([], ['classmethod']):
        return FunctionSource()
    method, arguments = copy.copy(node), copy.copy(node.args)
    positional = [*arguments.posonlyargs, *arguments.args][1:]
    by_position = max(len(arguments.posonlyargs) - 1, 0)
    arguments.posonlyargs, arguments.args = positional[:by_position], positional[by_position:]
    arguments.defaults = arguments.defaults[-len(positional) :] if positional else []
    method.args = arguments
    return FunctionSource(method, first=(positional_names(node) or [''])[0])


def _describe_constant(value: object) -> str:
    kind = type(value).__name__
    try:
        return f'the {kind} {value!r}'
    except ValueError:
        # Python does not write numbers of thousands of digits.
        return f'an {kind}'


def _read_constructor(definition: ast.ClassDef) -> inspect.Signature | None:
    """Return the parameters of a plain class, `None` if others may decide about them."""
    if definition.bases or definition.keywords or definition.decorator_list:
        return None
    bound = [name for node in ast.walk(definition) for name in bound_names(node)]
    functions = (each for each in definition.body if isinstance(each, ast.FunctionDef))
    makers = [each for each in functions if each.name == '__init__']
    if '__new__' in bound or bound.count('__init__') != len(makers):
        return None
    if not makers:
        return inspect.Signature()
    if len(makers) > 1 or makers[0].decorator_list:
        return None
    signature = read_signature(makers[0].args)
    return signature.replace(parameters=list(signature.parameters.values())[1:])


def read_signature(arguments: ast.arguments) -> inspect.Signature:
    """Return how a function with these parameters is called."""
    positional = [*arguments.posonlyargs, *arguments.args]
    optional = {*positional[len(positional) - len(arguments.defaults) :]}
    pairs = zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
    optional |= {argument for argument, default in pairs if default is not None}
    kinds = (
        (inspect.Parameter.POSITIONAL_ONLY, arguments.posonlyargs),
        (inspect.Parameter.POSITIONAL_OR_KEYWORD, arguments.args),
        (inspect.Parameter.VAR_POSITIONAL, filter(None, [arguments.vararg])),
        (inspect.Parameter.KEYWORD_ONLY, arguments.kwonlyargs),
        (inspect.Parameter.VAR_KEYWORD, filter(None, [arguments.kwarg])),
    )
    empty = inspect.Parameter.empty
    return inspect.Signature(
        [
            inspect.Parameter(
                argument.arg,
                kind,
                default=... if argument in optional else empty,
                annotation=_text_of(argument.annotation) or empty,
            )
            for kind, of_kind in kinds
            for argument in of_kind
        ]
    )


def _text_of(annotation: ast.expr | None) -> str:
    # One that nests too deep means as much as none.
    with suppress(RecursionError):
        return ast.unparse(annotation) if annotation else ''
    return ''
