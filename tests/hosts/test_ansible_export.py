"""`composer export ansible` writes a folder that is read, kept and run by Ansible itself."""

import subprocess
import sys

import pytest
import yaml

from composer.cli import main as cli
from composer.cli.hosts.deploy import find_addresses
from composer.errors import ExitCode
from composer.hosts.bundle import PLAYBOOKS
from composer.language.pipeline import load_system

SYSTEM = """\
version: 1
network: {discovery: peers, domain_id: 20}
hosts:
  front: {address: 10.0.0.1, user: robot, port: 2222}
  rear: {address: 10.0.0.2, folder: /srv/composer, systemd: system, user: root, python: python3.12}
  spare: {}
nodes:
  talker: {host: front, on_start: 'parts.talk:begin', state: {word: '{{ env("WORD", "hi") }}'}}
  listener: {host: rear, on_start: 'ears:begin'}
"""
FILES = {
    'robot.yaml': SYSTEM,
    'pyproject.toml': '[project]\nname = "duo"\n',
    'parts/talk.py': 'def begin(node):\n    pass\n',
    'parts/map.csv': '1\n',
    'ears.py': 'def begin(node):\n    pass\n',
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    # Wheels are fetched for the hosts of the bed.
    monkeypatch.setattr('composer.hosts.bundle.provide_wheels', lambda *_: {})
    monkeypatch.chdir(tmp_path)
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return tmp_path


def list_files(folder):
    return sorted(str(each.relative_to(folder)) for each in folder.rglob('*') if each.is_file())


def test_each_host_has_its_part(folder, capsys):
    assert cli.run(['export', 'ansible', 'robot.yaml']) == ExitCode.USAGE
    capsys.readouterr()
    assert cli.run(['export', 'ansible', 'robot.yaml', '-o', 'out']) == 0
    hosts = folder / 'out/hosts'
    own = ['change', 'composer', 'files/pyproject.toml', 'files/robot.yaml', 'part', 'unit']
    assert list_files(hosts / 'spare') == ['change']
    assert list_files(hosts / 'rear') == sorted([*own, 'files/ears.py', 'wheels.txt'])
    parts = ['files/parts/map.csv', 'files/parts/talk.py']
    assert list_files(hosts / 'front') == sorted([*own, *parts, 'wheels.txt'])
    inventory = yaml.safe_load((folder / 'out/inventory.yaml').read_text())['composer']['hosts']
    assert inventory['front'] == {
        'ansible_host': '10.0.0.1',
        'ansible_user': 'robot',
        'ansible_port': 2222,
        'ansible_python_interpreter': 'python3',
        'composer_root': '~/.local/share/composer/systems/robot',
    }
    assert inventory['rear']['composer_root'] == '/srv/composer/systems/robot'
    units = {name: (hosts / name / 'unit').read_text() for name in ('front', 'rear')}
    run = 'ExecStart=:/bin/sh %h/.local/share/composer/systems/robot/change start\n'
    assert run in units['front']
    assert 'ExecStart=:/bin/sh /srv/composer/systems/robot/change start\n' in units['rear']
    assert 'EnvironmentFile=-%E/composer/robot.env\n' in units['front']
    for name in ('front', 'rear', 'spare'):
        for script in {'change', 'part', 'composer'} & {
            each.name for each in (hosts / name).iterdir()
        }:
            subprocess.run(['sh', '-n', str(hosts / name / script)], check=True)


def test_ansible_reads_it_and_edits_are_kept(folder, capsys):
    pytest.importorskip('ansible')
    assert cli.run(['export', 'ansible', 'robot.yaml', '-o', 'out']) == 0
    words = [sys.executable, '-m', 'ansible', 'playbook', '--syntax-check', *PLAYBOOKS]
    subprocess.run(words, cwd=folder / 'out', check=True, capture_output=True)
    # No rescue follows an unreachable host otherwise.
    (play,) = yaml.safe_load((folder / 'out/deploy.yaml').read_text())
    assert play['any_errors_fatal']
    assert 'run_once' not in (folder / 'out/deploy.yaml').read_text().partition('- name')[2]
    assert cli.run(['export', 'ansible', 'robot.yaml', '-o', 'out']) == 0
    with (folder / 'out/deploy.yaml').open('a') as stream:
        stream.write('# mine\n')
    capsys.readouterr()
    assert cli.run(['export', 'ansible', 'robot.yaml', '-o', 'out']) == 1
    assert 'deploy.yaml was edited since it was exported' in capsys.readouterr().err
    # A folder of others is not emptied.
    (folder / 'hosts').mkdir()
    assert cli.run(['export', 'ansible', 'robot.yaml', '-o', '.']) == 1
    assert "hosts is there, and was not written by 'composer export'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ('network', 'addresses'),
    [
        ('multicast', {}),
        ('peers', {'front': '10.0.0.2'}),
        ('{discovery: discovery_server, server: front}', {'front': '10.0.0.2'}),
        ('{discovery: discovery_server, server: near}', {}),
    ],
)
def test_hosts_find_each_other_by_what_ssh_has_for_their_names(
    tmp_path, monkeypatch, capsys, network, addresses
):
    config = tmp_path / 'config'
    config.write_text('Host f\n  HostName 10.0.0.2\nHost n\n  HostName localhost\n')
    # The program ssh asks the system for the home, not the environment.
    (tmp_path / 'ssh').write_text(f'#!/bin/sh\nPATH=${{PATH#*:}} exec ssh -F {config} "$@"\n')
    (tmp_path / 'ssh').chmod(0o755)
    monkeypatch.setenv('PATH', str(tmp_path), prepend=':')
    path = tmp_path / 'robot.yaml'
    path.write_text(
        'version: 1\n'
        f'network: {network}\n'
        'hosts: {front: {address: f}, near: {address: n}, unused: {address: f, user: x}}\n'
        'nodes: {a: {host: front}, b: {host: near}}\n'
    )
    assert find_addresses(load_system(path).spec) == addresses
    told = capsys.readouterr()[1]
    told_of_near = "warning: host near: 'n' is localhost for ssh here (HostName): all hosts must"
    assert (told_of_near in told) == (network != 'multicast' and 'server: front' not in network)
