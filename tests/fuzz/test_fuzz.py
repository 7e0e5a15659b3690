"""Whatever a file holds, checking it ends in findings or success.

`python -m tests.fuzz --seed 2` goes on with other inputs, two hundred thousand of them.
"""

import pytest

from tests.fuzz.examination import examine_all, seed_texts
from tests.fuzz.mutations import mutate

# A seed that once found something.
SEED = 1


@pytest.mark.timeout(400)
def test_mutated_inputs_end_in_findings_or_success():
    assert examine_all(SEED, 1000) == []


def test_a_mutated_input_is_always_the_same():
    texts = seed_texts()
    assert [mutate(texts, 5, i) for i in range(20)] == [mutate(texts, 5, i) for i in range(20)]
