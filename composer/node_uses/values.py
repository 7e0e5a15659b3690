"""What names and attributes stand for in the code of behaviours, as far as the syntax shows."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from composer.python_source.syntax import list_arguments, positional_names
from composer.records import record

if TYPE_CHECKING:
    import ast

    from composer.python_source.modules import ModuleSource
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
    """A function of the project; a method has its first argument already."""

    module: ModuleSource
    definition: FunctionNode | ast.Lambda
    bound: Value | None = None
    scope: Scope | None = None

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


class Scope:
    """A function whose code is looked at, or the top of a module.

    Args:
        definition: The function; `None` for the top of a module.
        given: What its parameters stand for, as far as that is known.
        outer: The function around it.
        waits: Whether who calls the behaviour waits for it.
    """

    def __init__(
        self,
        module: ModuleSource,
        definition: FunctionNode | ast.Lambda | None = None,
        given: dict[str, Value] | None = None,
        outer: Scope | None = None,
        *,
        waits: bool = True,
    ) -> None:
        self.module = module
        self.definition = definition
        self.given = given or {}
        self.outer = outer
        self.waits = waits

    @cached_property
    def arguments(self) -> frozenset[str]:
        """The names of all that the function takes."""
        arguments = list_arguments(self.definition.args) if self.definition else ()
        return frozenset(each.arg for each in arguments)
