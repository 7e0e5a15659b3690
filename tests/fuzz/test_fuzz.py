"""Whatever a file holds, checking it ends in findings or success."""

import pytest

from tests.fuzz.examination import examine_all, seed_texts
from tests.fuzz.mutations import mutate


@pytest.mark.timeout(400)
@pytest.mark.parametrize(
    ('seed', 'inputs'), [(1, 40), pytest.param(2, 500, marks=pytest.mark.long)]
)
def test_mutated_inputs_end_in_findings_or_success(seed, inputs):
    assert examine_all(seed, inputs, jobs=1 + (inputs > 100)) == []


def test_a_mutated_input_is_always_the_same():
    texts = seed_texts()
    assert [mutate(texts, 5, i) for i in range(20)] == [mutate(texts, 5, i) for i in range(20)]
