"""Parameter files that are changed before ROS reads them, and those that should have been."""

import textwrap

import pytest

from composer.ros_parameters.expressions_in_files import Treatment
from composer.ros_parameters.file_reader import (
    parse_parameter_file,
    read_parameter_file,
    render_treated_file,
)

VALUES = {
    'robot': 'left',
    'count': 3,
    'speed': 1.0,
    'tiny': 5e-324,
    'fast': True,
    'text': '010',
    'word': 'yes',
    'list': [1, 2],
    'words': ['a', 'on'],
    'camera.profile': '640x480',
    'group': {'inner': 2, 'deep': {'a': 'b'}},
}
# What rcl reads in ways of its own, and what the text has beside it.
FILE = """
/**:   # for all
  ros__parameters:
    use_sim_time: yes
    octal: 010
    double: 1.0
    exponent: 1e3
    quoted: "1.0"
    single: 'it''s'
    tagged: !!str 5
    block: |
      two
      lines
    folded: >
      one
      line
    wide: "ä\\x07, b: c # d"
    list: [a, "1", 'on']
    nested: {a: 1, b.c: 2}
    null_text: "null"
arm:
  ros__parameters: {speed: 0.5}
other/arm:
  ros__parameters:
    speed: .5
---
robot:
  arm:
    ros__parameters: {last: -0x1F}
"""


def parse(text, **options):
    treatment = Treatment(**options)
    return parse_parameter_file(textwrap.dedent(text).lstrip('\n'), 'p.yaml', 1000, treatment)


def contents(file):
    assert file.findings == ()
    return [(each.pattern, each.name, each.type, each.value) for each in file.entries]


@pytest.mark.parametrize(
    ('written', 'type_name', 'value'),
    [
        ('"{{ robot }}"', 'string', 'left'),
        ('"{{ robot }}_base"', 'string', 'left_base'),
        ('at {{ robot }} / {{ count }}', 'string', 'at left / 3'),
        ('"{{ speed * 2 }}"', 'double', 2.0),
        ('"{{ tiny }}"', 'double', 5e-324),
        ('"{{ fast }}"', 'bool', True),
        # Texts stay texts, whatever rcl would make of them.
        ('"{{ text }}"', 'string', '010'),
        ('"{{ list }}"', 'integer_array', [1, 2]),
        ('["{{ robot }}", x]', 'string_array', ['left', 'x']),
        ('"{{ args[\'camera.profile\'] }}"', 'string', '640x480'),
        ('!!str "{{ robot }}"', 'string', 'left'),
    ],
)
def test_an_expression_gives_a_value_of_its_type_also_when_ros_reads_it(
    tmp_path, written, type_name, value
):
    path = tmp_path / 'p.yaml'
    path.write_text(f'"/{{{{ robot }}}}/arm":\n  ros__parameters:\n    p: {written}\n')
    treatment = Treatment(values=VALUES)
    expected = [('/left/arm', 'p', type_name, value)]
    assert contents(read_parameter_file(path, treatment=treatment)) == expected
    # What a process is given says the same without any treatment.
    given = render_treated_file(path, treatment)
    assert '{{' not in given
    assert contents(parse_parameter_file(given, 'given.yaml')) == expected


@pytest.mark.parametrize('root', ['', 'left', '/left', 'a/b/'])
def test_a_changed_file_says_what_the_file_says_below_its_root(tmp_path, root):
    path = tmp_path / 'p.yaml'
    path.write_text(FILE)
    prefix = f'/{root.strip("/")}/' if root else ''
    plain = contents(read_parameter_file(path))
    assert len(plain) == 17
    expected = [
        (f'{prefix}{pattern.lstrip("/")}' if root else pattern, *rest) for pattern, *rest in plain
    ]
    treatment = Treatment(root, VALUES)
    assert contents(read_parameter_file(path, treatment=treatment)) == expected
    given = render_treated_file(path, treatment)
    assert contents(parse_parameter_file(given, 'given.yaml')) == expected


def findings(text, **options):
    found = parse(text, **options).findings
    return [(each.rule, each.span.line, each.span.text, each.help) for each in found]


@pytest.mark.parametrize(
    ('written', 'meant'),
    [
        ('$(var robot)', '{{ robot }}'),
        ('"$(var camera.profile)"', "{{ args['camera.profile'] }}"),
        ('$(find-pkg-share arm_driver)', "{{ find('arm_driver') }}"),
        ('$(env HOME)', "{{ env('HOME') }}"),
        ('$(env SITE lab)', "{{ env('SITE', 'lab') }}"),
        ('$(optenv SITE)', "{{ env('SITE', '') }}"),
        ('$(dirname)', '{{ here }}'),
        ("$(eval '1 + 2')", 'an expression in its place'),
        ('"{{ robot }}"', None),
    ],
)
def test_what_nobody_evaluates_is_an_error_with_what_to_write(written, meant):
    plain = written.strip('"')
    text = f'arm:\n  ros__parameters:\n    p: {written}\n'
    ((rule, line, shown, advice),) = findings(text)
    assert (rule, line, shown) == ('unevaluated-expression', 3, plain)
    assert (f'write {meant}' in advice) if meant else True
    assert 'expressions: true' in advice
    if meant:
        ((_, _, shown, advice),) = findings(text, values=VALUES)
        assert (shown, advice) == (plain, f'write {meant}')


@pytest.mark.parametrize(
    'written', ['$(date)', '$HOME', 'a $ b', '"{ x }"', "'{{'", '$var', '"}} {{"', '1  # $(var x)']
)
def test_what_looks_like_one_is_left_alone(written):
    assert findings(f'arm:\n  ros__parameters:\n    p: {written}\n') == []


def test_an_expression_that_fails_is_a_finding_at_its_place():
    text = """
        arm:
          ros__parameters:
            a: "{{ robt }}"
            b: "{{ count / 0 }}"
            c: {{ robot }}
        """
    found = findings(text, values=VALUES)
    assert [each[:2] for each in found] == [
        ('undefined-name', 3),
        ('bad-expression', 4),
        ('bad-parameter-file', 5),
    ]
    assert found[0][2:] == ('robt', "did you mean 'robot'?")
    assert found[2][3] == 'put an expression in quotes'
    # With samples, what fails may succeed.
    assert [each[1] for each in findings(text, values=VALUES, samples=['count'])] == [3, 5]
