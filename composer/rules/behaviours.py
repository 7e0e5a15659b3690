"""Rules of behaviours."""

from __future__ import annotations

from composer.diagnostics import Severity
from composer.rules.record import Family, Rule

_CALLS = 'https://docs.python.org/3/reference/expressions.html#calls'

BEHAVIOURS = Family(
    'behaviours',
    'behaviours, read from their source (and imported with --import)',
    (
        Rule(
            'unknown-behaviour',
            'There is no module of this name, or no such function in it.',
            'There is nothing to call.',
            is_ignorable=True,
        ),
        Rule(
            'broken-module',
            'The module of a behaviour is not Python.',
            'It cannot be imported.',
        ),
        Rule(
            'broken-behaviour',
            'Importing a behaviour raises an error, or gives nothing that can be called.',
            'The system cannot start without it. Only `--import` and `composer up` can tell.',
            needs='import',
        ),
        Rule(
            'uncallable-behaviour',
            'The name is that of a constant or a module, not of a function.',
            'It cannot be called.',
        ),
        Rule(
            'bad-signature',
            'The function does not take what it will be called with.',
            'Every call would raise a TypeError, at run time only.',
            _CALLS,
            needs='import',
            is_ignorable=True,
        ),
        Rule(
            'bad-argument',
            '`with:` gives an argument that the function does not take.',
            'Every call would raise a TypeError, at run time only.',
            _CALLS,
            needs='import',
            is_ignorable=True,
        ),
        Rule(
            'generator-not-allowed',
            'A generator is bound to something that cannot resume it.',
            'Its body would never run: calling a generator function only makes a generator.',
            'https://docs.python.org/3/reference/expressions.html#yield-expressions',
            needs='import',
            is_ignorable=True,
        ),
        Rule(
            'wrong-annotation',
            'A parameter or the return value is annotated with another type than the entity has.',
            'The behaviour would find other fields than it expects, or return the wrong payload.',
            'https://docs.python.org/3/library/typing.html',
            is_ignorable=True,
        ),
        Rule(
            'unknown-service-client',
            'A behaviour calls a service client that its node does not declare.',
            'Every call would raise an error, at run time only.',
            is_ignorable=True,
        ),
        Rule(
            'unknown-action-client',
            'A behaviour sends a goal to an action client that its node does not declare.',
            'Every call would raise an error, at run time only.',
            is_ignorable=True,
        ),
        Rule(
            'unknown-parameter',
            'A behaviour reads a parameter that its node does not declare.',
            'It would raise an error, at run time only.',
            is_ignorable=True,
        ),
        Rule(
            'missing-parameter',
            'A behaviour asks with `get` for a parameter that its node does not declare.',
            'It gets None or its default, whatever the file or the command line says.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'unused-publisher',
            'A publisher is declared, and nothing publishes on it.',
            'It is most often what a misspelt name was meant for, or left over.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'unused-service-client',
            'A service client is declared, and no behaviour of the node calls it.',
            'It is most often what a misspelt name was meant for, or left over.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'unused-action-client',
            'An action client is declared, and no behaviour of the node sends it a goal.',
            'It is most often what a misspelt name was meant for, or left over.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
        Rule(
            'unused-parameter',
            'A parameter is declared, and no behaviour of the node reads it.',
            'Setting it has no effect.',
            severity=Severity.WARNING,
            is_ignorable=True,
        ),
    ),
)
