"""`composer show --params`: one parameter file for a whole system, which rcl reads back."""

import textwrap

import pytest
import yaml

from composer.cli.main import run
from composer.ros_parameters.file_reader import parse_parameter_file
from composer.ros_parameters.overrides import find_overrides

SYSTEM = """
    version: 1
    args: {speed: 1.5}
    nodes:
      arm:
        namespace: robot
        use_sim_time: true
        parameter_files: [p.yaml]
        parameters:
          speed: "{{ speed }}"
          label: x
          gains: [1.0, .inf, 5.0e-324, 1.0e+300]
          numbers: {default: [1, -9223372036854775808], type: integer_array}
          flags: [true, false]
          texts: ["5", "yes", "{{ '{{ x }}' }}", "a \\"b\\"\\n", "\\u00e9\\u0007"]
          sub.deep: 1
          nothing: {type: integer}
          empty: {default: [], type: string_array}
          octets: {default: [1], type: byte_array}
      quiet: {}
      leg:
        parameters: {length: 2}
"""
VALUES = '/**:\n  ros__parameters: {label: "on", sub: {deep: 0x10}}\n'
EXPECTED = r"""
    /robot/arm:
      ros__parameters:
        use_sim_time: true
        speed: 2.5
        label: "on"
        gains: [1.0, .inf, 0x0.0000000000001p-1022, 1e+300]
        numbers: [1, -9223372036854775808]
        flags: [true, false]
        texts: ["5", "yes", "{{ x }}", "a \"b\"\n", "é\u0007"]
        sub.deep: 16
        # empty: an empty list has no type in a parameter file
        # octets: parameter files have no byte type
    /leg:
      ros__parameters:
        length: 2
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'system.yaml').write_text(textwrap.dedent(SYSTEM).lstrip())
    (tmp_path / 'p.yaml').write_text(VALUES)
    return tmp_path


@pytest.fixture
def text(folder, capsys):
    assert run(['show', '--params', 'system.yaml', 'speed:=2.5']) == 0
    return capsys.readouterr().out


def test_it_prints_the_values_as_they_will_be(text):
    assert text == textwrap.dedent(EXPECTED).lstrip()


def test_a_system_without_parameters_gives_a_file_without_any(folder, capsys):
    (folder / 'system.yaml').write_text('version: 1\nnodes: {a: {}}\n')
    assert run(['show', '--params', 'system.yaml']) == 0
    assert capsys.readouterr().out == '# no node has parameters\n'


def test_layers_and_settings_count(folder, capsys):
    (folder / 'site.yaml').write_text('version: 1\nnodes: {leg: {parameters: {width: 1}}}\n')
    settings = ['--set', 'nodes.leg.parameters.length=3']
    assert run(['show', '--params', 'system.yaml', 'site.yaml', *settings]) == 0
    assert capsys.readouterr().out.endswith('    length: 3\n    width: 1\n')


def test_a_value_that_would_be_refused_is_said(folder, capsys):
    (folder / 'p.yaml').write_text('/**: {ros__parameters: {speed: 1}}\n')
    assert run(['show', '--params', 'system.yaml']) == 1
    captured = capsys.readouterr()
    assert 'p.yaml:1:32: error[refused-parameter]' in captured.err
    assert captured.out == ''


def test_parameter_files_are_shown_with_absolute_paths(folder, capsys):
    assert run(['show', 'system.yaml']) == 0
    shown = yaml.safe_load(capsys.readouterr().out)
    assert shown['nodes']['arm']['parameter_files'] == [f'{folder}/p.yaml']


@pytest.mark.ros
def test_rcl_reads_back_the_same_values(text, tmp_path, domain_id):
    rclpy = pytest.importorskip('rclpy')
    path = tmp_path / 'all.yaml'
    path.write_text(text)
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain_id)
    node = rclpy.create_node(
        'arm',
        namespace='robot',
        context=context,
        cli_args=['--ros-args', '--params-file', str(path)],
        use_global_arguments=False,
        automatically_declare_parameters_from_overrides=True,
    )
    read = {
        name: (each.type_.name.lower(), repr(each.value))
        for name, each in node._parameters.items()
        if name != 'start_type_description_service'
    }
    node.destroy_node()
    context.try_shutdown()
    context.destroy()
    ours = find_overrides([parse_parameter_file(text, 'all.yaml')], '/robot/arm')
    assert read == {name: (entry.type, repr(entry.value)) for name, entry in ours.items()}
    assert read['gains'] == ('double_array', '[1.0, inf, 5e-324, 1e+300]')
    assert read['texts'][1] == repr(['5', 'yes', '{{ x }}', 'a "b"\n', 'é\x07'])
    assert len(read) == 8
