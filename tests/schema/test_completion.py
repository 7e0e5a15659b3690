"""What the schemas offer to editors that complete files."""

import json

import pytest

from composer.language.qos import BUILTIN_PROFILES
from composer.schema import SCENARIO_SCHEMA_NAME, SCHEMA_NAME, schema_path


def _definitions(schema):
    if isinstance(schema, dict):
        yield schema
        for each in schema.values():
            yield from _definitions(each)
    elif isinstance(schema, list):
        for each in schema:
            yield from _definitions(each)


@pytest.mark.parametrize('name', [SCHEMA_NAME, SCENARIO_SCHEMA_NAME])
def test_examples_are_what_editors_can_show(name):
    """The YAML language server shows a mapping among the examples as `[object Object]`."""
    schema = json.loads(schema_path(name).read_text())
    for definition in _definitions(schema['properties'] | schema['$defs']):
        assert not [each for each in definition.get('examples', ()) if isinstance(each, dict)]


def test_every_qos_profile_of_ros_is_offered():
    schema = json.loads(schema_path().read_text())
    assert schema['$defs']['qos_profile_name']['examples'] == [*BUILTIN_PROFILES]


def test_an_editor_names_the_key_that_is_too_much():
    """The YAML language server says of `oneOf` alone that several schemas match."""
    schema = json.loads(schema_path().read_text())
    forms = schema['$defs']['timer']['oneOf']
    assert [form['properties'] for form in forms] == [{'rate': False}, {'period': False}]
