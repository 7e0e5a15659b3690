"""Rules of the comments that silence other rules."""

from __future__ import annotations

from composer.diagnostics import Severity
from composer.rules.record import Family, Rule

COMMENTS = Family(
    'comments',
    'comments of the form # composer: ignore[rule]',
    (
        Rule(
            'unknown-rule',
            'A comment names a rule that does not exist.',
            'It silences nothing.',
            severity=Severity.WARNING,
        ),
        Rule(
            'unused-ignore',
            'A comment names no rule, one without a finding in its line, or one that no comment '
            'silences.',
            'Left behind, it would hide the next fault in that line.',
            severity=Severity.WARNING,
        ),
    ),
)
