"""Systems on several hosts: each a set of network namespaces, with `composer up --host`."""

import json
import os
import signal
import subprocess
import sys
from textwrap import dedent

import pytest
import yaml

from tests.network_namespaces import Network
from tests.running import ROOT, wait_for

# Nobody outside is on these networks.
_DOMAIN = 140


class Part:
    """The part of a system on a host, and what it prints."""

    def __init__(self, host, arguments, folder, environment):
        self.host = host
        self._output = folder / f'{host.name}.txt'
        # The home folder, where logs and caches are, is that of the host alone.
        home = folder / f'home_{host.name}'
        home.mkdir(exist_ok=True)
        passed = {
            name: each
            for name, each in os.environ.items()
            if not name.startswith(('ROS_', 'FASTDDS_'))
        }
        variables = {
            'HOME': str(home),
            'ROS_DOMAIN_ID': str(_DOMAIN),
            'RCUTILS_CONSOLE_OUTPUT_FORMAT': '[{severity}] [{name}]: {message}',
            'RCUTILS_COLORIZED_OUTPUT': '0',
            'PYTHONPATH': os.pathsep.join([str(ROOT), str(folder)]),
        }
        with self._output.open('w') as output:
            self._process = host.start(
                *(sys.executable, '-m', 'composer', 'up', *arguments, '--host', host.name),
                cwd=folder,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=passed | variables | environment,
            )

    @property
    def output(self):
        return self._output.read_text()

    def count(self, text):
        return self.output.count(text)

    def wait_for(self, text, *, times=1):
        def arrived():
            if self._process.poll() is not None and self.count(text) < times:
                pytest.fail(f'{self.host.name} has ended without {text!r}:\n{self.output}')
            return self.count(text) >= times

        try:
            wait_for(arrived, f'{times} x {text!r}')
        except pytest.fail.Exception:
            pytest.fail(f'{times} x {text!r} did not come of {self.host.name}:\n{self.output}')

    def stop(self):
        self._process.send_signal(signal.SIGINT)
        return self._process.wait(30)


class Hosts:
    """Hosts of one network, and the parts of a system on them."""

    def __init__(self, folder, network, names):
        self.folder = folder
        self._hosts = {name: network.add_host(name) for name in names}

    def __getitem__(self, name):
        return self._hosts[name]

    def write(self, system, code='', **network):
        """Write a system with these hosts as its inventory, and its behaviours `parts`."""
        (self.folder / 'parts.py').write_text(dedent(code))
        (self.folder / 'robot.yaml').write_text(dedent(system))
        inventory = {
            'version': 1,
            'network': network,
            'hosts': {name: {'address': host.address} for name, host in self._hosts.items()},
        }
        (self.folder / 'hosts.yaml').write_text(yaml.safe_dump(inventory))

    def up(self, name, *arguments, **environment):
        """Start the part of a host."""
        files = ('robot.yaml', 'hosts.yaml')
        return Part(self._hosts[name], [*files, *arguments], self.folder, environment)

    def ask(self, name, code, *arguments, **environment):
        """Return what a Python program on a host prints as JSON."""
        variables = {**os.environ, 'ROS_DOMAIN_ID': str(_DOMAIN), **environment}
        program = [sys.executable, '-c', dedent(code), *arguments]
        return json.loads(self._hosts[name].run(*program, env=variables).stdout)


@pytest.fixture
def create_hosts(tmp_path):
    """Return a function that creates hosts on a network of their own."""
    networks = []

    def create(*names, forwards_multicast=False):
        networks.append(Network(forwards_multicast=forwards_multicast).__enter__())
        return Hosts(tmp_path, networks[-1], names)

    yield create
    for network in networks:
        network.__exit__()
