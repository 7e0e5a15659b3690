"""A part does not start without the port that its discovery server needs."""

import socket

import pytest

from composer.cli.main import run
from composer.network import local_networks

SYSTEM = """\
version: 1
network: {{discovery: discovery_server, server: base, port: {port}}}
hosts: {{base: {{address: 10.0.0.1}}, arm: {{address: 10.0.0.2}}}}
nodes: {{there: {{host: arm}}, here: {{host: base}}}}
"""
PROBLEM = 'the discovery server cannot run: UDP port {} of this host is in use'


@pytest.fixture
def port(tmp_path, monkeypatch):
    """Return a port that is free; the part's file is in the working directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('XDG_STATE_HOME', str(tmp_path))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(('127.0.0.1', 0))
        port = probe.getsockname()[1]
    (tmp_path / 'robot.yaml').write_text(SYSTEM.format(port=port))
    return port


@pytest.mark.ros
def test_a_part_does_not_start_while_the_port_of_its_server_is_taken(port, monkeypatch, capsys):
    monkeypatch.setattr(local_networks, '_PORT_SEC', 0.5)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(('127.0.0.1', port))
        assert run(['up', 'robot.yaml', '--host', 'base']) == 1
    assert PROBLEM.format(port) in capsys.readouterr().err
