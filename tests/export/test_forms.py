"""Each form of a system passes the check of the program that reads it."""

import json
import os
import re
import shlex
from importlib import resources
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft7Validator

import composer
from composer.cli import main as cli
from composer.export.systemd import unit_name

ROOT = Path(composer.__file__).parents[1]
# With arguments; of components; of includes, with programs; of programs with files of their own.
SYSTEMS = {'add_two_ints_client': ['1', '2'], 'cell': [], 'sensors': [], 'patrol': []}
FLEET = """
version: 1
description: 100 % a "fleet" of ${HOME} \\
defaults: {host: base}
workers:
  vision: {host: jetson, nice: -5}
nodes:
  driver:
    publishers: {image: {type: std_msgs/msg/String, external: true}}
  detector:
    worker: vision
    publishers: {found: {type: std_msgs/msg/String, external: true}}
processes:
  recorder: {command: [sleep, '1'], host: jetson, stop: {timeout: 30}}
"""


@pytest.fixture
def export(capsys, monkeypatch):
    """Return what exports a system and returns what was printed; from a folder if one is given."""

    def export(form, *words, folder=ROOT, fails=False):
        monkeypatch.chdir(folder)
        image = ['--image', 'robot:1'] if form == 'kubernetes' else []
        code = cli.run(['export', form, *image, *map(str, words)])
        captured = capsys.readouterr()
        assert (code != 0) == fails, captured.err
        return captured.err if fails else captured.out

    return export


@pytest.fixture
def project(tmp_path):
    """Return what makes a project with a system in it, and returns the file."""

    def make(text, name='robot'):
        (tmp_path / 'pyproject.toml').touch()
        file = tmp_path / 'configs' / f'{name}.yaml'
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
        return file

    return make


def check_compose(text):
    pytest.importorskip('check_jsonschema')
    vendored = resources.files('check_jsonschema') / 'builtin_schemas/vendor/compose-spec.json'
    data = yaml.safe_load(text)
    Draft7Validator(json.loads(vendored.read_text())).validate(data)
    return data


def check_kubernetes(text):
    kubernetes_validate = pytest.importorskip('kubernetes_validate')
    documents = [*yaml.safe_load_all(text)]
    for each in documents:
        kubernetes_validate.validate(each, '1.30', strict=True)
    return documents


def units_of(text):
    """Return the printed units by their names."""
    _, *parts = re.split(r'^# (composer-\S+\.service)\n', text, flags=re.MULTILINE)
    return dict(zip(parts[::2], parts[1::2], strict=True))


def value_of(unit, key):
    return [line.partition('=')[2] for line in unit.splitlines() if line.startswith(f'{key}=')]


@pytest.mark.parametrize('name', SYSTEMS)
def test_a_shipped_system_is_a_unit_a_compose_file_and_a_manifest(
    export, verify_unit, tmp_path, name
):
    config, words = f'configs/{name}.yaml', SYSTEMS[name]
    text = export('systemd', config, *words)
    assert verify_unit(f'composer-{name}.service', text, 'user') == (0, '')

    data = check_compose(export('compose', config, *words))
    (service,) = data['services'].values()
    assert service['command'] == ['composer', 'up', f'/project/{config}', *words]

    files, workload = check_kubernetes(export('kubernetes', config, *words))
    pod = workload['spec']['template']['spec']
    assert pod['containers'][0]['args'][2:] == [f'/project/{config}', *words]
    items = pod['volumes'][0]['configMap']['items']
    assert {each['key'] for each in items} == {*files['data'], *files.get('binaryData', ())}
    # What the pod will see is a system without errors.
    for each in items:
        path = tmp_path / each['path']
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(files['data'][each['key']])
    export('systemd', config, *words, folder=tmp_path)


