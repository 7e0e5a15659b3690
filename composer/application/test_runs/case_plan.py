"""Which cases to run: those of the files that are named, which are checked first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from composer.application.test_runs.scenario_selection import check_case_names
from composer.checks.absent_packages import AbsentPackages
from composer.diagnostics import has_errors
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.records import record
from composer.reports.report import CaseReport, CheckedFile
from composer.scenarios.checks import check_scenarios
from composer.scenarios.scenario_files import load_scenarios

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.application.test_runs.name_expressions import Condition
    from composer.application.test_runs.scenario_selection import SelectedFile


@record
class CasePlan:
    """What a run of `composer test` is to do.

    Attributes:
        files: The scenario files, with all that was found in them.
        cases: The cases to run, and the files that have errors.
        deselected: How many cases the names left out.
    """

    files: tuple[CheckedFile, ...]
    cases: tuple[CaseReport, ...]
    deselected: int


def plan_cases(files: Sequence[SelectedFile], is_meant: Condition) -> CasePlan:
    """Check scenario files, and return their cases in order.

    Raises:
        UsageError: A file lacks a case that is named.
    """
    catalogue, absent = InterfaceCatalogue(), AbsentPackages()
    checked: list[CheckedFile] = []
    cases: list[CaseReport] = []
    deselected = 0
    for file in files:
        loaded = load_scenarios(Path(file.name))
        findings = tuple(absent.leave_out(check_scenarios(loaded, catalogue)))
        named = loaded.spec.cases if loaded.spec else {}
        checked.append(CheckedFile(file.name, findings, cases=len(named)))
        if has_errors(findings):
            cases.append(CaseReport(file.name, findings=findings))
            continue
        check_case_names(file, list(named))
        for name, case in named.items():
            if file.cases and name not in file.cases:
                continue
            planned = CaseReport(file.name, name, loaded.positions.key(case.path))
            if is_meant(planned.title):
                cases.append(planned)
            else:
                deselected += 1
    return CasePlan(tuple(checked), tuple(cases), deselected)
