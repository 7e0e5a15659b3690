"""Expressions inside scalars: what they may be, what they give, and where their findings are."""

import json

import pytest
from jsonschema import Draft202012Validator

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text
from composer.schema import schema_path
from composer.schema.structure import without_templates

HEAD = """
version: 1
args: {name: {default: rover}, count: {default: 3}, rate: {default: 0.5}, loud: {default: true}}
nodes:
  n:
    state:
"""


def load(state):
    return load_system_text(f'{HEAD}      {state}\n')


def value(scalar):
    """Return what becomes of a scalar."""
    loaded = load(f'x: {scalar}')
    assert loaded.diagnostics == []
    return loaded.spec.nodes['n'].state['x']


def findings(state):
    return [
        (each.rule, each.message, f'{each.span.line}:{each.span.column}', each.span.text)
        for each in load(state).diagnostics
    ]


@pytest.mark.parametrize(
    ('scalar', 'expected'),
    [
        ('"{{ count }}"', 3),
        ('"{{ rate }}"', 0.5),
        ('"{{ name }}"', 'rover'),
        ('"{{ none }}"', None),
        ('"{{ count * 2 + 1 }}"', 7),
        ('"{{ count / 2 }}"', 1.5),
        ('"{{ count if loud else 0 }}"', 3),
        ('"{{ name|upper }}"', 'ROVER'),
        ('"{{ range(5)|select(\'odd\')|sum }}"', 4),
        ('"{{ [2, 1]|sort|join(\'-\') }}"', '1-2'),
        ('"{{ 1 < count <= 3 and count in [3] and 4 not in [3] }}"', True),
        ('"{{ \'{:>4}|{n}\'.format(count, n=name) }}"', '   3|rover'),
        ("\"{{ {'a': 1}.get('b', 7) + {'a': 1}.a + {'a': 1}['a'] }}\"", 9),
        ('"{{ nothing is defined or nothing|default(4) == 4 }}"', True),
        ('"{{ [name, (1, 2)] }}"', ['rover', [1, 2]]),
        ("\"{{ {'a': {'b': count}} }}\"", {'a': {'b': 3}}),
        ('"{{ \'{{\' }}"', '{{'),
        ('"{{ name }}_{{ count }}"', 'rover_3'),
        ('"at {{ rate }}, {{ loud }}, {{ none }}."', 'at 0.5, true, .'),
        ('"{{ name }} {% if %} {# x #} }} ${x}"', 'rover {% if %} {# x #} }} ${x}'),
        ('"{% if x %}"', '{% if x %}'),
        ('"AT{{ count }}\\r\\n"', 'AT3\r\n'),
        ('"{{ count\\r\\n }}_{{ count }}"', '3_3'),
    ],
)
def test_a_whole_expression_keeps_its_type_and_any_other_becomes_text(scalar, expected):
    found = value(scalar)
    assert found == expected
    assert type(found) is type(expected)


def test_keys_and_items_are_filled_too():
    loaded = load('{"{{ name }}_a": ["{{ count }}", {"b{{ count }}": 1}], "{{ loud }}": 2}')
    assert loaded.diagnostics == []
    assert loaded.spec.nodes['n'].state == {'rover_a': [3, {'b3': 1}], 'true': 2}


@pytest.mark.parametrize(
    ('state', 'name', 'place'),
    [
        ('x: "{{ nmae }}"', 'nmae', '7:14'),
        ('x: "{{ count + nmae }}"', 'nmae', '7:22'),
        ('x: |\n        one nmae\n        {{ nmae }}', 'nmae', '9:12'),
        ('x: "one\n        {{ nmae }}"', 'nmae', '8:12'),
        ('"{{ nmae }}": 1', 'nmae', '7:11'),
        ('x: [1, "{{ nmae }}"]', 'nmae', '7:18'),
        ("x: \"{{ evn('CITY', 'Ulm') }}\"", 'evn', '7:14'),
    ],
)
def test_an_undefined_name_is_shown_where_it_stands(state, name, place):
    if name is None:
        assert [each[0] for each in findings(state)] == ['bad-key']
        return
    assert findings(state) == [('undefined-name', f"'{name}' is not defined", place, name)]


