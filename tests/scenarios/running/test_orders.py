"""Where two orders differ is shown with what happened around it."""

import pytest

from composer.scenarios.running.orders import compare_orders

LINES = [f'{second}.000000000 message /a /b {{data: {second}}}' for second in range(9)]


@pytest.fixture
def compare(tmp_path):
    def compare(default, shuffled):
        paths = tmp_path / 'default', tmp_path / 'shuffled'
        for path, lines in zip(paths, (default, shuffled), strict=True):
            if lines is not None:
                path.write_text(''.join(f'{line}\n' for line in lines))
        return list(compare_orders(*paths, seed=7))

    return compare


def test_equal_orders_have_no_difference(compare):
    assert compare(LINES, LINES) == []
    assert compare(None, None) == []


def test_the_first_difference_is_shown_in_both(compare):
    shuffled = [*LINES[:4], LINES[5], LINES[4], *LINES[6:]]
    assert compare(LINES, shuffled) == [
        'the default order:',
        *(f'    {line}' for line in LINES[1:4]),
        f'  > {LINES[4]}',
        *(f'    {line}' for line in LINES[5:9]),
        'the order of seed 7:',
        *(f'    {line}' for line in LINES[1:4]),
        f'  > {LINES[5]}',
        f'    {LINES[4]}',
        *(f'    {line}' for line in LINES[6:9]),
    ]


def test_an_order_that_ends_earlier_says_so(compare):
    assert compare(LINES[:1], LINES[:2])[:4] == [
        'the default order:',
        f'    {LINES[0]}',
        '  > (the end)',
        'the order of seed 7:',
    ]
