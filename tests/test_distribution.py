"""Tests of a file run in one process, and so do those that share hosts; long ones begin first."""

import pytest

from tests.distribution import LONG, FileScheduling, turn_of
from tests.running import ROOT


@pytest.mark.parametrize('path', LONG)
def test_what_takes_long_is_there(path):
    assert (ROOT / path).exists()


def test_what_takes_long_begins_first_and_the_rest_keeps_its_order():
    nodes = [
        'tests/b.py::b',
        *(f'{each.removesuffix("/")}::a' for each in LONG[1:]),
        'tests/b.py::a',
    ]
    assert sorted(nodes, key=turn_of) == [*nodes[1:-1], nodes[0], nodes[-1]]


def test_a_file_is_a_group_and_all_that_share_hosts_are_one():
    first, second, third = (
        FileScheduling._split_scope(None, node)
        for node in ('tests/a.py::b[c::d]', 'tests/hosts/a.py::b', 'tests/hosts/b.py::c')
    )
    assert first == 'tests/a.py'
    assert second == third