def test_an_undefined_name_comes_with_the_nearest_one_or_with_all():
    text = '{x: "{{ nmae }}", z: "{{ rnge(2) }}", y: "{{ zzz }}", w: "{{ abs(count) }}"}'
    helps = [each.help for each in load(text).diagnostics]
    assert helps == [
        "did you mean 'name'?",
        "did you mean 'range'?",
        'in scope are: count, env, find, here, loud, name, range, rate',
        "it is a filter: write 'value | abs'",
    ]
    (finding,) = load_system_text('version: 1\nnodes: {}\ndescription: "{{ a }}"').diagnostics
    assert finding.help == "declare it as an argument, under 'args'"


@pytest.mark.parametrize(
    'expression',
    [
        "''.__class__.__mro__",
        'count.__class__',
        'range.__globals__',
        'name.format.__self__',
        "'{0.__class__}'.format(name)",
        "'{x.__class__}'.format_map({'x': name})",
        "name|attr('__class__')",
        '[].__init__.__globals__',
    ],
)
def test_ways_out_of_the_sandbox_are_closed(expression):
    ((rule, message, *_),) = findings(f'x: "{{{{ {expression} }}}}"')
    assert rule == 'bad-expression'
    assert 'unsafe' in message or 'has no attribute' in message or 'undefined' in message


@pytest.mark.parametrize(
    'name', ['self', 'lipsum(1)', 'cycler(1).next()', 'dict(a=1)', 'open', 'undefined']
)
def test_nothing_is_in_scope_that_is_not_promised(name):
    assert [each[0] for each in findings(f'x: "{{{{ {name} }}}}"')] != []


@pytest.mark.parametrize(
    ('expression', 'message'),
    [
        ('', 'unexpected end of the expression'),
        ('count count', 'unexpected text after the expression'),
        ('count = 3', "'=' compares nothing: write '=='"),
        ('1 / 0', 'the expression raised ZeroDivisionError: division by zero'),
        ("count + 'a'", "unsupported operand type(s) for +: 'int' and 'str'"),
        ('name.nothing', "'str object' has no attribute 'nothing'"),
        ('name.upper', 'the expression returns a '),
        ('1 is odder', "there is no test 'odder'"),
        ('{1: 2}', 'the expression returns a dict, which YAML cannot represent'),
        ('9 ** 99999', "the result of '**' is too large"),
        ('1' * 400, 'a number of 1326 bits does not fit any ROS type'),
    ],
)
def test_an_expression_that_fails_says_why(expression, message):
    ((rule, found, place, _),) = findings(
        f"x: '{{{{ {expression.replace(chr(39), chr(39) * 2)} }}}}'"
    )
    # A quote is doubled in the file: the whole value is shown.
    column = 10 if "'" in expression else 11
    if 'pprint' in expression:
        column = 14 + expression.index('pprint')
    assert (rule, place) == ('bad-expression', f'7:{column}')
    assert message in found


@pytest.mark.parametrize(
    'text', ['{{', 'a {{ b', '{{ "', '{{ (', '{{ count }', '{{{ count }}', '{{ }} }}']
)
def test_an_expression_without_an_end_or_a_beginning_is_a_finding_not_a_crash(text):
    assert [each[0] for each in findings(f"x: '{text}'")] == ['bad-expression']


def test_what_could_not_be_evaluated_is_left_out_and_causes_no_more_findings():
    text = (
        'version: 1\nnodes: {n: {log_level: "{{ a }}", publishers: {p: "{{ b }}"}, '
        'parameters: {q: {default: [1, "{{ c }}"], type: integer_array}}, '
        'timers: {t: {period: "{{ d }}", publish: p, message: 1}}}}'
    )
    assert check(text) == [('undefined-name', 2)] * 4


