"""What the rules look at, and how they say what they found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from composer.diagnostics import Diagnostic, Related, Severity, Span, diagnostic_at

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.checks.node_uses import UseReader
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.language import LoadedSystem
    from composer.language.positions import DataPath
    from composer.language.specs import EndSpec, SystemSpec
    from composer.module_finder import ModuleFinder


@dataclass(frozen=True, slots=True)
class CheckContext:
    """A system and what there is to hold it against.

    Attributes:
        uses: Reads what behaviours do with their nodes.
        unreadable: The interface packages of the file that something was wrong with; it has been
            reported, and nothing is known of their types.
    """

    system: LoadedSystem
    spec: SystemSpec
    catalogue: InterfaceCatalogue
    modules: ModuleFinder
    uses: UseReader
    unreadable: frozenset[str] = frozenset()

    def was_dropped(self, path: DataPath) -> bool:
        """Return whether an entry is missing only because its own fault was reported already."""
        return path in self.system.dropped

    def has_real_type(self, entity: EndSpec) -> bool:
        """Return whether the type of an entity is the one that is meant, as far as can be known.

        It is none that stands in for a missing one, hangs on a sample, or does not exist.
        """
        span = self.system.positions.value(self.inner(entity.path, 'type'))
        stands_in = self.was_dropped((*entity.path, 'type')) or self.was_dropped(entity.path)
        if stands_in or span in self.system.sampled:
            return False
        return not self.catalogue.available or self.catalogue.has(entity.type)

    def at_value(  # noqa: PLR0913 - the words of a finding
        self,
        path: DataPath,
        rule: str,
        message: str,
        *,
        part: str = '',
        first: bool = False,
        help: str | None = None,  # noqa: A002 - the word that the finding shows
        severity: Severity = Severity.ERROR,
        related: Iterable[Related] = (),
    ) -> Diagnostic:
        """Return a finding at a value, or at the last (or `first`) `part` of its text."""
        span = self.system.positions.value(path).narrowed_to(part, first=first)
        places = (*related, *self._includes(path, span))
        return diagnostic_at(span, rule, message, help=help, severity=severity, related=places)

    def at_key(
        self,
        path: DataPath,
        rule: str,
        message: str,
        *,
        help: str | None = None,  # noqa: A002 - the word that the finding shows
        severity: Severity = Severity.ERROR,
        related: Iterable[Related] = (),
    ) -> Diagnostic:
        """Return a finding at a key."""
        span = self.system.positions.key(path)
        places = (*related, *self._includes(path, span))
        return diagnostic_at(span, rule, message, help=help, severity=severity, related=places)

    def _includes(self, path: DataPath, span: Span) -> tuple[Related, ...]:
        """Return where the file of a finding is included, if it is not the first one."""
        is_own = span.source is self.system.positions.source
        return () if is_own else self.system.chains.get(path[:2], ())

    def related(self, path: DataPath, message: str) -> Related:
        """Return a second place of a finding: that of a key."""
        return Related(message, self.system.positions.key(path))

    def related_value(self, path: DataPath, message: str) -> Related:
        """Return a second place of a finding: that of a value."""
        return Related(message, self.system.positions.value(path))

    def inner(self, path: DataPath, key: str) -> DataPath:
        """Return the path of `key` in a mapping, or of the mapping where that is written short."""
        within = (*path, key)
        return within if within in self.system.positions.values else path
