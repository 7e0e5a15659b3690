"""Errors that a program plants in valid systems are found where they are, and nothing else is."""

import pytest

from tests.planted_errors.measurement import measure


@pytest.mark.ros
@pytest.mark.long
def test_planted_errors_are_found_in_their_lines_with_the_right_suggestions(tmp_path):
    score = measure(tmp_path, seed=3, systems=85)
    assert score.false_alarms == []
    assert score.extra == []
    assert score.missed == []
    assert score.planted.total() > 200
    assert len(score.planted) == 27
