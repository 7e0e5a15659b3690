"""`composer graph`."""

import json
import textwrap

import pytest

from composer.cli.main import run

ROBOT = """
    version: 1
    args: {arms: 1, name: {type: string}}
    nodes:
      "{{ name }}_{{ i }}":
        foreach: {i: "{{ range(arms) }}"}
        publishers: {state: std_msgs/msg/String}
        timers: {t: {rate: 1, publish: state, message: fine}}
"""


@pytest.fixture
def robot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'robot.yaml').write_text(textwrap.dedent(ROBOT).lstrip())
    return tmp_path


def test_it_draws_mermaid_by_itself(robot, capsys):
    assert run(['graph', 'robot.yaml', 'name:=arm']) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith('flowchart LR\n  n0(["arm_0"]):::node\n')
    assert captured.err == '1 warning in 1 file, marked in the drawing\n'


def test_arguments_layers_and_settings_count(robot, capsys):
    (robot / 'site.yaml').write_text('nodes: {extra: {}}\n')
    words = ['robot.yaml', 'site.yaml', 'arms:=2', 'name:=arm']
    assert run(['graph', *words, '--set', 'nodes.extra.namespace=/x', '--format', 'json']) == 0
    document = json.loads(capsys.readouterr().out)
    assert [node['id'] for node in document['nodes']] == [
        'node:/arm_0',
        'node:/arm_1',
        'node:/x/extra',
    ]


def test_a_missing_argument_is_a_matter_of_usage(robot, capsys):
    assert run(['graph', 'robot.yaml']) == 2
    assert "'name'" in capsys.readouterr().err


def test_the_ending_of_the_output_tells_the_form(robot, capsys):
    assert run(['graph', 'robot.yaml', 'name:=arm', '--output', 'robot.DOT']) == 0
    assert capsys.readouterr().out == ''
    assert (robot / 'robot.DOT').read_text().startswith('digraph "robot" {\n')


def test_a_suffix_that_no_format_has_is_a_matter_of_usage(robot, capsys):
    assert run(['graph', 'robot.yaml', 'name:=arm', '--output', 'robot.pdf']) == 2
    assert "no format has the suffix '.pdf'" in capsys.readouterr().err


def test_a_format_that_is_named_wins(robot):
    run(['graph', 'robot.yaml', 'name:=arm', '--output', 'robot.dot', '--format', 'json'])
    assert json.loads((robot / 'robot.dot').read_text())['name'] == 'robot'


def test_a_invalid_file_is_drawn(robot, capsys):
    (robot / 'robot.yaml').write_text('version: 1\nnodes: {n: {log_levl: debug}}\n')
    assert run(['graph', 'robot.yaml']) == 0
    assert "error: unknown key 'log_levl'" in capsys.readouterr().out.replace('<br/>', ' ')


@pytest.mark.parametrize('content', [None, 'version: 1\nnodes: [\n'])
def test_a_file_that_cannot_be_read_is_not_drawn(robot, capsys, content):
    (robot / 'robot.yaml').unlink()
    if content:
        (robot / 'robot.yaml').write_text(content)
    assert run(['graph', 'robot.yaml']) == 1
    captured = capsys.readouterr()
    assert captured.out == ''
    assert 'robot.yaml' in captured.err


def test_a_drawing_that_cannot_be_written_is_said(robot, capsys):
    assert run(['graph', 'robot.yaml', 'name:=arm', '--output', 'no/robot.dot']) == 1
    assert capsys.readouterr().err == (
        'error: cannot write the drawing to no/robot.dot: No such file or directory\n'
    )


def test_without_graphviz_it_ends_with_1_and_mermaid_still_works(robot, capsys, monkeypatch):
    monkeypatch.setattr('composer.drawing.graphviz.shutil.which', lambda name: None)
    monkeypatch.setattr('composer.drawing.graphviz.importlib.util.find_spec', lambda name: None)
    words = ['graph', 'robot.yaml', 'name:=arm', '--format']
    assert run([*words, 'svg']) == 1
    assert capsys.readouterr().err == (
        'error: svg and pages are laid out by Graphviz, which is not installed\n'
        "  help: install it (pip install 'rclpy-composer[graph]', or Graphviz, the package graphviz"
        ' of your system); mermaid, dot and json need none\n'
    )
    assert [run([*words, each]) for each in ('mermaid', 'dot', 'json')] == [0, 0, 0]
