"""A system of twelve files, three includes deep: shown, run, and with a finding in the deepest."""

import re
from itertools import count
from pathlib import Path

import pytest

from composer.cli.main import run
from composer.language.pipeline import load_system

ARGUMENTS = ('robot.yaml', 'site.yaml', 'rate:=7.5', '--set', 'nodes.robot_0.log_level=fatal')
SET = '--set nodes.robot_0.log_level=fatal'

HEADS = {
    'robot': """
        args: {rate: {type: double}, wheels: 4, sim: false}
        defaults: {namespace: top}
        include:
          "{{ side }}":
            foreach: {side: [left, right]}
            file: arm.yaml
            namespace: "{{ side }}"
            args: {rate: "{{ rate }}"}  # robot passes
          base: {file: base.yaml, namespace: base, args: {rate: "{{ rate }}", wheels: "{{ wheels }}"}}
          sensors: {file: sensors.yaml, when: "{{ not sim }}", remap: {sensors_news: /all/news}}
          none: {file: sensors.yaml, namespace: none, when: "{{ sim }}"}
    """,
    'base': """
        args: {rate: {type: double}, wheels: {type: integer}}
        include:
          "wheel_{{ i }}":
            foreach: {i: "{{ range(wheels) }}"}
            file: wheel.yaml
            namespace: "wheel_{{ i }}"
            args: {rate: "{{ rate }}"}
    """,
    'arm': """
        args: {rate: {type: double}}
        include:
          "joint_{{ j }}":
            foreach: {j: [1, 2]}
            file: joint.yaml
            namespace: "joint_{{ j }}"
            args: {rate: "{{ rate }}"}  # arm passes
          gripper: {file: gripper.yaml}
    """,
    'sensors': """
        include: {camera: {file: camera.yaml, namespace: camera}}
    """,
    'wheel': """
        args: {rate: {type: double}}
        include: {motor: {file: motor.yaml, args: {rate: "{{ rate }}"}}}
    """,
    'joint': """
        args: {rate: {type: double}}
        include:
          motor: {file: motor.yaml, args: {rate: "{{ rate }}"}}  # joint passes
    """,
    'gripper': 'qos: {slow: {depth: 2}}\n',
    'camera': """
        include: {lens: {file: lens.yaml, remap: {lens_news: picture}}}
    """,
    'motor': """
        args: {rate: {type: double}}
        qos: {slow: {depth: 3}}
    """,
    'lens': 'defaults: {log_level: error}\n',
}
NODE = """\
  {name}_{index}:
    description: token_{a}
    log_level: info
    parameters:
      number: {b}
      text: token_{c}
      limited:
        default: {d}
        description: token_{e}
    publishers:
      {name}_news:
        type: std_msgs/msg/String
        external: true
        qos: {{depth: {f}}}
    timers:
      talk: {{period: 1.0, publish: {name}_news, message: {{data: token_{g}}}}}
"""
LAST = {
    'motor': """\
  driver:
    parameters: {rate: "{{ rate }}", index: 0}  # motor takes
    parameter_files: [values.yaml]
""",
    'gripper': '  finger: {publishers: {n: {type: std_msgs/msg/String, qos: slow, external: true}}}\n'
    '  hand: {timers: {t: {period: 1.0, publish: m, message: {data: x}}},\n'
    '    publishers: {m: {type: std_msgs/msg/String, qos: slow, external: true}}}\n',
}
SITE = """
version: 1
nodes:
  robot_0: {description: token_1, parameters: {number: 10001}}
  robot_2: null
"""
VALUES = '/**:\n  ros__parameters: {index: 5}\n'


def write_system(folder):
    """Write the files; each value of the nodes stands once in all of them."""
    numbers = count(10_100)
    for name, head in HEADS.items():
        lines = [line.removeprefix(' ' * 8) for line in head.strip('\n').rstrip(' ').splitlines()]
        nodes = [
            NODE.format(name=name, index=index, **{each: next(numbers) for each in 'abcdefg'})
            for index in range(3)
        ]
        text = '\n'.join(['version: 1', *lines, 'nodes:', *nodes]) + LAST.get(name, '')
        (folder / f'{name}.yaml').write_text(text)
    # What finger publishes is said by nobody.
    gripper = folder / 'gripper.yaml'
    gripper.write_text(re.sub('  finger: .*\n', '', gripper.read_text()))
    (folder / 'site.yaml').write_text(SITE.lstrip())
    (folder / 'values.yaml').write_text(VALUES)


