"""What an editor accepts by the schema, Composer accepts, and the other way round."""

import itertools
import json
import math
import random
import sys
from functools import reduce
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import composer
from composer.language.pipeline import load_system_text
from composer.schema import schema_path, structure
from composer.schema.structure import SchemaValidator, without_templates

SCHEMA = json.loads(schema_path().read_text())
EDITOR = Draft202012Validator(SCHEMA)
PLAIN = without_templates(SCHEMA)
QUICK = SchemaValidator(PLAIN)
with pytest.MonkeyPatch.context() as patched:
    patched.setitem(sys.modules, 'jsonschema_rs', None)
    ALONE = SchemaValidator(PLAIN)
DEEP = reduce(lambda inner, _: [inner], range(900), 0)
NAMES = st.sampled_from(['a', 'b', 'left_wheel', 'x-note', 'type', 'nodes', 'ä', ''])
NUMBERS = st.one_of(
    st.integers(-2, 12),
    st.sampled_from([0.5, 1.0, 10.0, -1.5, 2**31, 2**70, 1e300, 1e-9, 86400, 86401, 1024.0, 1025]),
)
WORDS = st.sampled_from(
    ['a', '', 'a.b:c', 'a:b', 'std_msgs/msg/String', 'std_srvs/srv/Empty', 'a/action/B', 'a/msg/b c',
     'sensor_data', 'infinite', 'keep_all', 'log', 'ros', 'bool', 'string_array', 'é.b:c', 'a:b:c']
)  # fmt: skip
SCALARS = st.one_of(NUMBERS, WORDS, st.booleans(), st.none())
ANYTHING = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(NAMES, inner, max_size=2),
    max_leaves=4,
)


def values(schema):
    """Return data that a schema mostly accepts."""
    if '$ref' in schema:
        name = schema['$ref'].rpartition('/')[2]
        return st.deferred(lambda: values(PLAIN['$defs'][name]))
    for key in ('oneOf', 'anyOf'):
        branches = [
            each for each in schema.get(key, ()) if each.keys() - {'required', 'properties'}
        ]
        if branches:
            return st.one_of(*map(values, branches))
    if 'enum' in schema:
        return st.sampled_from(schema['enum'])
    if 'const' in schema:
        return st.just(schema['const'])
    return _BY_TYPE.get(str(schema.get('type')), lambda _: ANYTHING)(schema)


def mappings(schema):
    required = {key: values(schema['properties'][key]) for key in schema.get('required', ())}
    # What repeats or leaves out entries is evaluated before the schema is asked.
    known = {
        key: part
        for key, part in schema.get('properties', {}).items()
        if key not in ('foreach', 'when')
    }
    optional = {key: values(part) for key, part in known.items() if key not in required}
    rest = schema.get('additionalProperties')
    if isinstance(rest, dict):
        return st.dictionaries(NAMES, values(rest), max_size=2)
    if not known:
        return st.dictionaries(NAMES, ANYTHING, max_size=2)
    # All optional keys at once are rarely right, and none of them tells little.
    few = st.lists(st.sampled_from(sorted(optional)), max_size=4, unique=True) if optional else st.just([])  # fmt: skip
    chosen = few.flatmap(lambda keys: st.fixed_dictionaries({key: optional[key] for key in keys}))
    return st.builds(lambda one, other: one | other, st.fixed_dictionaries(required), chosen)


_BY_TYPE = {
    'object': mappings,
    'array': lambda schema: st.lists(values(schema.get('items', {})), max_size=3),
    'string': lambda _: WORDS,
    'number': lambda _: NUMBERS,
    'integer': lambda _: NUMBERS,
    'boolean': lambda _: st.booleans(),
}


def places(data, path=()):
    inner = enumerate(data) if isinstance(data, list) else ()
    for key, value in list(data.items() if isinstance(data, dict) else inner):
        yield data, key
        yield from places(value, (*path, key))


@st.composite
def documents(draw):
    """Return a document that is right, or wrong in a place or two."""
    data = draw(values(PLAIN))
    chance = random.Random(draw(st.integers(0, 2**32)))
    for _ in range(draw(st.integers(0, 2))):
        found = list(places(data))
        if found:
            container, key = chance.choice(found)
            choice = chance.randrange(4)
            if choice == 0:
                del container[key]
            elif choice == 1 and isinstance(container, dict):
                container[f'{key}s'] = container[key]
            else:
                container[key] = draw(ANYTHING)
    return data


def composer_accepts(data):
    """Return Composer's verdict, and `None` where a limit of the data's own keeps it from one."""
    loaded = load_system_text(json.dumps(data))
    structural = {'missing-key', 'unknown-key', 'wrong-type', 'bad-value', 'out-of-range', 'conflicting-keys', 'unsupported-version'}  # fmt: skip
    others = {
        'bad-node-interface',
        'bad-argument-declaration',
        'bad-name',
        'bad-variable',
        'missing-include',
        'unknown-qos-profile',
    }
    rules = {each.rule for each in loaded.diagnostics}
    if 'too-many-entries' in rules:
        return None
    assert rules <= structural | others
    assert loaded.spec is not None
    return not rules & structural


