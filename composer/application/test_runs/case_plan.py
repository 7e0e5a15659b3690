"""Which cases to run: those of the files that are named, which are checked first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from composer.application.test_runs.scenario_selection import check_case_names
from composer.checks.absent_packages import AbsentPackages
from composer.diagnostics import has_errors
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.records import record
from composer.scenarios.checks import check_scenarios
from composer.scenarios.scenario_files import load_scenarios

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.application.test_runs.name_expressions import Condition
    from composer.application.test_runs.scenario_selection import SelectedFile
    from composer.diagnostics import Diagnostic, Span


@record
class PlannedCase:
    """A case to run, or a file that has errors.

    Attributes:
        file: The scenario file, as the user named it.
        name: The name of the case; empty for a file with errors.
        findings: The errors of the file.
    """

    file: str
    name: str = ''
    span: Span | None = None
    findings: tuple[Diagnostic, ...] = ()

    @property
    def title(self) -> str:
        """`file::case`."""
        return f'{self.file}::{self.name}'


@record
class CasePlan:
    """What a run of `composer test` is to do.

    Attributes:
        findings: What was found in all files, warnings included.
        deselected: How many cases the names left out.
    """

    cases: tuple[PlannedCase, ...]
    findings: tuple[Diagnostic, ...]
    deselected: int


def plan_cases(files: Sequence[SelectedFile], is_meant: Condition) -> CasePlan:
    """Check scenario files, and return their cases in order.

    Raises:
        UsageError: A file lacks a case that is named.
    """
    catalogue, absent = InterfaceCatalogue(), AbsentPackages()
    cases: list[PlannedCase] = []
    findings: list[Diagnostic] = []
    deselected = 0
    for file in files:
        loaded = load_scenarios(Path(file.name))
        found = absent.leave_out(check_scenarios(loaded, catalogue))
        findings += found
        if has_errors(found):
            cases.append(PlannedCase(file.name, findings=tuple(found)))
            continue
        named = loaded.spec.cases if loaded.spec else {}
        check_case_names(file, list(named))
        for name, case in named.items():
            if file.cases and name not in file.cases:
                continue
            planned = PlannedCase(file.name, name, loaded.positions.key(case.path))
            if is_meant(planned.title):
                cases.append(planned)
            else:
                deselected += 1
    return CasePlan(tuple(cases), tuple(findings), deselected)
