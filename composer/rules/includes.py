"""Rules of files that are part of other files."""

from __future__ import annotations

from composer.diagnostics import Severity
from composer.rules.record import Family, Rule

INCLUDES = Family(
    'includes',
    'files that are part of other files, or change them',
    (
        Rule(
            'missing-include',
            'An included file is not there, or lies in a package that is not installed.',
            'A part of the system would be missing.',
        ),
        Rule(
            'include-cycle',
            'A file includes itself, directly or through others.',
            'The system would have no end.',
        ),
        Rule(
            'unknown-argument',
            'An include gives an argument that the file does not declare.',
            'It would have no effect.',
        ),
        Rule(
            'missing-argument',
            'An include gives no value for an argument that has no default.',
            'The file cannot be read without it.',
        ),
        Rule(
            'argument-type',
            'An include gives an argument a value of the wrong type, or none of its choices.',
            'The file could not do what it was written for.',
        ),
        Rule(
            'ignored-environment',
            'An environment variable is set by an included file alone.',
            'A process has one environment, which is the business of the file that is started.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'changes-nothing',
            'A layer removes or changes what is not there.',
            'It is misspelt, or meant for another file: an included file takes no layers.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
    ),
)