@pytest.fixture
def system(tmp_path, monkeypatch):
    folder = tmp_path / 'system'
    folder.mkdir()
    write_system(folder)
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def shown(system, capsys):
    """Return what a command of Composer prints."""

    def shown(*arguments, code=0):
        assert run([*map(str, arguments)]) == code
        captured = capsys.readouterr()
        assert not captured.err
        return captured.out

    return shown


def line_of(text):
    """Return the one place where something is written, as in `arm.yaml:3`."""
    found = [
        f'{path.name}:{number}'
        for path in sorted(Path.cwd().glob('*.yaml'))
        for number, line in enumerate(path.read_text().splitlines(), start=1)
        if re.search(rf'\b{re.escape(text)}\b', line)
    ]
    (place,) = found
    return place


def test_it_is_as_large_as_real_ones_and_has_no_findings(system, shown):
    files = sorted(system.glob('*.yaml'))
    assert len(files) == 12
    assert sum(len(path.read_text().splitlines()) for path in files) >= 500
    assert ': ok, ' in shown('check', 'robot.yaml', '--strict')


def told_of(system):
    """Return the parameters and the publishers of each node."""
    return {
        node.full_name: (
            {name: spec.value for name, spec in node.parameters.items()},
            {name: (spec.type, spec.topic) for name, spec in node.publishers.items()},
        )
        for node in system.spec.nodes.values()
    }


def test_what_is_shown_is_shown_the_same_again(system, shown, tmp_path):
    words = ['rate:=7.5']
    first = shown('show', 'robot.yaml', 'site.yaml', *words)
    flat = tmp_path / 'flat.yaml'
    flat.write_text(first)
    assert shown('show', flat) == first
    assert ': ok, ' in shown('check', flat, '--strict')
    assert first.count('period: 1.0') > 70
    layers = [Path('site.yaml')]
    assert told_of(load_system(flat)) == told_of(
        load_system(Path('robot.yaml'), words, layers=layers)
    )


def test_each_value_is_said_to_come_from_where_it_is_written(system, shown):
    seen = set()
    for line in shown('show', *ARGUMENTS, '--origin').splitlines():
        written, separator, origin = line.partition('  # ')
        value = re.search(r': "?(token_\d+|1\d{4})"?$', written.rstrip())
        if separator and value:
            assert origin == line_of(value[1]), line
            seen.add(value[1])
    text = ''.join(path.read_text() for path in sorted(system.glob('*.yaml')))
    all_values = set(re.findall(r'\b(token_\d+|1\d{4})\b', text))
    replaced = set(re.findall(r'\b(token_\d+|1\d{4})\b', text_of_robot(system)))
    assert all_values - seen == replaced


def text_of_robot(system):
    """Return what of `robot.yaml` a layer replaces or removes."""
    text = (system / 'robot.yaml').read_text()
    removed = text.partition('  robot_2:')[2]
    first = re.search(r'robot_0:\n.*description: (\S+)\n.*\n.*\n.*number: (\d+)', text)
    return removed + ' '.join(first.groups())


def test_an_argument_is_followed_through_all_files(system, shown):
    lines = shown('show', *ARGUMENTS, '--origin').splitlines()
    (origin, *others) = {line.partition('  # ')[2] for line in lines if ' rate: 7.5' in line} - {
        line.partition('  # ')[2] for line in lines if 'wheel.yaml' in line
    }
    assert not others
    assert origin == (
        f'{line_of("motor takes")}, rate = 7.5 ({line_of("joint passes")}, rate = 7.5 '
        f'({line_of("arm passes")}, rate = 7.5 ({line_of("robot passes")}, '
        'rate = 7.5 (command line))))'
    )


def test_layers_and_settings_are_named(system, shown):
    output = shown('show', *ARGUMENTS, '--origin')
    assert 'robot_2' not in output
    assert re.search(rf'log_level: fatal +# {re.escape(SET)}\n', output)


def test_a_finding_in_the_deepest_file_is_said_there_with_all_includes(system, capsys):
    motor = system / 'motor.yaml'
    motor.write_text(motor.read_text().replace('log_level: info', 'log_level: inof', 1))
    assert run(['check', 'robot.yaml']) == 1
    findings = [each for each in capsys.readouterr().out.split('\n\n') if 'error[' in each]
    place = line_of('log_level: inof')
    assert all(each.startswith(f'{place}:16: error[') for each in findings)
    chains = [re.findall(r'^  (\S+): included here$', each, re.MULTILINE) for each in findings]
    names = {tuple(re.findall(r'(\w+)\.yaml', ' '.join(chain))) for chain in chains}
    assert ('joint', 'arm', 'robot') in names or ('wheel', 'base', 'robot') in names
    chain = next(each for each in chains if 'arm.yaml' in ' '.join(each))
    assert chain[0].startswith(f'{line_of("joint passes")}:')
