"""Rules of behaviours."""

from __future__ import annotations

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
    ),
)
