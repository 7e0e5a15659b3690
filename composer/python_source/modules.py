"""Read Python modules without importing them."""

from __future__ import annotations

import ast
import copy
import inspect
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
from composer.python_source.local_names import nested_names, stored_names
from composer.python_source.syntax import (
    BLOCKS,
    FunctionNode,
    UnreadModuleError,
    count_tokens,
    list_children,
    list_nodes,
    parse_source,
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

# Longer lines of classes are not followed.
MOST_BASES = 20
_OWN_SCOPE = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)


@record
class FunctionSource:
    """A function of a module.

    Attributes:
        definition: Its syntax tree; `None` if only running the module could tell what it is.
        class_definition: The syntax tree of a class, which can be called as well.
    """

    definition: FunctionNode | None = None
    class_definition: ast.ClassDef | None = None

    @cached_property
    def kind(self) -> FunctionKind | None:
        """What it returns, if that is known."""
        return _kind_of(self.definition) if self.definition else None

    @cached_property
    def first_yield(self) -> int | None:
        """The line of its first `yield`, if it has one."""
        nodes = _own_nodes(self.definition) if self.definition else []
        lines = [node.lineno for node in nodes if isinstance(node, ast.Yield | ast.YieldFrom)]
        return min(lines, default=None)

    @cached_property
    def signature(self) -> inspect.Signature | None:
        """Its parameters, if they are known."""
        if self.class_definition:
            return _read_constructor(self.class_definition)
        return read_signature(self.definition.args) if self.definition else None


@dataclass(eq=False)
class ModuleSource:
    """The names that a module defines.

    Attributes:
        functions: The names that can be called, or perhaps can.
        constants: The names that cannot be called, and what they are.
        imports: The full dotted names of what is imported, by name; without names that have
            several meanings, and with imports for type checkers.
        texts: The constants that are texts, with these.
        required: The imports that are run on no condition.
        lines: The lines of its source.
        is_open: Whether it may have further names (star imports, `__getattr__`, no source).
        syntax_error: The syntax error in its source, or `None`.
        error_line: The line of this error, counted from 1, if it is known.
        unread: Why its source is not read although it may be valid, or `None`.
        tokens: How many words and signs it has.
        body: Its statements.
        content: Its source, if it was read and is valid.
    """

    path: Path | None
    functions: dict[str, FunctionSource] = field(default_factory=dict)
    constants: dict[str, str] = field(default_factory=dict)
    imports: dict[str, str] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    required: tuple[ast.Import | ast.ImportFrom, ...] = ()
    lines: tuple[str, ...] = ()
    is_open: bool = False
    syntax_error: str | None = None
    error_line: int | None = None
    unread: str | None = None
    tokens: int = 0
    body: tuple[ast.stmt, ...] = field(default=(), repr=False)
    content: bytes | None = field(default=None, repr=False)

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
        nodes = list(ast.walk(definition))
        if name in {each.id for each in stored_names(nodes)} | nested_names(nodes):
            return FunctionSource()
        if definition.decorator_list or definition.keywords:
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
        lines = tuple(text.decode(errors='replace').splitlines())
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
    reader = _ModuleReader()
    reader.read(tree.body)
    return ModuleSource(
        path,
        reader.functions,
        reader.constants,
        {name: full_name for name, full_name in reader.imports.items() if full_name},
        {name: text for name, text in find_texts(tree.body).items() if name in reader.constants},
        tuple(reader.required),
        lines,
        reader.is_open,
        tokens=tokens,
        body=tuple(tree.body),
        content=text,
    )


