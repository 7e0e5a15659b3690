"""What the rules look at, and how they say what they found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from composer.diagnostics import Diagnostic, Severity, diagnostic_at

if TYPE_CHECKING:
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.language import LoadedSystem
    from composer.language.positions import DataPath
    from composer.language.specs import SystemSpec
    from composer.module_finder import ModuleFinder


@dataclass(frozen=True, slots=True)
class CheckContext:
    """A system and what there is to hold it against.

    Attributes:
        unreadable: The interface packages of the file that something was wrong with; it has been
            reported, and nothing is known of their types.
    """

    system: LoadedSystem
    spec: SystemSpec
    catalogue: InterfaceCatalogue
    modules: ModuleFinder
    unreadable: frozenset[str] = frozenset()

    def was_dropped(self, path: DataPath) -> bool:
        """Return whether an entry is missing only because its own fault was reported already."""
        return path in self.system.dropped

    def at_value(
        self,
        path: DataPath,
        rule: str,
        message: str,
        *,
        part: str = '',
        first: bool = False,
        help: str | None = None,  # noqa: A002 - the word that the finding shows
        severity: Severity = Severity.ERROR,
    ) -> Diagnostic:
        """Return a finding at a value, or at the last (or `first`) `part` of its text."""
        span = self.system.positions.value(path).narrowed_to(part, first=first)
        return diagnostic_at(span, rule, message, help=help, severity=severity)

    def at_key(
        self,
        path: DataPath,
        rule: str,
        message: str,
        *,
        help: str | None = None,  # noqa: A002 - the word that the finding shows
        severity: Severity = Severity.ERROR,
    ) -> Diagnostic:
        """Return a finding at a key."""
        span = self.system.positions.key(path)
        return diagnostic_at(span, rule, message, help=help, severity=severity)
