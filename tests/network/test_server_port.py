"""A part does not start without the port that its discovery server needs."""

import socket

import pytest

from composer.cli.main import run
from composer.network import local_networks

SYSTEM = """\
version: 1
network: {{discovery: discovery_server, server: base, port: {port}}}
hosts: {{base: {{address: 10.0.0.1}}, arm: {{address: 10.0.0.2}}}}
nodes: {{there: {{host: arm}}, here: {{host: base, on_start: 'module:ends'}}}}
"""
# The system ends as soon as it has started.
MODULE = 'def ends(node):\n    node.shutdown()\n'


@pytest.mark.ros
@pytest.mark.parametrize('is_taken', [True, False])
def test_a_part_starts_only_if_the_port_of_its_server_is_free(
    tmp_path, monkeypatch, capfd, is_taken
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('XDG_STATE_HOME', str(tmp_path))
    monkeypatch.setattr(local_networks, '_PORT_SEC', 0.5)
    (tmp_path / 'module.py').write_text(MODULE)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(('127.0.0.1', 0))
        port = taken.getsockname()[1]
        (tmp_path / 'robot.yaml').write_text(SYSTEM.format(port=port))
        if not is_taken:
            taken.close()
        code = run(['up', 'robot.yaml', '--host', 'base'])
    told = capfd.readouterr().err
    problem = f'the discovery server cannot run: UDP port {port} of this host is in use'
    assert (code, problem in told) == (int(is_taken), is_taken)
