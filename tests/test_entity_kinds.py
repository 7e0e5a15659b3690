"""The table of entity kinds and the schema say the same of each kind."""

import json

import pytest

from composer.entity_kinds import ENTITY_KINDS, NODE_BEHAVIOURS, TYPE_FOLDERS
from composer.schema import schema_path

DEFINITIONS = json.loads(schema_path().read_text())['$defs']
SECTIONS = {
    key
    for key, part in DEFINITIONS['node']['properties'].items()
    if '$ref' in part.get('additionalProperties', {})
}


def definition_of(kind):
    return DEFINITIONS[kind.noun.replace(' ', '_')]


def keys_of(definition):
    branches = (definition, *definition.get('oneOf', ()))
    return {key for branch in branches for key in branch.get('properties', ())}


def test_the_sections_of_a_node_are_those_of_the_table():
    assert [kind.section for kind in ENTITY_KINDS if kind.section in SECTIONS] == [
        kind.section for kind in ENTITY_KINDS
    ]
    assert {kind.section for kind in ENTITY_KINDS} == SECTIONS


@pytest.mark.parametrize('kind', ENTITY_KINDS, ids=lambda kind: kind.noun)
def test_an_entity_has_the_keys_that_its_kind_has(kind):
    keys = keys_of(definition_of(kind))
    assert definition_of(kind)['title'] == kind.noun
    assert (kind.channel or 'type') in keys or kind.channel is None
    assert ('qos' in keys) == kind.has_qos
    assert ('publish' in keys) == kind.publishes
    assert ('group' in keys) == kind.has_group
    events = {key for key in keys if key.startswith('on_') and key != 'on_error'}
    behaviours = events | (keys & {'behaviour', 'accept', 'feedback', 'result', 'cancel'})
    assert behaviours == {each.key for each in kind.behaviours}
    assert ('external' in keys) == (kind.unmatched is not None)


@pytest.mark.parametrize('kind', ENTITY_KINDS, ids=lambda kind: kind.noun)
def test_what_stands_in_for_missing_keys_is_right(kind):
    for key, value in kind.stand_in.items():
        assert key in keys_of(definition_of(kind))
        if key == 'type':
            assert value.split('/')[1] == TYPE_FOLDERS[kind.channel]


def test_the_hooks_of_a_node_are_those_of_the_table():
    hooks = {
        key
        for key, part in DEFINITIONS['node']['properties'].items()
        if part.get('$ref') == '#/$defs/hook'
    }
    assert {each.key for each in NODE_BEHAVIOURS} == hooks
