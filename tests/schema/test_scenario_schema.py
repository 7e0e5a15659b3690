"""What an editor accepts as a scenario file, Composer accepts, and the other way round."""

import copy
import json
import random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.scenarios.checks import check_scenarios
from composer.scenarios.scenario_files import load_scenarios
from composer.schema import SCENARIO_SCHEMA_NAME, schema_path
from composer.schema.structure import SchemaValidator

SCHEMA = json.loads(schema_path(SCENARIO_SCHEMA_NAME).read_text())
CATALOGUE = InterfaceCatalogue()
EDITOR = Draft202012Validator(SCHEMA)
STRUCTURAL = {
    'missing-key', 'unknown-key', 'wrong-type', 'bad-value', 'out-of-range', 'conflicting-keys',
    'unsupported-version',
}  # fmt: skip
VALID = {
    'version': 1,
    'description': 'all there is',
    'system': {'file': 'a.yaml', 'layers': ['b.yaml'], 'args': {'a': 1}, 'set': {'nodes.a.b': 1}},
    'until': 10,
    'x-note': 1,
    'cases': {
        'one': {
            'description': 'a case',
            'seed': 3,
            'real_time_limit': 5,
            'given': {
                'parameters': {'a': {'b': 1}},
                'recording': 'a.mcap',
                'services': {
                    '/a': {'response': {'b': 1}, 'delay': 0.5, 'type': 'a/srv/B'},
                    '/b': {'answers': False},
                },
                'actions': {
                    '/c': {
                        'feedback': [{'delay': 0.5, 'message': {}}],
                        'result': 1,
                        'status': 'aborted',
                    },
                    '/d': {'accepts': False, 'type': 'a/action/B'},
                },
            },
            'when': [
                {'at': 1, 'every': 0.5, 'times': 3, 'publish': '/a', 'message': {}},
                {'publish': 'a', 'type': 'a/msg/B'},
                {'call': '/a', 'request': {}, 'response': {}, 'timeout': 1, 'tolerance': 0.1},
                {'call': '/a', 'fails': True},
                {'send_goal': '/a', 'goal': {}, 'feedback': [1], 'result': 1, 'status': 'aborted'},
                {'at': 1, 'send_goal': '/a', 'cancel_at': 2},
                {'set_parameters': {'a': {'b': 1}}, 'refused': True},
            ],
            'then': [
                {'topic': '/a', 'where': 'x', 'message': 1, 'within': [1, 2], 'count': [1, 3]},
                {'topic': '/a', 'never': 'x'},
                {'topic': '/a', 'eventually': 'x', 'tolerance': 0.1},
                {'topic': '/a', 'rate': [1, 2.5], 'between': [1, 2]},
                {'topic': '/a', 'like': 'a.mcap', 'ignore': ['a.b']},
                {'order': [{'topic': '/a'}, {'topic': '/b', 'where': 'x', 'message': 1}]},
                {'log': 'a', 'level': 'error', 'text': 'x', 'never': True},
                {'error': '*', 'matches': 'x', 'count': 1},
                {'parameters': {'a': {'b': 1}}, 'at': 3},
                {'state': {'a': 'active'}, 'within': [1, 2]},
                {'exit_code': 0, 'within': [1, 2]},
            ],
        },
        'two': {'then': [], 'until': 3},
    },
}
KEYS = st.sampled_from(
    ['topic', 'log', 'within', 'never', 'count', 'publish', 'call', 'tolerance', 'x', 'at', 'rate']
)
ANYTHING = st.recursive(
    st.one_of(
        st.integers(-2, 300),
        st.sampled_from([0.5, 1e300, '', 'a', '/a', '/a b', 'a/msg/B', 'active', 'error']),
        st.booleans(),
        st.none(),
    ),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=2),
    max_leaves=4,
)


def places(data):
    inner = enumerate(data) if isinstance(data, list) else ()
    for key, value in list(data.items() if isinstance(data, dict) else inner):
        yield data, key
        yield from places(value)


@st.composite
def documents(draw):
    """Return a document that is right, or wrong in a place or two."""
    data = copy.deepcopy(VALID)
    chance = random.Random(draw(st.integers(0, 2**32)))
    for _ in range(draw(st.integers(1, 2))):
        container, key = chance.choice(list(places(data)))
        choice = chance.randrange(5)
        if choice == 0:
            del container[key]
        elif choice == 1 and isinstance(container, dict):
            container[f'{key}s'] = container[key]
        elif choice == 2 and isinstance(container, dict):
            container[draw(KEYS)] = draw(ANYTHING)
        else:
            container[key] = draw(ANYTHING)
    return data


def composer_accepts(data, path):
    loaded = load_scenarios(path, text=json.dumps(data).encode())
    # Whatever is wrong, the rest can be checked.
    assert check_scenarios(loaded, CATALOGUE) is not None
    rules = {each.rule for each in loaded.document.diagnostics}
    assert rules <= STRUCTURAL | {'unreadable-file', 'bad-system-argument'}
    without_end = [
        each
        for each in loaded.document.diagnostics
        if each.rule in STRUCTURAL and not each.message.startswith("the key 'until' is missing")
    ]
    return not without_end


def test_an_editor_composer_and_the_validator_have_the_same_verdict(tmp_path):
    (tmp_path / 'a.yaml').write_text('version: 1\nargs: {a: 1}\nnodes: {a: {}}\n')
    (tmp_path / 'b.yaml').write_text('nodes: {a: {}}\n')
    validator = SchemaValidator(SCHEMA)
    verdicts = []

    def problems(validator, data):
        return {(tuple(each.absolute_path), each.message) for each in validator.iter_errors(data)}

    @settings(
        max_examples=20, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
    )
    @given(documents())
    def agree(data):
        verdict = EDITOR.is_valid(data)
        assert composer_accepts(data, tmp_path / 'x.scenario.yaml') == verdict
        assert verdict or not validator.is_surely_valid(data)
        assert problems(validator, data) == problems(EDITOR, data)
        verdicts.append(verdict)

    agree()
    assert 0 < sum(verdicts) < len(verdicts) - 10


def test_the_schema_is_one_and_accepts_its_own_examples():
    Draft202012Validator.check_schema(SCHEMA)
    EDITOR.validate(VALID)
    for example in SCHEMA['examples']:
        EDITOR.validate(example)


@pytest.mark.parametrize(
    'name',
    [
        name
        for name, each in SCHEMA['$defs'].items()
        if {'examples', 'defaultSnippets'} & each.keys()
    ],
)
def test_a_definition_accepts_its_examples(name):
    part = Draft202012Validator({**SCHEMA['$defs'][name], '$defs': SCHEMA['$defs']})
    definition = SCHEMA['$defs'][name]
    snippets = [each['body'] for each in definition.get('defaultSnippets', ())]
    for example in [*definition.get('examples', ()), *snippets]:
        part.validate(example)


def test_every_key_is_described():
    def missing(schema, path):
        for key, part in schema.get('properties', {}).items():
            named = part.get('$ref', '').rpartition('/')[2]
            if 'description' not in part and 'description' not in SCHEMA['$defs'].get(named, {}):
                yield f'{path}.{key}'

    parts = [('', SCHEMA), *SCHEMA['$defs'].items()]
    assert [each for path, part in parts for each in missing(part, path)] == []
