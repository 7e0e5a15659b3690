"""The nearest right spelling, and the help that suggests it."""

import pytest

from composer.spelling import find_nearest, suggest


@pytest.mark.parametrize(
    ('word', 'meant'),
    [
        ('timer', 'timers'),
        ('Timers', 'timers'),
        ('timesr', 'timers'),
        ('behavior', 'behaviour'),
        ('publish', 'publish'),
        ('pubishers', 'publishers'),
        ('xyz', None),
        ('', None),
    ],
)
def test_the_nearest_right_spelling_is_suggested(word, meant):
    options = ['timers', 'behaviour', 'publish', 'publishers', 'subscriptions']
    assert find_nearest(word, options) == meant
    assert find_nearest(word, reversed(options)) == meant


def test_case_decides_only_where_nothing_else_does():
    assert find_nearest('string', ['Strings', 'String']) == 'String'
    assert find_nearest('STRING', ['string', 'String']) == 'String'
    assert find_nearest('a', []) is None


def test_the_help_is_a_spelling_or_the_options():
    assert suggest('timer', ['timers', 'nodes']) == "did you mean 'timers'?"
    assert suggest('xyz', ['b', 'a'], 'it has') == 'it has: a, b'
    assert suggest('xyz', ['a']) is None
    assert suggest('xyz', [], 'it has') is None
    assert suggest('xyz', [], 'it has', 'it has none') == 'it has none'
    assert suggest('timer', ['timers'], 'it has', 'it has none') == "did you mean 'timers'?"
    many = [f'n{number:02}' for number in range(20)]
    assert suggest('xyz', many, 'they are') == f'they are: {", ".join(many[:12])}, …'


def test_only_strings_have_a_spelling():
    assert find_nearest(1, ['1']) is None
    assert suggest('2', [1, '2', None], 'there are') == "did you mean '2'?"
    assert suggest('x', [1, '2', None], 'there are') == 'there are: 2'
