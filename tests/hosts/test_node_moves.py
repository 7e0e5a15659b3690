"""What moves between hosts leaves the one before it comes to the other."""

from types import SimpleNamespace

import pytest

from composer.hosts.host_plan import HostPlan
from composer.hosts.moves import order_changes, settle_exchanges

# Of each host its action, what leaves it, and what comes to it: → the actions, in their order.
CASES = {
    'nothing moves': ({'a': ('reload', 'x', ''), 'b': ('reload', '', 'y')}, ['a b', '']),
    'a move': ({'a': ('reload', '', 'x'), 'b': ('reload', 'x', 'y')}, ['b', 'a']),
    'from one that starts again': (
        {'a': ('reload', '', 'x'), 'b': ('restart', 'x', '')},
        ['b!', 'a'],
    ),
    'to one that starts again': (
        {'a': ('restart', '', 'x'), 'b': ('reload', 'x', '')},
        ['a! b', ''],
    ),
    'from one that is left': ({'a': ('reload', '', 'x'), 'b': ('remove', 'x', '')}, ['b', 'a']),
    'an exchange': ({'a': ('reload', 'x', 'y'), 'b': ('reload', 'y', 'x')}, ['a! b!', '']),
    'a chain': (
        {'a': ('reload', 'x', ''), 'b': ('reload', 'y', 'x'), 'c': ('reload', '', 'y')},
        ['a b!', 'c'],
    ),
}


def plan(name, action, leaving, coming):
    part = SimpleNamespace(host=SimpleNamespace(name=name))
    return HostPlan(
        part, (), action, '', (), (), True, 0, (), frozenset(leaving), frozenset(coming)
    )


@pytest.mark.parametrize('case', CASES)
def test_what_leaves_goes_first(case):
    given, expected = CASES[case]
    plans = settle_exchanges([plan(name, *each) for name, each in given.items()])
    found = [
        ' '.join(each.part.host.name + '!' * (each.action == 'restart') for each in group)
        for group in order_changes(plans)
    ]
    assert found == expected
