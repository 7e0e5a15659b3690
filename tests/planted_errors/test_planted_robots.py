"""Errors in behaviours of small robots: no fewer are found than the docs say."""

import re
from pathlib import Path

import pytest

from tests.planted_errors.planted_robots import ROWS, measure_behaviours

pytestmark = [pytest.mark.ros, pytest.mark.long]


def test_as_many_are_found_as_the_docs_say(tmp_path):
    text = Path('docs/checking.md').read_text()
    said = re.search(r'(\d+) of (\d+) errors', text)
    assert said is not None
    missed = measure_behaviours(tmp_path)
    assert (len(ROWS) - len(missed), len(ROWS)) == tuple(map(int, said.groups())), missed
