"""The system of a command line as it is read before it runs, and again after each edit."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.checks.checker import check_in_context, create_context
from composer.checks.ignore_comments import IgnoreComments
from composer.cli.common.file_selection import load_given
from composer.cli.common.import_check import import_behaviours
from composer.cli.common.output import show_findings
from composer.diagnostics import has_errors
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.planning.snapshot import Snapshot
    from composer.runtime.rewiring.reading import Reading

Report: TypeAlias = 'Callable[[list[Diagnostic]], None]'


@record
class SystemReader:
    """Reads a system.

    Attributes:
        paths: The file and its layers.
        words: Values for the arguments that the file declares.
        set_values: Values to change.
    """

    paths: Sequence[Path]
    words: Sequence[str]
    set_values: Sequence[str]

    def check(self, report: Report = show_findings) -> CheckContext | None:
        """Return a system without errors; `None` if there are errors.

        Args:
            report: Takes the findings; by default they are printed.

        Raises:
            UsageError: The arguments do not fit the file.
        """
        context, _files, findings = self.read()
        report(findings)
        return None if has_errors(findings) else context

    def read(
        self, before: CheckContext | None = None
    ) -> tuple[CheckContext | None, list[Path], list[Diagnostic]]:
        """Return a system, if there is one, the files that it names, and what is wrong with it.

        Args:
            before: What was read before: what is the same in it is kept.

        Raises:
            UsageError: The arguments do not fit the file.
        """
        system_before = before.system if before else None
        system = load_given(self.paths, self.words, self.set_values, system_before)
        context = create_context(system, InterfaceCatalogue(), before)
        files = [*self.paths, *system.files, *system.named]
        return context, files, check_in_context(system, context)


def import_reading(
    context: CheckContext, snapshot: Snapshot, report: Report = show_findings
) -> Reading | None:
    """Import the behaviours of a system; return `None` if they have errors.

    Args:
        report: Takes the findings; by default they are printed.
    """
    from composer.runtime.rewiring.reading import Reading

    system = context.system
    functions, findings = import_behaviours(context)
    # The check has already reported comments that silence nothing.
    comments = IgnoreComments(system.positions.source)
    shown = [each for each in findings if not comments.silence(each)]
    report(shown)
    if has_errors(shown):
        return None
    return Reading(snapshot.spec, system.positions, functions, snapshot)