def test_each_host_has_its_part(export, project, verify_unit):
    file = project(FLEET)
    units = units_of(export('systemd', file, '--system'))
    assert sorted(units) == ['composer-robot@base.service', 'composer-robot@jetson.service']
    for host in ('base', 'jetson'):
        unit = units[f'composer-robot@{host}.service']
        assert shlex.split(value_of(unit, 'ExecStart')[0])[-2:] == ['--host', host]
        assert verify_unit(f'composer-robot@{host}.service', unit, 'system') == (0, '')
    assert value_of(units['composer-robot@jetson.service'], 'LimitNICE') == ['-5']
    assert value_of(units['composer-robot@jetson.service'], 'TimeoutStopSec') == ['55']
    assert value_of(units['composer-robot@base.service'], 'TimeoutStopSec') == ['25']

    services = check_compose(export('compose', file))['services']
    assert {name: each['profiles'] for name, each in services.items()} == {
        'base': ['base'],
        'jetson': ['jetson'],
    }
    assert services['jetson']['stop_grace_period'] == '55s'
    assert services['jetson']['cap_add'] == ['SYS_NICE']
    assert services['jetson']['healthcheck']['test'][-1] == 'robot@jetson'

    _files, *workloads = check_kubernetes(export('kubernetes', file))
    assert [each['metadata']['name'] for each in workloads] == ['robot-base', 'robot-jetson']
    pods = [each['spec']['template']['spec'] for each in workloads]
    assert [each['nodeSelector']['composer/host'] for each in pods] == ['base', 'jetson']
    assert [each['terminationGracePeriodSeconds'] for each in pods] == [25, 55]
    assert pods[1]['containers'][0]['args'][-2:] == ['--host', 'jetson']


def test_two_systems_never_have_one_name(export, project):
    names = ['a-b', 'a@b', 'a:b', 'A-b', '日本', '中国', 'system', 'x' * 60, 'x' * 61]
    taken, projects = set(), set()
    for name in names:
        file = project(FLEET, name)
        for each in check_kubernetes(export('kubernetes', file)):
            taken.add((each['kind'], each['metadata']['name']))
        projects.add(check_compose(export('compose', file))['name'])
    assert len(taken) == len(names) * 3
    assert len(projects) == len(names)
    assert ('ConfigMap', 'a-b') in taken
    assert 'a-b' in projects


def test_hosts_of_almost_one_name_are_apart(export, project):
    file = project(FLEET.replace('host: jetson', 'host: Base'), 'my_Robot')
    _files, *workloads = check_kubernetes(export('kubernetes', file))
    names = [workload['metadata']['name'] for workload in workloads]
    assert len({*names}) == 2
    assert all(name.startswith('my-robot-base-') for name in names)


def test_a_part_that_nobody_runs_is_an_error(export, project):
    text = FLEET.replace('defaults: {host: base}\n', '')
    told = export('systemd', project(text), fails=True)
    assert "error[no-host]: the node 'driver' has no host to run on" in told
    assert 'detector' not in told


ODD = ['a b', '100%', '%h', '$HOME', '${HOME}', '$$', '$(HOME)', '"q"', "'q'", 'back\\', 'ü机']
ODD += ['yes', '1e3', '0x1', '1:30', 'null', '#x', 'a: b', '- a', '{x}', '']
ODD_SYSTEM = f"""
version: 1
args: {{{', '.join(f'a{count}: {{type: string}}' for count in range(len(ODD)))}}}
nodes:
  one: {{}}
"""


@pytest.mark.parametrize('name', ['a "b" $HOME', '-100%', 'ünï@机'])
def test_awkward_names_and_values_arrive_as_they_were(export, project, verify_unit, name):
    file = project(ODD_SYSTEM, name)
    folder = file.parent / 'a $x %h "q" ü'
    folder.mkdir()
    given = [f'a{count}:={each}' for count, each in enumerate(ODD)]
    given += ['--set=nodes.one.description=$x %h "']
    wanted = ['composer', 'up', f'/project/configs/{name}.yaml', *given]
    # The programs replace names of variables, of which there are none.
    (service,) = check_compose(export('compose', file, *given, folder=folder))['services'].values()
    assert [each.replace('$$', '$') for each in service['command']] == wanted
    assert service['working_dir'] == '/project/configs/a $$x %h "q" ü'
    _files, workload = check_kubernetes(export('kubernetes', file, *given, folder=folder))
    (container,) = workload['spec']['template']['spec']['containers']
    assert [each.replace('$$', '$') for each in container['args']] == wanted
    unit = unit_name(name)
    assert verify_unit(unit, export('systemd', file, *given, folder=folder), 'user') == (0, '')


