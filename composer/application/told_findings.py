"""Findings of one reading after another: each is printed when it is new."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.application.output import show_findings
from composer.diagnostics import has_errors
from composer.reports.text import render_finding

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from composer.diagnostics import Diagnostic


class ToldFindings:
    """What was printed of a system whose files are read again and again.

    Args:
        findings: What was printed first.

    Attributes:
        failure: The errors of the last reading, and what came of them; empty if it was good.
    """

    def __init__(self, findings: Iterable[Diagnostic] = ()) -> None:
        self.failure = ''
        self._warnings = _warnings_in(findings)

    def show(self, findings: Sequence[Diagnostic], failure: str = '') -> bool:
        """Print what was not told before; return whether there are errors that were not.

        Args:
            failure: What came of the errors.
        """
        told = self._warnings
        # Errors hide some.
        self._warnings = _warnings_in(findings) | (told if failure else set())
        errors = [each for each in findings if has_errors([each])]
        # Without errors in the files something was tried, and failed again.
        failure = with_findings(errors, failure) if errors else failure
        is_new = not errors or failure != self.failure
        self.failure = failure
        show_findings(
            each
            for each in findings
            if (is_new if has_errors([each]) else _key_of(each) not in told)
        )
        return is_new


def with_findings(findings: Iterable[Diagnostic], text: str) -> str:
    """Return a text after the findings that belong to it."""
    return '\n'.join([*(render_finding(each) + '\n' for each in findings), text])


def _key_of(finding: Diagnostic) -> tuple[str, str, str]:
    """Return what a finding is known by; its line changes with what is written above it."""
    return finding.file, finding.rule, finding.message


def _warnings_in(findings: Iterable[Diagnostic]) -> set[tuple[str, str, str]]:
    return {_key_of(each) for each in findings if not has_errors([each])}
