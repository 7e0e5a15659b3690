"""What holds at one place of a launch file: configurations, environment, conditions, order."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from composer.launch_files.texts import Text, chosen, marked, one

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@dataclass
class Condition:
    """A condition of an entry.

    Attributes:
        code: An expression; empty if it depends on no argument.
        holds: Whether it holds with the arguments as they are given to the import.
    """

    code: str
    holds: bool


@dataclass
class Wait:
    """What an entry waits for: how an action of the launch file has begun or ended."""

    action: Any
    state: str


@dataclass
class Scope:
    """The state of `launch` at one place, with expressions in place of arguments.

    Attributes:
        configurations: `Text`s by name; lists of what `SetRemap` and `SetParameter` have added.
        environment: The variables that were set, or unset (`None`).
        file: The launch file.
        delay: The seconds after which the entries start; `None` for at once.
    """

    configurations: dict[str, Any] = field(default_factory=dict)
    environment: dict[str, Text | None] = field(default_factory=dict)
    conditions: list[Condition] = field(default_factory=list)
    waits: list[Wait] = field(default_factory=list)
    delay: Text | None = None
    file: Path | None = None
    _configuration_stack: list[dict[str, Any]] = field(default_factory=list)
    _environment_stack: list[dict[str, Text | None]] = field(default_factory=list)

    @property
    def when(self) -> str:
        """An expression for whether entries exist; empty if they always do."""
        codes = dict.fromkeys(each.code for each in self.conditions if each.code)
        return ' and '.join(f'({code})' if len(codes) > 1 else code for code in codes)

    @property
    def holds(self) -> bool:
        """Whether entries exist with the arguments as they are given to the import."""
        return all(each.holds for each in self.conditions)

    def set(self, name: str, value: Text) -> None:
        """Set a configuration; where a condition decides, to what it was or to the new one."""
        before = self.configurations.get(name)
        if self.when and isinstance(before, Text):
            value = chosen(self.when, value, before, is_true=self.holds)
        self.configurations[name] = value

    def set_variable(self, name: str, value: Text | None) -> None:
        """Set or unset an environment variable."""
        before = self.environment.get(name)
        if self.when and value is not None:
            outer = one(f"env('{name}', '')", '') if before is None else before
            value = chosen(self.when, value, outer, is_true=self.holds)
        self.environment[name] = value

    def push_configurations(self) -> None:
        """Begin a scope: what is set in it is forgotten at its end."""
        self._configuration_stack.append(dict(self.configurations))

    def pop_configurations(self) -> None:
        """End a scope."""
        self.configurations = self._configuration_stack.pop()

    def push_environment(self) -> None:
        """Begin a scope of environment variables."""
        self._environment_stack.append(dict(self.environment))

    def pop_environment(self) -> None:
        """End a scope of environment variables."""
        self.environment = self._environment_stack.pop()

    @contextmanager
    def under(self, condition: Condition | None) -> Iterator[None]:
        """Hold a condition for the block."""
        before = self.conditions
        self.conditions = [*before, condition] if condition else before
        try:
            yield
        finally:
            self.conditions = before

    @contextmanager
    def after(self, wait: Wait | None, delay: Text | None = None) -> Iterator[None]:
        """Let the entries of the block start later."""
        before = self.waits, self.delay
        self.waits = [*self.waits, wait] if wait else self.waits
        self.delay = delay or self.delay
        try:
            yield
        finally:
            self.waits, self.delay = before

    def fill(self, context: Any, marks: frozenset[str] = frozenset()) -> None:
        """Give the configurations to the context of `launch`.

        Args:
            marks: Those that it is given as marks, and not as they are.
        """
        real = context.launch_configurations
        real.clear()
        for name, value in self.configurations.items():
            real[name] = _plain(value, is_marked=name in marks)


def _plain(value: Any, *, is_marked: bool) -> Any:
    if isinstance(value, Text):
        return marked(value) if is_marked and not value.is_constant else value.text
    return [
        tuple(each.text if isinstance(each, Text) else each for each in item)
        if isinstance(item, tuple)
        else item.text
        for item in value
    ]
