"""What a launch file consists of: arguments, processes, and what cannot be kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from composer.launch_files.surroundings import Wait
    from composer.launch_files.texts import Text


class LaunchError(ComposerError):
    """A launch file cannot be read."""


@dataclass
class Argument:
    """A launch argument; all are texts.

    Attributes:
        default: `None` if a value is required.
        given: The value that it is imported with.
        fixed: Whether functions of the launch file depend on its value, so that it cannot change.
    """

    name: str
    default: Text | None
    description: str = ''
    choices: tuple[str, ...] = ()
    given: str = ''
    fixed: bool = False

    @property
    def is_fixed_expression(self) -> bool:
        """Whether it keeps a default that is computed, and that nobody has given."""
        default = self.default
        is_computed = default is not None and not default.is_constant
        has_default = default is not None and default.text == self.given
        return self.fixed and is_computed and has_default and self.name.isidentifier()


@dataclass
class Entry:
    """A process of the system.

    Attributes:
        section: `processes` or `containers`.
        action: The object of `launch` that it is made of.
        remarks: What could not be kept of it.
    """

    section: str
    name: str
    data: dict[str, Any]
    action: Any
    origin: str
    when: str
    holds: bool
    waits: list[Wait]
    environment: dict[str, Text | None]
    remarks: list[str] = field(default_factory=list)


@dataclass
class Imported:
    """What a launch file consists of."""

    arguments: dict[str, Argument] = field(default_factory=dict)
    entries: list[Entry] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    def words(self, given: Mapping[str, str]) -> list[str]:
        """Return the arguments that the system is imported with, as on a command line."""
        return [
            f'{name}:={each.given}'
            for name, each in self.arguments.items()
            if name in given or each.default is None
        ]
