"""Checks of scenario files: a loaded file and its system → findings, before anything runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.checker import check_in_context, create_context
from composer.checks.ignore_comments import IgnoreComments
from composer.rules import Severity
from composer.scenarios.checks.expectation_checks import check_expectations
from composer.scenarios.checks.given_checks import check_given
from composer.scenarios.checks.scenario_context import ScenarioContext
from composer.scenarios.checks.step_checks import check_steps
from composer.scenarios.checks.time_checks import check_times

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from composer.diagnostics import Diagnostic
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.rules import Need
    from composer.scenarios.scenario_files import LoadedScenarios
    from composer.scenarios.specs import CaseSpec

_CASE_RULES: tuple[Callable[[ScenarioContext, CaseSpec], Iterable[Diagnostic]], ...] = (
    check_times,
    check_given,
    check_steps,
    check_expectations,
)
# What only `composer check` of the system looks at.
_UNCHECKED: frozenset[Need] = frozenset({'import', 'types'})


def check_scenarios(loaded: LoadedScenarios, catalogue: InterfaceCatalogue) -> list[Diagnostic]:
    """Return all findings in a scenario file, and the errors of its system, by their places."""
    own = list(loaded.document.diagnostics)
    errors = []
    unchecked = set(_UNCHECKED)
    if loaded.system is not None:
        context = create_context(loaded.system, catalogue)
        found = check_in_context(loaded.system, context, is_simulated=True)
        errors = [each for each in found if each.severity is Severity.ERROR]
        if context is not None and loaded.spec is not None:
            own += _check_cases(ScenarioContext(loaded, context, loaded.spec))
        unchecked |= set() if catalogue.available else {'interfaces'}
    comments = IgnoreComments(loaded.positions.source)
    heard = [each for each in dict.fromkeys(own) if not comments.silence(each)]
    is_whole = loaded.spec is not None and not loaded.document.diagnostics
    heard += comments.check(unchecked if is_whole else None)
    return [*sorted(heard, key=lambda each: each.sort_key), *errors]


def _check_cases(context: ScenarioContext) -> Iterator[Diagnostic]:
    for case in context.spec.cases.values():
        for rule in _CASE_RULES:
            yield from rule(context, case)
