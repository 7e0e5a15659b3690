"""What the expressions of a file have in scope."""

from __future__ import annotations

from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from composer.expressions import ALL_ARGUMENTS, ARGUMENTS, BUILT_IN
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping


@record
class Scope:
    """Names with their values.

    Attributes:
        values: By name; names with dots can only be used as `args['a.b']`.
        samples: The names whose values only stand for others of their type.
        origins: Where the values come from, in words.
        arguments: The names that are arguments of the file.
        choices: The values that arguments may have, of those that have choices.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    samples: Collection[str] = frozenset()
    origins: Mapping[str, str] = field(default_factory=dict)
    arguments: Collection[str] = ()
    choices: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)

    def within(self, name: str, value: Any, origin: str, *, is_sample: bool) -> Scope:
        """Return the scope with one more name."""
        samples = {*self.samples, name} if is_sample else {*self.samples} - {name}
        return replace(
            self,
            values={**self.values, name: value},
            samples=samples,
            origins={**self.origins, name: origin},
        )

    def argument_values(self) -> dict[str, Any]:
        """Return the values of all arguments that are known."""
        return {name: self.values[name] for name in self.arguments if name in self.values}

    def has_samples(self, names: Collection[str]) -> bool:
        """Return whether one of some names has a sample as its value."""
        used = {*names, *self.arguments} if ALL_ARGUMENTS in names else names
        return not frozenset(self.samples).isdisjoint(used)

    @property
    def names(self) -> set[str]:
        """All names that an expression can use without more ado."""
        return {name for name in (*self.values, *BUILT_IN) if '.' not in name} - {ARGUMENTS}
