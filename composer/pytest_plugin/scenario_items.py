"""Scenario files as collectors of pytest, and their cases as tests."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import pytest

from composer.checks.absent_packages import AbsentPackages
from composer.diagnostics import has_errors
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.pytest_plugin.case_clients import find_client
from composer.reports.report import CaseReport
from composer.reports.text import render_failures, render_finding
from composer.scenarios.checks import check_scenarios
from composer.scenarios.running.case_results import CaseRequest
from composer.scenarios.scenario_files import load_scenarios

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Span
    from composer.scenarios.scenario_files import LoadedScenarios


class CaseFailedError(ComposerError):
    """A case failed, or its file has errors; the only argument is the report."""


class ScenarioFile(pytest.File):
    """A scenario file."""

    _loaded: LoadedScenarios

    def collect(self) -> Iterator[ScenarioCase]:
        """Yield its cases.

        Raises:
            CollectError: It cannot be read as a whole.
        """
        self._loaded = loaded = load_scenarios(Path(_shown(self)))
        if loaded.spec is None or has_errors(loaded.document.diagnostics):
            raise self.CollectError(self.errors)
        for name, case in loaded.spec.cases.items():
            span = loaded.positions.key(case.path)
            yield ScenarioCase.from_parent(self, name=name, span=span)

    @cached_property
    def errors(self) -> str:
        """The findings in it and its system, if one is an error; nothing but a run needs them."""
        found = AbsentPackages().leave_out(check_scenarios(self._loaded, InterfaceCatalogue()))
        return '\n\n'.join(map(render_finding, found)) if has_errors(found) else ''


class ScenarioCase(pytest.Item):
    """A case of a scenario file.

    Args:
        span: Where it stands.
    """

    def __init__(self, *, span: Span, **keywords: Any) -> None:
        super().__init__(**keywords)
        self._span = span

    def runtest(self) -> None:
        """Run the case in a process of its own.

        Raises:
            CaseFailedError: It failed, or its file has errors.
        """
        if errors := cast('ScenarioFile', self.parent).errors:
            raise CaseFailedError(errors)
        captures = self.config.getoption('capture') != 'no'
        request = CaseRequest(_shown(self), self.name, captures=captures)
        result = find_client(self.config).run(request)
        report = CaseReport(request.file, self.name, self._span, result)
        if not result.has_passed:
            raise CaseFailedError(render_failures(report))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return our own report."""
        if isinstance(excinfo.value, CaseFailedError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return where it stands, and its name."""
        return self.path, self._span.line - 1, self.name


def _shown(node: ScenarioFile | ScenarioCase) -> str:
    """Return the path of a file as the command line of this run takes it."""
    relative = os.path.relpath(node.path, node.config.invocation_params.dir)
    return str(node.path) if relative.startswith('..') else relative
