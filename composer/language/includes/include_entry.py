"""An include as it stands in a file: where, what it says, and whether it is left out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.language.paths import is_in_package

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.diagnostics import Related, Span
    from composer.language.instances import Instance
    from composer.yaml_text.positions import DataPath


@dataclass(frozen=True, slots=True)
class IncludePlace:
    """An include of a file.

    Attributes:
        instance: The file that it stands in.
        at: Its path there.
        entry: What it says.
    """

    instance: Instance
    at: DataPath
    entry: dict[str, Any]

    @property
    def file(self) -> str:
        """The file that is included, as written."""
        return str(self.entry['file'])

    @property
    def span(self) -> Span:
        """Where the file is named."""
        return self.instance.positions.value((*self.at, 'file'))

    @property
    def is_left_out(self) -> bool:
        """Whether its `when` does not hold."""
        return self.at in self.instance.left_out

    @property
    def may_be_absent(self) -> bool:
        """Whether nothing is wrong if the file is not there.

        What is left out may be in a package of other machines, and have a name that is whole only
        when it is used.
        """
        return self.is_left_out and (is_in_package(self.file) or self.is_open((*self.at, 'file')))

    def is_open(self, path: DataPath) -> bool:
        """Return whether the value at a path may be another one when the include is used."""
        instance = self.instance
        is_computed = self.is_left_out and path in instance.notes
        return is_computed or instance.positions.value(path) in instance.sampled_spans

    def report(
        self,
        rule: str,
        message: str,
        chain: Iterable[Related],
        help: str | None = None,  # noqa: A002 - the word that the finding shows
    ) -> None:
        """Add a finding about the file that is named."""
        finding = diagnostic_at(self.span, rule, message, help=help, related=chain)
        self.instance.diagnostics.append(finding)