def test_a_config_map_has_what_behaviours_import_and_processes_run(export, project):
    file = project("""
version: 1
nodes:
  one: {on_start: robot_code.first:start}
processes:
  two: {command: [python3, tool.py]}
""")
    folder = file.parents[1] / 'robot_code'
    folder.mkdir()
    (folder / 'first.py').write_text(
        'from robot_code import second, third\ndef start(node): second.run()\n'
    )
    (folder / 'second.py').write_text('import numpy\ndef run(): pass\n')
    # Nothing of it is used, and Python imports it nevertheless.
    (folder / 'third.py').touch()
    (folder / 'fourth.py').touch()
    tool = folder.parent / 'tool.py'
    tool.touch(mode=0o755)
    files, workload = check_kubernetes(export('kubernetes', file, folder=folder.parent))
    assert files['data'].keys() == {
        'configs_robot.yaml',
        'pyproject.toml',
        'robot_code_first.py',
        'robot_code_second.py',
        'robot_code_third.py',
        'tool.py',
    }
    items = workload['spec']['template']['spec']['volumes'][0]['configMap']['items']
    modes = {each['path']: each['mode'] for each in items}
    assert (modes['tool.py'], modes['robot_code/first.py']) == (0o555, 0o444)


@pytest.mark.parametrize(
    ('network', 'base', 'jetson', 'hosts_with_probes'),
    [
        ('multicast', {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}, {}, ['base', 'jetson']),
        (
            '{discovery: peers, domain_id: 31}',
            {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'ROS_DOMAIN_ID': '31'},
            {},
            ['base', 'jetson'],
        ),
        (
            '{discovery: discovery_server, server: base}',
            {'ROS_DISCOVERY_SERVER': '127.0.0.1:11811', 'ROS_SUPER_CLIENT': 'TRUE'},
            {'ROS_DISCOVERY_SERVER': 'b.example:11811'},
            ['base'],
        ),
    ],
)
def test_what_asks_a_part_is_on_its_graph(
    export, project, monkeypatch, network, base, jetson, hosts_with_probes
):
    for name in ('ROS_DOMAIN_ID', 'ROS_AUTOMATIC_DISCOVERY_RANGE'):
        monkeypatch.delenv(name, raising=False)
    # Of another system.
    monkeypatch.setenv('ROS_STATIC_PEERS', '10.1.1.1')
    inventory = f'hosts: {{base: {{address: b.example}}, jetson: {{}}}}\nnetwork: {network}\n'
    file = project(FLEET + inventory)
    wanted = {'base': base, 'jetson': base | jetson}
    for host, unit in units_of(export('systemd', file)).items():
        set_variables = dict(each.split('=', 1) for each in value_of(unit, 'Environment'))
        of_ros = {name: value for name, value in set_variables.items() if name[:4] == 'ROS_'}
        assert of_ros.pop('ROS_LOG_DIR', None) in (None, os.environ.get('ROS_LOG_DIR'))
        assert of_ros == wanted[host.partition('@')[2].removesuffix('.service')]
    _files, *workloads = check_kubernetes(export('kubernetes', file))
    containers = [each['spec']['template']['spec']['containers'][0] for each in workloads]
    assert [
        each['args'][-1] for each in containers if 'livenessProbe' in each
    ] == hosts_with_probes


def test_the_host_of_a_discovery_server_has_a_part(export, project):
    inventory = 'network: {discovery: discovery_server, server: tower}\n'
    units = units_of(export('systemd', project(FLEET + inventory)))
    assert 'composer-robot@tower.service' in units


def test_the_project_alone_is_mounted(export, project, tmp_path_factory):
    """A program elsewhere is yours to add: its folder and the project's are in many others."""
    program = tmp_path_factory.mktemp('elsewhere') / 'driver'
    program.write_text('#!/bin/sh\n')
    file = project(f'version: 1\nprocesses:\n  driver: {{command: [{program}]}}\n')
    (service,) = yaml.safe_load(export('compose', file))['services'].values()
    assert [each['source'] for each in service['volumes']] == [str(file.parents[1])]
