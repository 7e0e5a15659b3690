"""ROS's own parameter files: what is read, what is wrong with it and where, and who gets it."""

import textwrap

import pytest

from composer.ros_parameters.file_reader import parse_parameter_file
from composer.ros_parameters.node_patterns import find_pattern_problem, matches_pattern
from composer.ros_parameters.overrides import find_overrides, parse_command_line
from composer.ros_parameters.rcl_values import parse_override


def parse(text):
    return parse_parameter_file(textwrap.dedent(text).lstrip('\n'), 'p.yaml')


def values_of(*texts, node='/robot/arm'):
    files = [parse(text) for text in texts]
    assert [finding for file in files for finding in file.findings] == []
    return {name: entry.value for name, entry in find_overrides(files, node).items()}


def test_nested_names_are_joined_with_dots():
    text = """
        robot:
          arm:
            ros__parameters:
              speed: 1.5
              grip: {force: 3, pads: {left: on}}
              joint.limits: [1, 2]
        """
    assert values_of(text) == {
        'speed': 1.5,
        'grip.force': 3,
        'grip.pads.left': True,
        'joint.limits': [1, 2],
    }


def test_a_namespace_may_have_parameters_after_its_nodes():
    text = """
        /robot:
          arm: {ros__parameters: {a: 1}}
          ros__parameters: {b: 1}
        """
    assert (values_of(text), values_of(text, node='/robot')) == ({'a': 1}, {'b': 1})


def test_quotes_and_the_tag_of_texts_keep_numbers_texts():
    text = """
        /**:
          ros__parameters: {a: "5", b: 'true', c: !!str 5, d: !!int "5", e: 5}
        """
    assert values_of(text) == {'a': '5', 'b': 'true', 'c': '5', 'd': '5', 'e': 5}


def test_several_documents_are_read_as_one():
    text = """
        /**: {ros__parameters: {a: 1, b: 1, c: {d: x}}}
        ---
        robot:
          arm: {ros__parameters: {b: 2}}
        ...
        ---
        /robot/arm: {ros__parameters: {c.e: [1.5]}}
        """
    assert values_of(text) == {'a': 1, 'b': 2, 'c.d': 'x', 'c.e': [1.5]}


@pytest.mark.parametrize('document', ['', '~', 'a', '[1]'])
def test_a_document_that_is_no_mapping_is_refused(document):
    file = parse_parameter_file(f'/**: {{ros__parameters: {{a: 1}}}}\n--- {document}\n', 'p.yaml')
    (finding,) = file.findings
    assert finding.message == "this value has no 'ros__parameters' above it"


def test_a_value_knows_its_place():
    entry = parse('/**:\n  ros__parameters:\n    sub:\n      list: [1, 22]\n').entries[0]
    assert entry.name == 'sub.list'
    assert str(entry.pattern_span) == 'p.yaml:1:1'
    assert str(entry.key_span) == 'p.yaml:4:7'
    assert str(entry.value_span) == 'p.yaml:4:13'
    assert [span.text for span in entry.spans] == ['1', '22']


FAULTS = {
    'a: 1': ("1:4 this value has no 'ros__parameters' above it"),
    'a:\n  ros_parameters: {b: 1}': "2:3 'ros_parameters' is not a key of parameter files",
    'a:\n  ros__parameterss: {b: 1}': "2:3 ROS reads 'ros__parameterss' as 'ros__parameters'",
    'a: {ros__parameters: 5}': "1:22 'ros__parameters' must be a mapping of parameters",
    'a: {ros__parameters: {b: }}': "1:26 'b' has no value",
    'a: {ros__parameters: {b: [1, ~]}}': (
        '1:30 all items of a list have one type: this is a string, the first is an integer'
    ),
    'a: {ros__parameters: {b: [[1]]}}': '1:27 a list of parameters cannot contain lists',
    'a: {ros__parameters: {b: {}}}': (
        "1:23 'b' is an empty mapping, and ROS misreads what follows it"
    ),
    'a: {ros__parameters: {b: 1}, c: {ros__parameters: {d: 1}}}': (
        "1:5 ROS misreads the names that follow 'ros__parameters'"
    ),
    'a: {ros__parameters: {b: {c.d: {e: 1}, f: 2}}}': (
        "1:27 ROS reads what follows 'c.d' as a part of it"
    ),
    'a: {ros__parameters: {b: 1, b: {c: 2}}}': ("1:23 'b' has both a value and names below it"),
    'a: {ros__parameters: {b: &x 1, c: *x}}': (
        '1:35 ROS does not support aliases here: write what *x stands for'
    ),
    'a-b: {ros__parameters: {c: 1}}': (
        "1:1 'a-b': a node name has only letters, digits and underscores"
    ),
    'a: {ros__parameters: {"": 1}}': '1:23 a key must be a string, and this one is empty',
}


