"""Hosts on one network, as Linux namespaces: what stands in for a robot's computers.

Each host has its own interfaces, shared memory and host name, and the files of this computer. They
are plugged into a bridge, which has a namespace of its own, so nothing of them is seen outside, and
nothing is left when the process that made them ends.
"""

import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path

import pytest

_SUBNET = '10.77.0'
_NAMESPACES = ('--mount', '--net', '--uts')
# It tells that the namespaces are there, and is killed with the process that made them.
_HOLDER = ('setpriv', '--pdeathsig', 'KILL', 'unshare', *_NAMESPACES, '--propagation', 'private')
_SETUP = """
set -e
hostname "$1"
mount -t tmpfs tmpfs /dev/shm
ip link set lo up
echo there
exec sleep infinity
"""


@cache
def _may_create():
    command = [*_HOLDER, 'ip', 'link', 'add', 'name', 'br0', 'type', 'bridge']
    try:
        done = subprocess.run(command, capture_output=True, check=False)
    except OSError:
        return False
    # Of the latter a bad cable is made.
    return done.returncode == 0 and Path('/dev/net/tun').exists()


needs_namespaces = pytest.mark.skipif(
    not _may_create(), reason='needs the right to create network namespaces'
)


class _Namespaces:
    """Namespaces that exist while a process of theirs sleeps.

    Args:
        name: Their host name.
    """

    def __init__(self, name):
        self._holder = subprocess.Popen(
            [*_HOLDER, 'sh', '-c', _SETUP, 'sh', name], stdout=subprocess.PIPE, text=True
        )
        if self._holder.stdout.readline() != 'there\n':
            pytest.fail(f'the namespaces of {name} could not be created')
        self._started = []

    @property
    def pid(self):
        return self._holder.pid

    def within(self, *command):
        """Return a command that runs another in these namespaces, in the same process."""
        return ['nsenter', f'--target={self.pid}', *_NAMESPACES, '--wd=.', *map(str, command)]

    def start(self, *command, **options):
        """Start a command; options are those of `subprocess.Popen`."""
        process = subprocess.Popen(self.within(*command), **options)
        self._started.append(process)
        return process

    def run(self, *command, check=True, **options):
        """Run a command to its end; options are those of `subprocess.run`."""
        options = {'capture_output': True, 'text': True} | options
        return subprocess.run(self.within(*command), check=check, **options)

    def pids(self, program=''):
        """Return the processes in these namespaces, or those whose command contains a text."""
        own = Path(f'/proc/{self.pid}/ns/net').readlink()
        found = []
        for folder in Path('/proc').glob('[0-9]*'):
            with suppress(OSError):
                is_here = (folder / 'ns/net').readlink() == own
                if is_here and program in (folder / 'cmdline').read_text():
                    found.append(int(folder.name))
        return [pid for pid in found if pid != self.pid]

    def kill(self, program=''):
        """Kill all processes in these namespaces, as a loss of power does, or some of them."""
        while pids := self.pids(program):
            for pid in pids:
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            if program:
                return
        for process in self._started:
            process.wait()

    def close(self):
        self.kill()
        self._holder.kill()
        self._holder.wait()
        self._holder.stdout.close()


class Host(_Namespaces):
    """A computer on the network.

    Attributes:
        address: Its IPv4 address.
    """

    def __init__(self, name, address, switch):
        super().__init__(name)
        self.name = name
        self.address = address
        self._switch = switch

    def take_down(self):
        """Take its interface down, as a pulled cable does."""
        self.run('ip', 'link', 'set', 'dev', 'eth0', 'down')

    def bring_up(self):
        """Plug the cable in again."""
        self.run('ip', 'link', 'set', 'dev', 'eth0', 'up')

    def cut(self):
        """Lose all that it sends and is sent, which nothing on it is told."""
        self._switch.run('ip', 'link', 'set', 'dev', self.name, 'nomaster')

    def mend(self):
        """Undo `cut`."""
        self._switch.run('ip', 'link', 'set', 'dev', self.name, 'master', 'br0')
        self._switch.connect(self.name)

    def traffic(self):
        """Return how many bytes it has sent and received so far."""
        (link,) = json.loads(self.run('ip', '-json', '-statistics', 'link', 'show', 'eth0').stdout)
        return tuple(link['stats64'][way]['bytes'] for way in ('tx', 'rx'))


class _Switch(_Namespaces):
    """The bridge that connects the hosts.

    Args:
        forwards_multicast: Whether it does, as many wireless and company networks do not.
    """

    def __init__(self, *, forwards_multicast):
        super().__init__('switch')
        self._forwards_multicast = forwards_multicast
        self.run('ip', 'link', 'add', 'br0', 'type', 'bridge', 'mcast_snooping', '0')
        self.run('ip', 'link', 'set', 'br0', 'up')

    def connect(self, port):
        self.run('ip', 'link', 'set', 'dev', port, 'master', 'br0', 'up')
        flood = 'on' if self._forwards_multicast else 'off'
        self.run('bridge', 'link', 'set', 'dev', port, 'mcast_flood', flood)


class Network:
    """A network of hosts; use it in a `with`.

    Args:
        forwards_multicast: Whether multicast crosses between its hosts.
    """

    def __init__(self, *, forwards_multicast=True):
        self._ended = ExitStack()
        self._switch = self._opened(_Switch(forwards_multicast=forwards_multicast))
        self.hosts = {}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._ended.close()

    def add_host(self, name, *, loss_percent=0.0, delay_sec=0.0):
        """Return a new host.

        Args:
            name: Of at most 15 characters, as it is the name of an interface, too.
            loss_percent: How many of the frames are lost, in each direction.
            delay_sec: How much later each frame arrives, in each direction.
        """
        host = Host(name, f'{_SUBNET}.{len(self.hosts) + 1}', self._switch)
        self.hosts[name] = self._opened(host)
        if loss_percent or delay_sec:
            self._connect_badly(host, loss_percent, delay_sec)
        else:
            ends = ('name', 'eth0', 'netns', host.pid, 'type', 'veth', 'peer', 'name', name)
            self._switch.run('ip', 'link', 'add', *ends)
        host.run('ip', 'address', 'add', f'{host.address}/24', 'dev', 'eth0')
        host.run('ip', 'link', 'set', 'dev', 'eth0', 'up')
        self._switch.connect(name)
        return host

    def _connect_badly(self, host, loss_percent, delay_sec):
        numbers = (host.pid, 'eth0', self._switch.pid, host.name, loss_percent, delay_sec)
        program = [sys.executable, '-m', 'tests.bad_cable', *map(str, numbers)]
        cable = subprocess.Popen(program, stdout=subprocess.PIPE, text=True)
        self._ended.callback(_end, cable)
        if cable.stdout.readline() != 'there\n':
            pytest.fail(f'there is no cable to {host.name}')

    def _opened(self, namespaces):
        self._ended.callback(namespaces.close)
        return namespaces


def _end(process):
    process.kill()
    process.wait()
    process.stdout.close()