SAMPLED = """
version: 1
args: {level: {}, count: {type: integer}, kind: {type: string}, mode: {choices: [loud]}}
nodes:
  n:
    log_level: "{{ level }}"
    publishers: {p: "{{ kind }}", q: {type: std_msgs/msg/Int32, external: true}}
    timers:
      a: {period: "{{ 1 / (count - 1) }}", publish: q, message: 1}
      b: {period: 1, behaviour: "behaviours.{{ kind }}:run"}
      c: {period: 1, publish: "{{ kind }}", message: 1}
    parameters: {r: {default: "{{ count }}", minimum: 10}}
"""


def check(text, words=None):
    found = check_system(load_system_text(text, words=words), InterfaceCatalogue([]))
    return [(each.rule, each.span.line) for each in found]


def test_a_check_says_nothing_of_values_that_only_the_command_line_gives():
    assert check(SAMPLED) == []


def test_with_words_the_same_values_are_checked():
    assert check(SAMPLED, ['loud', '1', 'x', 'loud']) == [
        ('bad-value', 6),
        ('bad-value', 7),
        ('bad-expression', 9),
        ('unknown-behaviour', 10),
        ('unknown-publisher', 11),
        ('bad-parameter', 12),
    ]


def test_a_check_takes_defaults_and_the_first_choice_as_they_are():
    assert check(SAMPLED.replace('{{ level }}', '{{ mode }}')) == [('bad-value', 6)]


WANTS = {
    'executor': '{threads: "{{ v }}", shutdown_timeout: "{{ v }}"}',
    'qos': '{p: {depth: "{{ v }}", history: "{{ v }}", deadline: "{{ v }}"}}',
    'nodes': '{n: {use_sim_time: "{{ v }}", log_level: "{{ v }}", on_error: "{{ v }}", '
    'parameter_services: "{{ v }}", rosout: "{{ v }}", '
    'type_description_service: "{{ v }}", logger_services: "{{ v }}", '
    'on_start: "{{ v }}", publishers: {a: "{{ v }}", b: {type: "{{ v }}"}}, '
    'parameters: {c: {default: 1, read_only: "{{ v }}", minimum: "{{ v }}", type: "{{ v }}"}}, '
    'timers: {t: {period: "{{ v }}", clock: "{{ v }}", behaviour: "b.{{ v }}:f"}}}}',
}


def test_the_schema_lets_editors_accept_expressions_for_numbers_words_and_types():
    import yaml

    validator = Draft202012Validator(json.loads(schema_path().read_text()))
    data = {'version': 1} | {key: yaml.safe_load(text) for key, text in WANTS.items()}
    assert list(validator.iter_errors(data)) == []
    for wrong in ('{ v }', 'v }}', 'fast'):
        text = json.dumps(data).replace('{{ v }}', wrong).replace(f'b.{wrong}:f', 'b:f')
        # Those of the parameter are one.
        assert len(list(validator.iter_errors(json.loads(text)))) == 18


def test_with_the_values_in_place_the_schema_accepts_no_expression():
    schema = without_templates(json.loads(schema_path().read_text()))
    used = json.dumps({key: part for key, part in schema.items() if key != '$defs'})
    used += json.dumps(
        {name: part for name, part in schema['$defs'].items() if name != 'template'}
    )
    assert 'template"' not in used
    # A value may be what an expression looks like.
    text = 'version: 1\nargs: {v: {default: x}}\nnodes: {n: {timers: {t: {period: "{{ \'{{ v }}\' }}", behaviour: a:b}}}}'
    (finding,) = load_system_text(text).diagnostics
    assert finding.message == "expected a number, got '{{ v }}'"


@pytest.mark.parametrize(
    ('expression', 'message'),
    [
        ('name | uper', "there is no filter 'uper' (did you mean 'upper'?)"),
        ('name is definde', "there is no test 'definde' (did you mean 'defined'?)"),
        ('name | xyzzy', "there is no filter 'xyzzy'"),
    ],
)
def test_a_filter_or_test_that_is_not_there_comes_with_the_nearest(expression, message):
    ((rule, said, *_),) = findings(f'x: "{{{{ {expression} }}}}"')
    assert (rule, said) == ('bad-expression', message)
