"""Rules of arguments and of the expressions that use them."""

from __future__ import annotations

from composer.rules.record import Family, Rule

_JINJA = 'https://jinja.palletsprojects.com/en/stable/templates/#expressions'

EXPRESSIONS = Family(
    'expressions',
    'arguments of the file, and {{ expressions }}',
    (
        Rule(
            'bad-argument-declaration',
            'An argument of the file contradicts itself: its default, type and choices.',
            'The file could not be started without giving the argument, or not at all.',
        ),
        Rule(
            'undefined-name',
            'An expression uses a name that the file does not declare.',
            'Taken as empty, it would give wrong names of nodes and topics without a word.',
            _JINJA,
        ),
        Rule(
            'bad-expression',
            'An expression cannot be read, fails, or does what the sandbox refuses.',
            'It has no value, so neither has the key.',
            _JINJA,
        ),
        Rule(
            'bad-foreach',
            '`foreach:` is no mapping of variables to lists.',
            'Nobody knows how often the entry is wanted.',
        ),
        Rule(
            'bad-when',
            '`when:` is neither true nor false.',
            'What counts as true differs between languages; a comparison says what is meant.',
        ),
        Rule(
            'too-many-entries',
            '`foreach:` makes more entries than the file asks for.',
            'A mistake in an expression would use up the machine.',
        ),
    ),
)
