"""The cases of files, and their runs: in the default order, and in others that are asked for."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from composer.application.test_runs.scenario_selection import check_case_names
from composer.checks.absent_packages import AbsentPackages
from composer.diagnostics import has_errors
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.records import record
from composer.reports.report import Attempt, CaseReport, CheckedFile
from composer.runtime.tracing.tracer import TracePart
from composer.scenarios.checks import check_scenarios
from composer.scenarios.running.case_results import CaseRequest, CaseResult
from composer.scenarios.running.orders import compare_orders
from composer.scenarios.scenario_files import load_scenarios

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.application.test_runs.name_expressions import Condition
    from composer.application.test_runs.run_options import RunOptions
    from composer.application.test_runs.scenario_selection import SelectedFile
    from composer.scenarios.running.case_client import CaseClient


class CaseRuns:
    """Runs cases, and puts the results of their orders together.

    Args:
        folder: For the traces of runs.

    Attributes:
        reports: What came of the cases so far, in their order.
    """

    def __init__(
        self,
        client: CaseClient,
        cases: Sequence[CaseReport],
        options: RunOptions,
        folder: Path,
    ) -> None:
        self._client = client
        self._cases = cases
        self._options = options
        self._folder = folder
        self._results: dict[int, dict[int, CaseResult]] = {}
        self.reports: list[CaseReport] = []

    def run(self) -> Iterator[CaseReport]:
        """Yield what came of each case, in their order, as soon as it is known."""
        yield from self._list_finished()
        for (index, attempt), result in self._client.run_all(self._requests(), self._options.jobs):
            self._results.setdefault(index, {})[attempt] = result
            yield from self._list_finished()

    def write_trace(self, path: Path) -> None:
        """Write the events of all cases, in all orders that were tried, to one file."""
        with path.open('wb') as trace:
            for index, report in enumerate(self.reports):
                results = [report.result, *(attempt.result for attempt in report.attempts)]
                for attempt, result in enumerate(results if report.name else ()):
                    order = ' shuffled' if attempt else ''
                    trace.write(f'# {report.title} seed {result.seed}{order}\n'.encode())
                    part = self._trace(index, attempt)
                    trace.write(part.read_bytes() if part.exists() else b'')

    def read_timelines(self) -> dict[str, TracePart]:
        """Return what callbacks did in each case, in the default order."""
        files = {each.title: self._timeline(index) for index, each in enumerate(self.reports)}
        return {
            title: TracePart(*json.loads(file.read_text()))
            for title, file in files.items()
            if file.exists()
        }

    def _timeline(self, index: int) -> Path:
        return self._folder / f'{index}.json'

    def _requests(self) -> dict[tuple[int, int], CaseRequest]:
        return {
            (index, attempt): self._request(index, attempt)
            for index, case in enumerate(self._cases)
            if case.name
            for attempt in range(1 + self._options.shuffles)
        }

    def _request(self, index: int, attempt: int) -> CaseRequest:
        options, case = self._options, self._cases[index]
        wants_trace = options.trace is not None or options.shuffles
        return CaseRequest(
            file=case.file,
            case=case.name,
            seed=options.seed,
            shuffle=attempt,
            real_time_limit_sec=options.limit_sec,
            trace=str(self._trace(index, attempt)) if wants_trace else '',
            timeline=str(self._timeline(index)) if options.timeline and not attempt else '',
            captures=not options.shows_output,
        )

    def _trace(self, index: int, attempt: int) -> Path:
        return self._folder / f'{index}-{attempt}'

    def _list_finished(self) -> Iterator[CaseReport]:
        """Yield the cases that are next in order and complete."""
        while len(self.reports) < len(self._cases):
            index = len(self.reports)
            case, results = self._cases[index], self._results.get(index, {})
            if case.name and len(results) < 1 + self._options.shuffles:
                return
            report = self._report(index, case, results)
            self._results.pop(index, None)
            self.reports.append(report)
            yield report

    def _report(self, index: int, case: CaseReport, results: dict[int, CaseResult]) -> CaseReport:
        attempts = []
        for attempt in range(1, 1 + self._options.shuffles if case.name else 1):
            traces = self._trace(index, 0), self._trace(index, attempt)
            difference = compare_orders(*traces, results[attempt].seed)
            attempts.append(Attempt(results[attempt], difference))
            if self._options.trace is None:
                traces[1].unlink(missing_ok=True)
        return replace(
            case,
            result=results.get(0, case.result),
            attempts=tuple(attempts),
            limit_sec=self._options.limit_sec,
        )


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
