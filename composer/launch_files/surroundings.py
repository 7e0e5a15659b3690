"""What holds at one place of a launch file: configurations, environment, conditions, order."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from composer.launch_files.texts import Text, chosen, one

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping
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
class Setting:
    """What a group gives to all nodes in it: a remapping rule, a parameter or a parameter file.

    Attributes:
        codes: The conditions that it was set under, as expressions.
    """

    value: Any
    codes: tuple[str, ...]
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
    # With how many conditions held when the scope began.
    configuration_stack: list[tuple[int, dict[str, Any]]] = field(default_factory=list)
    environment_stack: list[tuple[int, dict[str, Text | None]]] = field(default_factory=list)

    @property
    def codes(self) -> tuple[str, ...]:
        """The conditions of entries, as expressions; none if they always exist."""
        return tuple(dict.fromkeys(each.code for each in self.conditions if each.code))

    @property
    def when(self) -> str:
        """An expression for whether entries exist; empty if they always do."""
        return _all_of(self.codes)

    def besides(self, setting: Setting) -> str:
        """Return the conditions of a setting that do not hold here already."""
        return _all_of([code for code in setting.codes if code not in self.codes])

    @property
    def holds(self) -> bool:
        """Whether entries exist with the arguments as they are given to the import."""
        return all(each.holds for each in self.conditions)

    def set(self, name: str, value: Text) -> None:
        """Set a configuration; where a condition decides, to what it was or to the new one."""
        before = self.configurations.get(name)
        when = self._within(self.configuration_stack)
        if when and isinstance(before, Text):
            value = chosen(when, value, before, is_true=self.holds)
        self.configurations[name] = value

    def _within(self, stack: list[tuple[int, Any]]) -> str:
        """Return the conditions that began within the scope: it ends before they do."""
        first = stack[-1][0] if stack else 0
        return _all_of(dict.fromkeys(each.code for each in self.conditions[first:] if each.code))

    def set_variable(self, name: str, value: Text | None) -> None:
        """Set or unset an environment variable."""
        before = self.environment.get(name)
        when = self._within(self.environment_stack)
        if when and value is not None:
            outer = one('none', '') if before is None else before
            value = chosen(when, value, outer, is_true=self.holds)
        self.environment[name] = value

    def push_configurations(self) -> None:
        """Begin a scope: what is set in it is forgotten at its end."""
        self.configuration_stack.append((len(self.conditions), dict(self.configurations)))

    def pop_configurations(self) -> None:
        """End a scope."""
        self.configurations = self.configuration_stack.pop()[1]

    def push_environment(self) -> None:
        """Begin a scope of environment variables."""
        self.environment_stack.append((len(self.conditions), dict(self.environment)))

    def pop_environment(self) -> None:
        """End a scope of environment variables."""
        self.environment = self.environment_stack.pop()[1]

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

    def fill(self, context: Any, given: Mapping[str, str]) -> None:
        """Give the configurations to the context of `launch`.

        Args:
            given: The arguments of the import: `launch` sets them also if nothing declares them.
        """
        real = context.launch_configurations
        real.clear()
        real.update(given)
        real.update({name: _plain(value) for name, value in self.configurations.items()})


def _plain(value: Any) -> Any:
    if isinstance(value, Text):
        return value.text
    values = [item.value for item in value if item.holds]
    return [
        tuple(each.text if isinstance(each, Text) else each for each in item)
        if isinstance(item, tuple)
        else item.text
        for item in values
    ]


def _all_of(codes: Collection[str]) -> str:
    return ' and '.join(f'({code})' if len(codes) > 1 else code for code in codes)