@pytest.mark.parametrize(('text', 'said'), FAULTS.items())
def test_what_ros_refuses_or_misreads_is_a_finding(text, said):
    (finding,) = parse_parameter_file(text, 'p.yaml').findings
    assert f'{finding.span.line}:{finding.span.column} {finding.message}' == said
    assert finding.rule == 'bad-parameter-file'


@pytest.mark.parametrize(
    'text',
    [
        'a:\n  ros__parameters:\n    speed:=1.5\n',
        'a:\n  ros__parameters:\n    b: 1\n    speed:=1.5\n',
        'a:\n  ros__parameters:\n    speed:=1.5\n    b: 1\n',
    ],
)
def test_an_assignment_of_the_command_line_is_explained(text):
    (finding,) = parse_parameter_file(text, 'p.yaml').findings
    assert finding.help == "write 'speed: 1.5', ':=' is for command lines"


def test_what_is_no_yaml_is_a_finding_in_its_line():
    (finding,) = parse_parameter_file('/**:\n  ros__parameters: {a: [1\n', 'p.yaml').findings
    assert (finding.rule, finding.file) == ('yaml-syntax', 'p.yaml')


PATTERNS = {
    '/**': True,
    '/*': False,
    '/*/*': True,
    '/robot/**': True,
    '/**/arm': True,
    'arm': False,
    '/robot/arm': True,
    '/robot/**/arm': True,
    '/**/robot/**/arm/**': True,
    '**': True,
    '/robot/leg': False,
    '/*/*/*': False,
}


@pytest.mark.parametrize(('pattern', 'matches'), PATTERNS.items())
def test_wildcards_match_as_they_do_in_ros(pattern, matches):
    assert find_pattern_problem(pattern) is None
    assert matches_pattern(pattern, '/robot/arm') is matches


@pytest.mark.parametrize('pattern', ['/', '//', '/a//b', '/a/', '/a b', '/1a', '/a*/b', '/a/***'])
def test_what_names_no_node_is_refused(pattern):
    assert find_pattern_problem(pattern) is not None


def test_later_files_win():
    first = '/**: {ros__parameters: {a: 1, b: 1}}'
    assert values_of(first, '/**: {ros__parameters: {b: 2}}') == {'a': 1, 'b': 2}


def test_the_last_name_that_matches_wins_however_special_it_is():
    special, wild = 'robot/arm: {ros__parameters: {a: 1}}\n', '/**: {ros__parameters: {a: 2}}\n'
    assert values_of(special + wild) == {'a': 2}
    assert values_of(wild + special) == {'a': 1}
    assert values_of(wild + special, wild.replace('2', '3')) == {'a': 1}


def test_parameters_of_the_command_line_have_the_types_of_files():
    arguments = ['-p', 'a:=0x10', '-r', 'x:=y', '--param', 'b.c:=[1.5, 2.0]', '-p', 'd:=']
    arguments += ['-p', 'arm:e:=on', '-p', 'leg:f:=1', '-p', 'g:=[]', '-p', 'h:={i: 1}']
    assert parse_command_line(arguments, '/arm') == {
        'a': (16, 'integer'),
        'b.c': ([1.5, 2.0], 'double_array'),
        'e': (True, 'bool'),
    }
    assert 'e' not in parse_command_line(arguments, '/robot/arm')
    assert parse_override('[1, a]') is None
