"""Errors in behaviours of small robots: as many are found as the docs say, and the same."""

import re
from pathlib import Path

import pytest

from tests.planted_errors.planted_robots import MISSED, ROWS, measure_behaviours

# Of each so many, one is looked at: `python -m tests.planted_errors --behaviours` looks at all.
ONE_OF = 3


def test_the_docs_say_how_many_are_found():
    text = Path('docs/checking.md').read_text()
    said = re.search(r'(\d+) of (\d+) errors', text)
    assert said is not None
    found = [rule for *_, rule in ROWS if not rule.startswith(MISSED)]
    assert (len(found), len(ROWS)) == tuple(map(int, said.groups()))


@pytest.mark.ros
@pytest.mark.long
def test_those_are_found_that_the_table_says(tmp_path):
    rows = ROWS[::ONE_OF]
    missed = [(file, edit) for file, edit, *_ in measure_behaviours(tmp_path, rows)]
    assert missed == [(file, edit) for file, edit, rule in rows if rule.startswith(MISSED)]
