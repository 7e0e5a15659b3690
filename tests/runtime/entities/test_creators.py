"""Which kinds of entity are created, and in which order."""

import pytest

pytest.importorskip('rclpy')

from composer.entity_kinds import ENTITY_KINDS
from composer.runtime.entities.creators import CREATORS

# Declared before all entities are created.
PARAMETERS = 'parameters'


def test_every_kind_of_entity_is_created():
    assert {PARAMETERS, *CREATORS} == {kind.section for kind in ENTITY_KINDS}


def test_what_behaviours_use_is_created_before_what_calls_behaviours():
    used = [kind.section for kind in ENTITY_KINDS if kind.unused and kind.section != PARAMETERS]
    assert set(list(CREATORS)[: len(used)]) == set(used)
