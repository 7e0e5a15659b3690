"""`vars`, computed defaults of arguments, and arguments with dots in their names."""

import random

import pytest

from composer.cli.showing.show import describe_origin
from composer.errors import UsageError
from composer.language.pipeline import load_combinations, load_system, load_system_text

DECLARED = """
version: 1
args:
  robot: {default: left, choices: [left, right]}
  frame: "{{ robot }}_base"
  twice: "{{ count * 2 }}"
  count: 3
  fast: {type: bool, default: "{{ twice > 10 }}"}
  camera.profile: "{{ width }}x480"
vars:
  chosen: {links: ["{{ frame }}", "{{ 'quick' if fast else 'slow' }}"], more: "{{ sum }}"}
  sum: "{{ count + twice }}"
  width: 640
nodes:
  n:
    state:
      frame: "{{ chosen.links[0] }}"
      speed: "{{ chosen.links[1] }}"
      sum: "{{ chosen.more }}"
      profile: "{{ args['camera.profile'] }}"
      all: "{{ args | length }}"
"""
DEFAULTS = {'frame': 'left_base', 'speed': 'slow', 'sum': 9, 'profile': '640x480', 'all': 6}


def findings(text, words=None):
    return [
        (each.rule, f'{each.span.line}:{each.span.column}', each.message)
        for each in load_system_text(text, words=words).diagnostics
    ]


@pytest.mark.parametrize(
    ('words', 'changes'),
    [
        ([], {}),
        (['robot:=right'], {'frame': 'right_base'}),
        (['count:=6'], {'sum': 18, 'speed': 'quick'}),
        (['twice:=20'], {'sum': 23, 'speed': 'quick'}),
        (['right', 'odom'], {'frame': 'odom'}),
        (['camera.profile:=1x2', 'fast:=true'], {'profile': '1x2', 'speed': 'quick'}),
    ],
)
def test_values_are_computed_from_others_in_any_order(words, changes):
    system = load_system_text(DECLARED, words=words)
    assert system.diagnostics == []
    assert dict(system.spec.nodes['n'].state) == DEFAULTS | changes


def test_a_value_is_computed_after_those_that_it_needs_whatever_the_order_of_the_file():
    random_order = random.Random(7)
    for _ in range(20):
        names = [f'v{index}' for index in range(30)]
        lines = [
            '  v0: 1\n',
            *(f'  v{i}: "{{{{ v{i - 1} + v{i // 2} }}}}"\n' for i in range(1, 30)),
        ]
        random_order.shuffle(lines)
        text = (
            f'version: 1\nvars:\n{"".join(lines)}nodes: {{n: {{state: {{x: "{{{{ v29 }}}}"}}}}}}\n'
        )
        expected = [1]
        for index in range(1, len(names)):
            expected.append(expected[-1] + expected[index // 2])
        system = load_system_text(text)
        assert system.diagnostics == []
        assert system.spec.nodes['n'].state['x'] == expected[-1]


@pytest.mark.parametrize(
    ('lines', 'found'),
    [
        (
            'vars: {a: "{{ a }}"}',
            [('value-cycle', '2:11', "'a' needs itself")],
        ),
        (
            'vars: {a: "{{ c }}", b: "{{ a }}", c: "{{ b }}", d: "{{ a + 1 }}"}',
            [('value-cycle', '2:11', "'a' needs 'c', which needs 'b', which needs 'a'")],
        ),
        (
            'args: {a: {type: integer, default: "{{ b }}"}}\nvars: {b: fast}',
            [('bad-argument-declaration', '2:36', "expected an integer, got 'fast'")],
        ),
        (
            'args: {a: "{{ [1, 2] }}"}',
            [
                (
                    'bad-argument-declaration',
                    '2:11',
                    'an argument is a bool, a number or a string, not [1, 2]',
                )
            ],
        ),
        # One that follows from another is not told.
        ('vars: {a: "{{ 1 // 0 }}", b: "{{ a + 1 }}"}', [('bad-expression', '2:12', None)]),
        ('vars: {a: "{{ bb }}", b: 1}', [('undefined-name', '2:15', "'bb' is not defined")]),
        # What an argument without a value will be is not known.
        ('args: {n: {type: string}, a: {type: integer, default: "{{ n | int }}"}}', []),
        ('vars: [a]', [('wrong-type', '2:7', None)]),
    ],
)
def test_a_value_that_cannot_be_computed_is_one_finding_with_its_place(lines, found):
    told = findings(f'version: 1\n{lines}\nnodes: {{}}\n')
    assert [each[:2] for each in told] == [each[:2] for each in found]
    for (*_, message), (*_, expected) in zip(told, found, strict=True):
        assert expected in (None, message)


def test_a_given_argument_has_the_type_of_its_computed_default():
    with pytest.raises(UsageError, match="'twice': expected an integer, got 'much'"):
        load_system_text(DECLARED, words=['twice:=much'])
    with pytest.raises(UsageError, match=r"there is no argument 'camera\.profil'"):
        load_system_text(DECLARED, words=['camera.profil:=1x2'])


def test_each_file_has_its_own_variables(tmp_path):
    (tmp_path / 'part.yaml').write_text(
        'version: 1\nargs: {a.b: 1, c: "{{ args[\'a.b\'] + 1 }}"}\nvars: {v: "{{ c * 10 }}"}\n'
        'nodes: {part: {state: {v: "{{ v }}"}}}\n'
    )
    (tmp_path / 'main.yaml').write_text(
        'version: 1\nargs: {n: 4}\nvars: {v: "{{ n + 1 }}"}\n'
        'include: {p: {file: part.yaml, args: {a.b: "{{ v }}"}}, q: {file: part.yaml, '
        'namespace: q, args: {c: 7}}}\nnodes: {main: {state: {v: "{{ v }}"}}}\n'
        'check: {other: {args: {n: 5}}}\n'
    )
    (tmp_path / 'layer.yaml').write_text('vars: {v: 0}\n')

    def states(system):
        assert system.diagnostics == []
        return [node.state['v'] for node in system.spec.nodes.values()]

    main = tmp_path / 'main.yaml'
    assert states(load_system(main)) == [5, 60, 70]
    assert states(load_system(main, layers=[tmp_path / 'layer.yaml'])) == [0, 10, 70]
    assert states(load_system(main, set_values=['vars.v=1'])) == [1, 20, 70]
    assert [states(system) for _, system in load_combinations(main)] == [[6, 70, 70]]


def test_the_origin_of_a_value_names_the_line_that_computes_it():
    system = load_system_text(DECLARED)
    note = describe_origin(system, ('nodes', 'n', 'state', 'sum')).partition(', ')[2]
    assert note.endswith('(<text>:11)')
    assert describe_origin(system, ('vars', 'sum')) == (
        '<text>:12, count = 3 (default, <text>:7), twice = 6 (<text>:6)'
    )
