"""Read Python modules without importing them."""

from __future__ import annotations

import ast
import inspect
from collections import Counter
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from composer.diagnostics import SourceFile, Span

if TYPE_CHECKING:
    from collections.abc import Iterator

FunctionNode: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
_OWN_SCOPE = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)


class FunctionKind(Enum):
    """What a call of a function returns: a value, a generator or a coroutine."""

    PLAIN = 'function'
    GENERATOR = 'generator function'
    COROUTINE = 'async function'
    ASYNC_GENERATOR = 'async generator function'

    @property
    def is_generator(self) -> bool:
        """Whether it yields."""
        return self in (FunctionKind.GENERATOR, FunctionKind.ASYNC_GENERATOR)


@dataclass(frozen=True, slots=True)
class FunctionSource:
    """A function of a module.

    Attributes:
        kind: `None` if only running the module could tell it; `signature` likewise.
        definition: Its syntax tree, or `None` likewise.
    """

    kind: FunctionKind | None = None
    signature: inspect.Signature | None = None
    definition: FunctionNode | None = None


@dataclass(frozen=True, slots=True)
class ModuleSource:
    """The names that a module defines.

    Attributes:
        functions: The names that can be called, or perhaps can.
        constants: The names that cannot be called, and what they are.
        imports: The full dotted names of what is imported, by name; without names that have
            several meanings, and with imports for type checkers.
        texts: The constants that are texts, with these.
        lines: The lines of its source.
        is_open: Whether it may have further names (star imports, `__getattr__`, no source).
        syntax_error: The syntax error in its source, or `None`.
        error_line: The line of this error, counted from 1, if it is known.
    """

    path: Path | None
    functions: dict[str, FunctionSource] = field(default_factory=dict)
    constants: dict[str, str] = field(default_factory=dict)
    imports: dict[str, str] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    lines: tuple[str, ...] = ()
    is_open: bool = False
    syntax_error: str | None = None
    error_line: int | None = None

    def place_of(self, line: int) -> Span:
        """Return the span of a line; its path is relative to the current folder if possible."""
        path, here = self.path or Path(), Path.cwd()
        name = str(path.relative_to(here) if path.is_relative_to(here) else path)
        source = SourceFile(name, self.lines)
        text = source.line(line)
        return Span(source, line, len(text) - len(text.lstrip()) + 1, max(len(text.strip()), 1))


def read_module(path: Path) -> ModuleSource:
    """Read a module; none of its code runs."""
    if path.suffix != '.py':
        return ModuleSource(path, is_open=True)
    lines: tuple[str, ...] = ()
    try:
        text = path.read_bytes()
        lines = tuple(text.decode(errors='replace').splitlines())
        tree = ast.parse(text, str(path))
        # The compiler finds more errors than the parser, such as `return` outside a function.
        compile(tree, str(path), 'exec', dont_inherit=True)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, 'lineno', None)
        where = f'{path}:{line}' if line else str(path)
        reason = f'{where}: {getattr(error, "msg", error)}'
        return ModuleSource(path, lines=lines, syntax_error=reason, error_line=line)
    except OSError as error:
        return ModuleSource(path, syntax_error=f'{path}: {error.strerror}')
    reader = _ModuleReader()
    reader.read(tree.body)
    return ModuleSource(
        path,
        reader.functions,
        reader.constants,
        {name: full_name for name, full_name in reader.imports.items() if full_name},
        {name: text for name, text in find_texts(tree.body).items() if name in reader.constants},
        lines,
        reader.is_open,
    )


def find_texts(body: list[ast.stmt]) -> dict[str, str]:
    """Return the names that statements assign only one text, with that text."""
    texts = {name: text for statement in body for name, text in _read_text(statement)}
    if not texts:
        return {}
    nodes = [node for statement in body for node in ast.walk(statement)]
    stored = Counter(
        node.id
        for node in nodes
        if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load)
    )
    return {name: text for name, text in texts.items() if stored[name] == 1}


def _read_text(statement: ast.stmt) -> Iterator[tuple[str, str]]:
    if isinstance(statement, ast.Assign):
        targets: list[ast.expr] = statement.targets
        value: ast.expr | None = statement.value
    elif isinstance(statement, ast.AnnAssign):
        targets, value = [statement.target], statement.value
    else:
        return
    if isinstance(value, ast.Constant) and isinstance(value.value, str):
        yield from ((each.id, value.value) for each in targets if isinstance(each, ast.Name))