def find_texts(body: list[ast.stmt], nodes: Iterable[ast.AST] | None = None) -> dict[str, str]:
    """Return the names that statements assign only one text, with that text.

    Args:
        nodes: All nodes of the statements, if they are at hand.
    """
    texts = {name: text for statement in body for name, text in _read_text(statement)}
    if not texts:
        return {}
    if nodes is None:
        nodes = list_nodes(body)
    stored = Counter(name.id for name in stored_names(nodes))
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
        self.required: list[ast.Import | ast.ImportFrom] = []
        self.is_open = False
        self._is_conditional = False

    def read(self, body: list[ast.stmt]) -> None:
        pending: list[tuple[ast.AST, bool]] = [(each, False) for each in reversed(body)]
        while pending:
            statement, self._is_conditional = pending.pop()
            inner = self._read_statement(statement)
            pending += [(each, True) for each in reversed(inner)]

    def _read_statement(self, statement: ast.AST) -> list[ast.AST]:
        """Read a statement; return those in it that are run on a condition."""
        if isinstance(statement, ast.FunctionDef | ast.AsyncFunctionDef):
            self.is_open |= statement.name == '__getattr__'
            # Decorators may change both kind and signature.
            known = None if statement.decorator_list else statement
            self._bind(statement.name, FunctionSource(known))
        elif isinstance(statement, ast.ClassDef):
            self._bind(statement.name, FunctionSource(class_definition=statement))
        elif isinstance(statement, ast.Import | ast.ImportFrom):
            self._read_import(statement)
        elif isinstance(statement, ast.Assign | ast.AnnAssign):
            self._read_assignment(statement)
        else:
            self._read_stores(statement)
            blocks = (getattr(statement, name, ()) for name in BLOCKS)
            return [each for block in blocks for each in block]
        return []

    def _read_stores(self, statement: ast.AST) -> None:
        """Read the names that a statement stores beside those of the statements in it."""
        pending = [statement]
        while pending:
            node = pending.pop()
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                self._bind(node.id, FunctionSource())
            # Names may be stored in `globals()` or `sys.modules[__name__]`.
            is_open = isinstance(node, ast.Name) and node.id in ('globals', 'vars', 'exec')
            is_module = isinstance(node, ast.Attribute) and node.attr == 'modules'
            self.is_open |= is_open or is_module
            if not isinstance(node, _OWN_SCOPE):
                pending += [
                    each
                    for each in list_children(node)
                    if not isinstance(each, ast.stmt | ast.ExceptHandler | ast.match_case)
                ]

    def _read_import(self, statement: ast.Import | ast.ImportFrom) -> None:
        if not self._is_conditional:
            self.required.append(statement)
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
        if value is not None:
            self._read_stores(value)
        for target in targets:
            if not isinstance(target, ast.Name):
                self._read_stores(target)
            # Of something that may be this module: `sys.modules[__name__].run = walk`.
            if isinstance(target, ast.Attribute) and target.attr in self.functions:
                self._bind(target.attr, FunctionSource())
        for target in targets:
            for node in ast.walk(target):
                if not isinstance(node, ast.Name):
                    continue
                if isinstance(value, ast.Constant) and node is target:
                    self._constant(node.id, _describe_constant(value.value))
                elif value is not None:
                    self._bind(node.id, FunctionSource())

    def _bind(self, name: str, function: FunctionSource, full_name: str = '') -> None:
        if self._is_conditional and (name in self.functions or name in self.constants):
            function = FunctionSource()
        self._note_import(name, full_name)
        self.constants.pop(name, None)
        self.functions[name] = function

    def _constant(self, name: str, what: str, full_name: str = '') -> None:
        if self._is_conditional and name in self.functions:
            self._bind(name, FunctionSource(), full_name)
            return
        self._note_import(name, full_name)
        self.functions.pop(name, None)
        self.constants[name] = what

    def _note_import(self, name: str, full_name: str) -> None:
        """Store the meaning of a name; a name with several meanings has none."""
        if self.imports.setdefault(name, full_name) != full_name:
            self.imports[name] = ''


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
    return FunctionSource(method)


def _describe_constant(value: object) -> str:
    kind = type(value).__name__
    try:
        return f'the {kind} {value!r}'
    except ValueError:
        # Python does not write numbers of thousands of digits.
        return f'an {kind}'


def _kind_of(node: FunctionNode) -> FunctionKind:
    yields = any(isinstance(inner, ast.Yield | ast.YieldFrom) for inner in _own_nodes(node))
    if isinstance(node, ast.AsyncFunctionDef):
        return FunctionKind.ASYNC_GENERATOR if yields else FunctionKind.COROUTINE
    return FunctionKind.GENERATOR if yields else FunctionKind.PLAIN


def _own_nodes(function: FunctionNode) -> list[ast.AST]:
    """Return the nodes of a function's body without those of functions inside it."""
    found: list[ast.AST] = []
    pending: list[ast.AST] = list(function.body)
    while pending:
        node = pending.pop()
        found.append(node)
        if not isinstance(node, _OWN_SCOPE):
            pending += list_children(node)
    return found


def _read_constructor(definition: ast.ClassDef) -> inspect.Signature | None:
    """Return the parameters of a plain class, `None` if others may decide about them."""
    if definition.bases or definition.keywords or definition.decorator_list:
        return None
    names = {name.id for name in stored_names(ast.walk(definition))}
    inner = nested_names(ast.walk(definition))
    if '__new__' in names | inner or '__init__' in names:
        return None
    functions = (each for each in definition.body if isinstance(each, ast.FunctionDef))
    makers = [each for each in functions if each.name == '__init__']
    if not makers:
        return None if '__init__' in inner else inspect.Signature()
    if len(makers) > 1 or makers[0].decorator_list:
        return None
    signature = read_signature(makers[0].args)
    return signature.replace(parameters=list(signature.parameters.values())[1:])


def read_signature(arguments: ast.arguments) -> inspect.Signature:
    """Return how a function with these parameters is called."""
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
    annotation: object = inspect.Parameter.empty
    # One that nests too deep means as much as none.
    with suppress(RecursionError):
        annotation = ast.unparse(argument.annotation) if argument.annotation else annotation
    return inspect.Parameter(
        argument.arg,
        kind,  # type: ignore[arg-type]
        default=default,
        annotation=annotation,
    )
