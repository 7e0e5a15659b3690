"""Whatever a file holds, checking it ends in findings or success."""

import pytest

from tests.fuzz.examination import examine_all


@pytest.mark.timeout(400)
@pytest.mark.parametrize(
    ('seed', 'inputs'), [(1, 40), pytest.param(2, 500, marks=pytest.mark.long)]
)
def test_mutated_inputs_end_in_findings_or_success(seed, inputs):
    assert examine_all(seed, inputs, jobs=1 + (inputs > 100)) == []