class _ModuleReader:
    """Collects the names that the statements of a module bind.

    Later ones win; of a name that a conditional statement binds again, nothing is known.
    """

    def __init__(self) -> None:
        self.functions: dict[str, FunctionSource] = {}
        self.constants: dict[str, str] = {}
        self.imports: dict[str, str] = {}
        self.is_open = False
        self._conditions = 0

    def read(self, body: list[ast.stmt]) -> None:
        for statement in body:
            self._read_statement(statement)

    def _read_statement(self, statement: ast.stmt) -> None:
        if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
            self.is_open |= statement.name == '__getattr__'
            self._bind(statement.name, describe_function(statement))
        elif isinstance(statement, ast.ClassDef):
            self._bind(statement.name, FunctionSource())
        elif isinstance(statement, ast.Import | ast.ImportFrom):
            self._read_import(statement)
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            self._read_assignment(statement)
        else:
            self._conditions += 1
            for name in ('body', 'handlers', 'cases', 'orelse', 'finalbody'):
                for inner in getattr(statement, name, ()):
                    is_block = isinstance(inner, ast.ExceptHandler | ast.match_case)
                    self.read(inner.body if is_block else [inner])
            self._conditions -= 1

    def _read_import(self, statement: ast.Import | ast.ImportFrom) -> None:
        for alias in statement.names:
            if alias.name == '*':
                self.is_open = True
            elif isinstance(statement, ast.Import):
                name = (alias.asname or alias.name).partition('.')[0]
                self._constant(name, 'a module', alias.name if alias.asname else name)
            else:
                within = '' if statement.level else statement.module
                full_name = f'{within}.{alias.name}' if within else ''
                self._bind(alias.asname or alias.name, FunctionSource(), full_name)

    def _read_assignment(self, statement: ast.Assign | ast.AnnAssign) -> None:
        targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
        value = statement.value
        for target in targets:
            for node in ast.walk(target):
                if not isinstance(node, ast.Name):
                    continue
                if isinstance(value, ast.Constant) and node is target:
                    self._constant(node.id, f'the {type(value.value).__name__} {value.value!r}')
                elif value is not None:
                    self._bind(node.id, FunctionSource())

    def _bind(self, name: str, function: FunctionSource, full_name: str = '') -> None:
        if self._conditions and (name in self.functions or name in self.constants):
            function = FunctionSource()
        self._note_import(name, full_name)
        self.constants.pop(name, None)
        self.functions[name] = function

    def _constant(self, name: str, what: str, full_name: str = '') -> None:
        if self._conditions and name in self.functions:
            self._bind(name, FunctionSource(), full_name)
            return
        self._note_import(name, full_name)
        self.functions.pop(name, None)
        self.constants[name] = what

    def _note_import(self, name: str, full_name: str) -> None:
        """Store the meaning of a name; a name with several meanings has none."""
        if self.imports.setdefault(name, full_name) != full_name:
            self.imports[name] = ''


def describe_function(node: FunctionNode) -> FunctionSource:
    """Return the kind and signature of a function definition; decorators may change both."""
    if node.decorator_list:
        return FunctionSource()
    yields = any(isinstance(inner, ast.Yield | ast.YieldFrom) for inner in _own_nodes(node))
    if isinstance(node, ast.AsyncFunctionDef):
        kind = FunctionKind.ASYNC_GENERATOR if yields else FunctionKind.COROUTINE
    else:
        kind = FunctionKind.GENERATOR if yields else FunctionKind.PLAIN
    return FunctionSource(kind, _read_signature(node.args), node)


def _own_nodes(function: FunctionNode) -> list[ast.AST]:
    """Return the nodes of a function's body without those of functions inside it."""
    found: list[ast.AST] = []
    pending: list[ast.AST] = list(function.body)
    while pending:
        node = pending.pop()
        found.append(node)
        if not isinstance(node, _OWN_SCOPE):
            pending.extend(ast.iter_child_nodes(node))
    return found


def _read_signature(arguments: ast.arguments) -> inspect.Signature:
    positional = [
        *((argument, inspect.Parameter.POSITIONAL_ONLY) for argument in arguments.posonlyargs),
        *((argument, inspect.Parameter.POSITIONAL_OR_KEYWORD) for argument in arguments.args),
    ]
    required = len(positional) - len(arguments.defaults)
    parameters = [
        _parameter(argument, kind, optional=index >= required)
        for index, (argument, kind) in enumerate(positional)
    ]
    if arguments.vararg:
        parameters.append(_parameter(arguments.vararg, inspect.Parameter.VAR_POSITIONAL))
    parameters += [
        _parameter(argument, inspect.Parameter.KEYWORD_ONLY, optional=default is not None)
        for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
    ]
    if arguments.kwarg:
        parameters.append(_parameter(arguments.kwarg, inspect.Parameter.VAR_KEYWORD))
    return inspect.Signature(parameters)


def _parameter(argument: ast.arg, kind: object, *, optional: bool = False) -> inspect.Parameter:
    default = ... if optional else inspect.Parameter.empty
    annotation = ast.unparse(argument.annotation) if argument.annotation else None
    return inspect.Parameter(
        argument.arg,
        kind,  # type: ignore[arg-type]
        default=default,
        annotation=inspect.Parameter.empty if annotation is None else annotation,
    )
