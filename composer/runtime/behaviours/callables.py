"""Behaviours as Python objects: imported by name, and what kind of function each is."""

from __future__ import annotations

import _thread
import importlib
import inspect
import select
import sys
import threading
import traceback
from contextlib import contextmanager
from functools import partial
from types import MethodType
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.errors import ComposerError
from composer.python_source.function_kinds import FunctionKind
from composer.records import record
from composer.runtime.behaviours.tracebacks import summarize

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path
    from types import ModuleType

    from composer.language.specs import BehaviourSpec

# How a function runs, and how it is called, where that can be known.
Shape: TypeAlias = 'tuple[FunctionKind | None, inspect.Signature | None]'


class BehaviourImportError(ComposerError):
    """A behaviour's module cannot be imported, or has no such function."""


class ImportAbandonedError(BaseException):
    """Raised in a thread that imports, to end it."""


def import_module(name: str) -> ModuleType:
    """Return a module.

    Raises:
        BehaviourImportError: The import fails, whatever the module's code raises.
    """
    before = _thread.start_new_thread, select.epoll, threading.get_ident
    try:
        return importlib.import_module(name)
    except BaseException as error:
        # Python raises Ctrl-C in the main thread; elsewhere it is the module that raises.
        if isinstance(error, ImportAbandonedError) or (
            isinstance(error, KeyboardInterrupt)
            and threading.current_thread() is threading.main_thread()
        ):
            raise
        where = _innermost_place(error)
        message = f"importing '{name}' raised {summarize(error)}{where}"
        raise BehaviourImportError(message) from error
    finally:
        _refuse_other_threads(name, before)


def _refuse_other_threads(name: str, before: tuple[object, object, Callable[[], int]]) -> None:
    """Refuse a module that has replaced the threads of Python: with others, ROS cannot run.

    Raises:
        BehaviourImportError: It has.
    """
    start, epoll, get_ident = before
    if (_thread.start_new_thread, getattr(select, 'epoll', None)) == (start, epoll):
        return
    if threading.current_thread() is not threading.main_thread():
        # The thread could not end.
        threading.get_ident = get_ident
    message = f"importing '{name}' replaced the threads of Python or select.epoll"
    advice = 'leave out monkey.patch_all() of gevent or eventlet: ROS needs those of Python'
    raise BehaviourImportError(message, help=advice)


def import_behaviour(spec: BehaviourSpec) -> Callable[..., Any]:
    """Return the function that a behaviour names.

    Raises:
        BehaviourImportError: The import fails; there is no such name in the module; or it cannot
            be called.
    """
    module = import_module(spec.module)
    if spec.class_name:
        return _import_method(module, spec)
    function = getattr(module, spec.function, None)
    if function is None:
        message = f"{spec.module} has no function '{spec.function}'"
        raise BehaviourImportError(message)
    if not callable(function):
        message = f"'{spec.name}' is a {type(function).__name__}, and cannot be called"
        raise BehaviourImportError(message)
    return function  # type: ignore[no-any-return]


@record
class Method:
    """A method of a class of which each node has one instance.

    It stands in the table of a system's behaviours; a node calls that of its own instance.
    """

    owner: type
    name: str

    def __call__(self, *_arguments: Any, **_named: Any) -> Any:
        """Refuse: only an instance has something to call."""
        message = f'{self.owner.__qualname__}.{self.name} has no instance'
        raise TypeError(message)

    def of(self, instance: object) -> Callable[..., Any]:
        """Return it as a function of an instance."""
        return getattr(instance, self.name)  # type: ignore[no-any-return]

    def stand_in(self) -> Callable[..., Any]:
        """Return a function that is called, and runs, as that of an instance."""
        found = inspect.getattr_static(self.owner, self.name)
        is_bound = inspect.isfunction(found)
        return MethodType(found, self.owner) if is_bound else getattr(self.owner, self.name)


def make_instance(owner: type, node: Any) -> Any:
    """Return an instance of a class, made with its node if it takes that."""
    signature = signature_of(owner)
    try:
        takes_node = signature is not None and bool(signature.bind(node))
    except TypeError:
        takes_node = False
    return owner(node) if takes_node else owner()


def _import_method(module: ModuleType, spec: BehaviourSpec) -> Callable[..., Any]:
    owner = getattr(module, spec.class_name, None)
    if not isinstance(owner, type):
        message = f"{spec.module} has no class '{spec.class_name}'"
        raise BehaviourImportError(message)
    if not callable(getattr(owner, spec.method_name, None)):
        message = f"{spec.module}:{spec.class_name} has no method '{spec.method_name}'"
        raise BehaviourImportError(message)
    return Method(owner, spec.method_name)


_ANY = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)


def kind_of(function: Callable[..., Any]) -> FunctionKind:
    """Return how a function runs; of an object with `__call__`, how that does."""
    target: Any = inspect.unwrap(_called(function))
    while isinstance(target, partial):
        target = inspect.unwrap(target.func)
    if not inspect.isroutine(target) and not inspect.isclass(target):
        target = type(target).__call__
    if inspect.isasyncgenfunction(target):
        return FunctionKind.ASYNC_GENERATOR
    if inspect.iscoroutinefunction(target):
        return FunctionKind.COROUTINE
    return FunctionKind.GENERATOR if inspect.isgeneratorfunction(target) else FunctionKind.PLAIN


def signature_of(function: Callable[..., Any]) -> inspect.Signature | None:
    """Return a function's signature; `None` for functions of C that have none."""
    function = _called(function)
    try:
        own = inspect.signature(function, follow_wrapped=False)
        # A wrapper that takes whatever comes passes it on.
        passes_on = all(each.kind in _ANY for each in own.parameters.values())
        return inspect.signature(function) if own.parameters and passes_on else own
    except (TypeError, ValueError):
        return None


def _called(function: Callable[..., Any]) -> Callable[..., Any]:
    return function.stand_in() if isinstance(function, Method) else function


@contextmanager
def project_on_path(search_path: list[Path]) -> Iterator[None]:
    """Import modules of the project before installed ones of the same name."""
    entries = [str(folder) for folder in search_path]
    sys.path[:0] = entries
    importlib.invalidate_caches()
    try:
        yield
    finally:
        for entry in entries:
            sys.path.remove(entry)


def _innermost_place(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith('<frozen importlib')]
    if isinstance(error, SyntaxError) and error.filename:
        return f' ({error.filename}:{error.lineno})'
    return f' ({own[-1].filename}:{own[-1].lineno})' if len(own) > 1 else ''


def shape_of(function: Callable[..., Any]) -> Shape:
    """Return how a function runs, and how it is called."""
    if isinstance(function, Method):
        function = function.stand_in()
    # What a wrapper returns may be something else than what it wraps.
    kind = None if hasattr(function, '__wrapped__') else kind_of(function)
    return kind, signature_of(function)
