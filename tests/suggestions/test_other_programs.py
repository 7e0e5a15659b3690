"""The cores that other programs use are not there to be gained."""

import pytest

from composer.suggestions.loads import NodeLoad, SystemLoad
from composer.suggestions.other_programs import cores_of_others, read_processors
from composer.suggestions.suggestion import suggest_split
from composer.suggestions.text import render_json, render_text


def stat(*ticks, cores=2):
    """Return `/proc/stat` with the ticks of all cores together, and lines that are not read."""
    each = ''.join(f'cpu{number} 1 1 1 1 1 1 1 1 0 0\n' for number in range(cores))
    return f'cpu  {" ".join(map(str, ticks))}\n{each}intr 12 3\nctxt 5\n'


START = stat(100, 0, 50, 800, 50, 0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ('after', 'own', 'cores', 'others'),
    [
        # 200 ticks more: of two cores, one second at 100 Hz.
        (stat(200, 0, 50, 900, 50, 0, 0, 0, 0, 0), 0.0, 2, 1.0),
        (stat(200, 0, 50, 900, 50, 0, 0, 0, 0, 0), 0.75, 2, 0.25),
        (stat(200, 0, 50, 900, 50, 0, 0, 0, 0, 0), 1.5, 2, 0.0),
        # Who waits for a disk leaves the core; interrupts and other machines do not.
        (stat(100, 0, 50, 900, 150, 0, 0, 0, 0, 0), 0.0, 2, 0.0),
        (stat(100, 50, 100, 800, 50, 20, 30, 50, 0, 0), 0.5, 2, 1.5),
        # What guests use is in what their hosts use.
        (stat(200, 0, 50, 900, 50, 0, 0, 0, 100, 0), 0.0, 2, 1.0),
        # The system may use one core of two, or it is not known.
        (stat(200, 0, 50, 900, 50, 0, 0, 0, 0, 0), 0.0, 1, 0.0),
        (START, 0.0, 2, 0.0),
        ('', 0.0, 2, 0.0),
        ('cpu  x y\n', 0.0, 0, 0.0),
    ],
)
def test_cores_of_others_are_what_is_busy_without_the_system(after, own, cores, others):
    assert cores_of_others(START, after, own, cores) == pytest.approx(others)


def test_what_this_computer_tells_is_understood():
    before = read_processors()
    if not before:
        pytest.skip('no /proc/stat')
    # Ten thousand ticks of all cores in use, whatever they did before.
    name, user, rest = before.split(None, 2)
    after = f'{name} {int(user) + 10_000} {rest}'
    cores = sum(line.startswith('cpu') for line in before.splitlines()) - 1
    assert cores >= 1
    assert cores_of_others(before, after, 0.0, cores) == pytest.approx(cores)


def load_of(others, *shares, cores=2):
    nodes = [NodeLoad(f'/{name}', each) for name, each in zip('abcd', shares, strict=False)]
    return SystemLoad(nodes, [], cores=cores, others=others)


@pytest.mark.parametrize(
    ('others', 'gain'),
    [
        (0.0, 1.98),
        # Less than a core and a half is left, but more than one.
        (0.6, 1.4),
        (0.8, 1.2),
        # Nothing is, or all of it.
        (1.0, 1.0),
        (2.0, 1.0),
        (9.0, 1.0),
    ],
)
def test_what_others_use_cannot_be_gained(others, gain):
    result = suggest_split(load_of(others, 0.24, 0.24, 0.24, 0.24))
    assert result.gain == pytest.approx(gain, abs=0.06)


def test_what_others_use_is_said():
    result = suggest_split(load_of(0.6, 0.24, 0.24, 0.24, 0.24))
    assert '  other programs use 0.6 of 2 cores' in render_text(result, 's', '', '').splitlines()
    assert '"other_programs": 0.6' in render_json(
        result, 's', {f'/{each}': each for each in 'abcd'}
    )
    full = suggest_split(load_of(1.0, 0.5, 0.46))
    assert full.reason == 'all 2 cores are used already (1.0, and 1.0 by other programs)'
    few = suggest_split(load_of(0.05, 0.24, 0.24, 0.24, 0.24))
    assert 'other programs' not in render_text(few, 's', '', '')


def test_a_system_that_did_nothing_on_a_busy_computer_has_nothing_to_gain():
    assert suggest_split(load_of(2.0, 0.0, 0.0)).moves == {}