def check_agreement(data):
    """Hold Composer, an editor and both validators against each other; return the verdict."""
    accepted = composer_accepts(data)
    assume(accepted is not None)
    verdict = EDITOR.is_valid(data)
    assert accepted == verdict
    errors = {problem_of(error) for error in Draft202012Validator(PLAIN).iter_errors(data)}
    assert not (errors and QUICK.is_surely_valid(data))
    # With what is right passed over, the same findings come out.
    for validator in (QUICK, ALONE):
        assert {problem_of(error) for error in validator.iter_errors(data)} == errors
    return verdict


def test_an_editor_composer_and_both_validators_have_the_same_verdict():
    verdicts = []

    @settings(
        max_examples=30, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
    )
    @given(documents())
    def agree(data):
        verdicts.append(check_agreement(data))

    agree()
    # One in ten is right. Which ones are tried depends on the modules that are imported by then.
    assert 0 < sum(verdicts) < len(verdicts) - 10


def problem_of(error):
    return tuple(error.absolute_path), error.validator, error.message


SAMPLES = {
    'period': 1, 'rate': 2, 'behaviour': 'a:b', 'with': {'x': 1}, 'publish': 'a', 'message': {}, 'type': 'a/msg/B',
    'clock': 'ros', 'default': 1, 'choices': [1], 'minimum': 0, 'concurrency': 'queue', 'accept': 'a:b', 'profile': 'a',
}  # fmt: skip
KINDS_OF_TYPES = {'service': 'srv', 'action': 'action', 'action_client': 'action'}
OF_A_NODE = [
    'subscription',
    'timer',
    'service',
    'action',
    'publisher',
    'parameter',
    'action_client',
]


@pytest.mark.parametrize('kind', OF_A_NODE)
def test_every_choice_of_keys_has_one_verdict(kind):
    definition = PLAIN['$defs'][kind]
    known = definition.get('properties') or definition['oneOf'][-1]['properties']
    samples = SAMPLES | {'type': f'a/{KINDS_OF_TYPES.get(kind, "msg")}/B'}
    samples |= {'type': 'integer'} if kind == 'parameter' else {}
    keys = [key for key in samples if key in known]
    chosen = itertools.chain.from_iterable(
        itertools.combinations(keys, count) for count in range(len(keys) + 1)
    )
    verdicts = set()
    for names in chosen:
        entity = {key: samples[key] for key in names}
        data = {'version': 1, 'nodes': {'n': {f'{kind}s': {'e': entity}}}}
        verdict = EDITOR.is_valid(data)
        assert composer_accepts(data) == verdict, names
        verdicts.add(verdict)
    assert verdicts == {True, False}


@pytest.mark.parametrize('validator', [QUICK, ALONE], ids=['quick', 'alone'])
@pytest.mark.parametrize(
    ('node', 'is_valid'),
    [
        *(({'timers': {'t': {key: number, 'behaviour': 'a:b'}}}, False)
          for key in ('period', 'rate') for number in (math.nan, math.inf, -math.inf)),
        ({'warn_after': None}, True),
        ({'warn_after': math.nan}, False),
        ({'warn_after': math.inf}, False),
        ({'warn_after': True}, False),
        ({'parameters': {'p': math.nan}}, True),
        ({'timers': {'t': {'period': 1, 'behaviour': 'ä:ö'}}}, True),
        ({'timers': {'t': {'period': 1, 'behaviour': 'a:b', 'with': {'deep': DEEP}}}}, True),
        ({'timers': {'t': {'period': 1, 'behaviour': 'a:b', 'with': {'key': {1: 2}}}}}, True),
    ],
)  # fmt: skip
def test_what_json_does_not_have_has_one_verdict(validator, node, is_valid):
    data = {'version': 1, 'nodes': {'n': node}}
    assert is_valid == (not [*validator.iter_errors(data)])
    assert is_valid or not validator.is_surely_valid(data)


def test_findings_are_the_same_without_jsonschema_rs(monkeypatch):
    files = sorted(Path(composer.__file__).parent.glob('rules/*/bad.yaml'))[::3]

    def find_all():
        structure._schema.cache_clear()
        texts = [file.read_text(errors='replace') for file in files]
        return [
            [(finding.sort_key, finding.help) for finding in load_system_text(text).diagnostics]
            for text in texts
        ]

    quick = find_all()
    assert structure._schema(structure.SCHEMA_NAME).is_surely_valid({'version': 1, 'nodes': {}})
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, 'jsonschema_rs', None)
        alone = find_all()
        assert not structure._schema(structure.SCHEMA_NAME).is_surely_valid(
            {'version': 1, 'nodes': {}}
        )
    structure._schema.cache_clear()
    assert alone == quick
    assert sum(map(len, quick)) > len(files) / 4
