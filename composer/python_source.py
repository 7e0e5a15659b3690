"""Python modules as they lie on disk, read without importing them."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import sys
from dataclasses import dataclass, field
from enum import Enum
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import TypeAlias

from composer.names import suggest

_PROJECT_MARKS = ('pyproject.toml', '.git')
_FunctionNode: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
_OWN_SCOPE = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda)


class FunctionKind(Enum):
    """How a function runs when it is called."""

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
        kind: `None` if it cannot be told without running the module.
        signature: `None` if it cannot be told without running the module.
    """

    kind: FunctionKind | None = None
    signature: inspect.Signature | None = None


@dataclass(frozen=True, slots=True)
class ModuleSource:
    """What a module's text says of its names.

    Attributes:
        functions: What can be called, or may be: its kind and signature where they can be told.
        constants: The names that cannot be called, and what they are.
        is_open: Whether it may have further names (star imports, `__getattr__`, no source).
        syntax_error: Why its text is not Python, or `None`.
    """

    path: Path | None
    functions: dict[str, FunctionSource] = field(default_factory=dict)
    constants: dict[str, str] = field(default_factory=dict)
    is_open: bool = False
    syntax_error: str | None = None


@dataclass(frozen=True, slots=True)
class MissingModule:
    """A module that is not there.

    Attributes:
        missing: The part of its name that was not found, as in `behaviours.greter`.
        nearest: The module that may have been meant.
    """

    missing: str
    nearest: str | None


def project_search_path(config: Path) -> list[Path]:
    """Return where a file's behaviours are sought before the installed packages.

    That is the folder the command runs in, then the file's folder and its parents up to the one
    with a `pyproject.toml` or `.git`; without such a one, the file's folder alone.
    """
    folder = config.resolve().parent
    lineage = [folder, *folder.parents]
    roots = [i for i, at in enumerate(lineage) if any((at / m).exists() for m in _PROJECT_MARKS)]
    chain = lineage[: roots[0] + 1] if roots else [folder]
    return list(dict.fromkeys([Path.cwd(), *chain]))


class ModuleFinder:
    """Finds and reads modules, each once."""

    def __init__(self, search_path: list[Path]) -> None:
        installed = [Path(entry) for entry in sys.path if entry]
        self._roots = list(dict.fromkeys([*search_path, *installed]))
        self._found: dict[str, ModuleSource | MissingModule] = {}

    def find(self, name: str) -> ModuleSource | MissingModule:
        """Return the module `package.module`, or what of its name is missing."""
        if name not in self._found:
            self._found[name] = self._find(name)
        return self._found[name]

    def _find(self, name: str) -> ModuleSource | MissingModule:
        folders = self._roots
        done: list[str] = []
        for part in name.split('.'):
            file, inner = _locate(part, folders)
            if file is None and not inner and not done:
                file, inner = _locate_with_importers(part)
            if file is None and not inner:
                return MissingModule('.'.join([*done, part]), self._nearest(part, done, folders))
            done.append(part)
            folders = inner
        return read_module(file) if file else ModuleSource(None)

    def _nearest(self, part: str, done: list[str], folders: list[Path]) -> str | None:
        near = suggest(part, {name for folder in folders for name in _list_modules(folder)})
        return '.'.join([*done, near]) if near else None


def read_module(path: Path) -> ModuleSource:
    """Return what the text of a module says; nothing of it is run."""
    if path.suffix != '.py':
        return ModuleSource(path, is_open=True)
    try:
        tree = ast.parse(path.read_bytes(), str(path))
        # The compiler finds what the parser lets pass: `return` outside a function, say.
        compile(tree, str(path), 'exec', dont_inherit=True)
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        line = getattr(error, 'lineno', None)
        where = f'{path}:{line}' if line else str(path)
        return ModuleSource(path, syntax_error=f'{where}: {getattr(error, "msg", error)}')
    except OSError as error:
        return ModuleSource(path, syntax_error=f'{path}: {error.strerror}')
    reader = _ModuleReader()
    reader.read(tree.body)
    return ModuleSource(path, reader.functions, reader.constants, reader.is_open)


class _ModuleReader:
    """Collects the names that the statements of a module bind.

    Later ones win; what a conditional statement binds again may be either.
    """

    def __init__(self) -> None:
        self.functions: dict[str, FunctionSource] = {}
        self.constants: dict[str, str] = {}
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
                self._constant((alias.asname or alias.name).partition('.')[0], 'a module')
            else:
                self._bind(alias.asname or alias.name, FunctionSource())

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

    def _bind(self, name: str, function: FunctionSource) -> None:
        if self._conditions and (name in self.functions or name in self.constants):
            function = FunctionSource()
        self.constants.pop(name, None)
        self.functions[name] = function

    def _constant(self, name: str, what: str) -> None:
        if self._conditions and name in self.functions:
            self._bind(name, FunctionSource())
            return
        self.functions.pop(name, None)
        self.constants[name] = what


def describe_function(node: _FunctionNode) -> FunctionSource:
    """Return the kind and signature of a function definition; decorators may change both."""
    if node.decorator_list:
        return FunctionSource()
    yields = any(isinstance(inner, ast.Yield | ast.YieldFrom) for inner in _own_nodes(node))
    if isinstance(node, ast.AsyncFunctionDef):
        kind = FunctionKind.ASYNC_GENERATOR if yields else FunctionKind.COROUTINE
    else:
        kind = FunctionKind.GENERATOR if yields else FunctionKind.PLAIN
    return FunctionSource(kind, _read_signature(node.args))


def _own_nodes(function: _FunctionNode) -> list[ast.AST]:
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


def _locate(part: str, folders: list[Path]) -> tuple[Path | None, list[Path]]:
    """Return the file of a module or package, and the folders of what lies inside it.

    As Python's path finder does: the first regular package or module wins, and folders without
    an `__init__.py` make one namespace package together.
    """
    portions: list[Path] = []
    for folder in folders:
        package = folder / part
        if _is_there(package / '__init__.py'):
            return package / '__init__.py', [package]
        for suffix in ('.py', *EXTENSION_SUFFIXES):
            if _is_there(module := folder / f'{part}{suffix}'):
                return module, []
        if _is_there(package, is_folder=True):
            portions.append(package)
    return None, portions


def _is_there(path: Path, *, is_folder: bool = False) -> bool:
    try:
        return path.is_dir() if is_folder else path.is_file()
    except OSError:
        # The name is too long, or the folder may not be searched.
        return False


def _locate_with_importers(part: str) -> tuple[Path | None, list[Path]]:
    """Ask Python's other importers, those of editable installs say, for a top-level name."""
    try:
        spec = importlib.util.find_spec(part)
    except (ImportError, ValueError, AttributeError):
        return None, []
    if spec is None:
        return None, []
    file = Path(spec.origin) if spec.origin else None
    return file, [Path(entry) for entry in spec.submodule_search_locations or ()]


def _list_modules(folder: Path) -> list[str]:
    try:
        entries = list(folder.iterdir())
    except OSError:
        return []
    names = [entry.stem for entry in entries if entry.suffix == '.py' or entry.is_dir()]
    return [name for name in names if name.isidentifier()]
