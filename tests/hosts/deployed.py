"""A project on the laptop of a bed, and two hosts that it is deployed to."""

import fcntl
import platform
import subprocess
import sys
from contextlib import contextmanager, suppress
from textwrap import dedent

import pytest

from composer.hosts.requirements import (
    PlatformSpec,
    composer_requirements,
    pin,
    provide_wheels,
)
from tests.host_bed import Bed
from tests.running import ROOT, wait_for

FOLDER = '/home/robot/.local/share/composer'
ROOT_THERE = f'{FOLDER}/systems/robot'
UNITS = '/home/robot/.config/systemd/user'
HOSTS = ('front', 'rear')
_SYSTEM = """
    version: 1
    network: {discovery: multicast, domain_id: 20}
    nodes:
      talker:
        host: front
        on_start: behaviours.talk:begin
        publishers:
          chatter: {type: std_msgs/msg/String, topic: /chatter}
        timers:
          tick: {period: 0.1, behaviour: behaviours.talk:tick, publish: chatter}
      listener:
        host: rear
        on_start: behaviours.listen:begin
        subscriptions:
          chatter: {type: std_msgs/msg/String, topic: /chatter, behaviour: behaviours.listen:hear}
    """
_TALK = """
    def begin(node):
        node.logger.info('talks')


    def tick(node):
        return {'data': 'hello'}
    """
_LISTEN = """
    from pathlib import Path

    from behaviours import counting


    def begin(node):
        counting.wait()


    def hear(node, message):
        Path.home().joinpath('heard').write_text(message.data)
    """
_FILES = {
    'pyproject.toml': '[project]\nname = "duo"\n',
    'robot.yaml': _SYSTEM,
    'hosts.yaml': 'hosts: {front: {address: front}, rear: {address: rear}}\n',
    'behaviours/talk.py': _TALK,
    'behaviours/listen.py': _LISTEN,
    'behaviours/counting.py': 'def wait():\n    pass\n',
}


class DeployBed(Bed):
    """Hosts without anything of Composer, and a laptop that has the wheels: none has internet.

    The packages on the hosts are installed by pip once in a run of the tests. Other hosts, which
    have the same paths, are given a copy.
    """

    def __init__(self, folder, cache):
        super().__init__(folder, HOSTS)
        self.cache = cache / 'deploy'
        self.cache.mkdir(exist_ok=True)
        self._packages = self.cache / 'packages.tar'

    def __enter__(self):
        target = PlatformSpec(sys.version_info[:2], platform.machine(), '')
        pins = pin(composer_requirements(has_ros=False, builds_interfaces=False), target)
        with pytest.MonkeyPatch.context() as patch, self._locked():
            patch.setenv('XDG_CACHE_HOME', str(self.cache))
            provide_wheels(pins, target)
        return super().__enter__()

    @contextmanager
    def _locked(self):
        with (self.cache / 'lock').open('w') as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def give_packages(self):
        """Copy the packages that have been installed in this run."""
        if not self._packages.exists():
            return
        for host in self.hosts.values():
            host.run('mkdir', '-p', FOLDER)
            words = ['tar', 'xf', str(self._packages), '-C', f'{host.files}{FOLDER}']
            subprocess.run(words, check=True)

    def keep_packages(self):
        """Keep a copy of the packages of a host."""
        with self._locked():
            if not self._packages.exists():
                part = self._packages.with_suffix('.part')
                folder = f'{self.hosts["front"].files}{FOLDER}'
                subprocess.run(['tar', 'cf', str(part), '-C', folder, 'venvs'], check=True)
                part.rename(self._packages)


class Project:
    """A project on the laptop, and what it is deployed to."""

    def __init__(self, bed, folder):
        self.bed, self.folder = bed, folder
        self.front, self.rear = bed['front'], bed['rear']
        folder.mkdir()
        self.restore()

    def restore(self):
        """Let it be as it was at first."""
        for name, text in _FILES.items():
            self.write(name, text)

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(dedent(text).lstrip('\n'))

    def ensure(self):
        """Deploy it, unless that has been done and nothing was changed since."""
        if not all(map(self._has_all, HOSTS)):
            self.bed.give_packages()
            if self.run('deploy').returncode:
                # What a test has left there that failed.
                self.run('deploy', '--remove')
                self.deploy()
            self.bed.keep_packages()

    def _has_all(self, name):
        state, _ = self.state(name)
        live = self.bed[name].files / f'{ROOT_THERE[1:]}/live/files'
        with suppress(FileNotFoundError):
            same = [
                (live / each).read_text() == (self.folder / each).read_text() for each in _FILES
            ]
            return all(same) and state[:2] + state[3:] == ('active', 'enabled', False)
        return False

    def edit(self, name, old, new):
        text = (self.folder / name).read_text()
        assert old in text
        (self.folder / name).write_text(text.replace(old, new))

    def words(self, *words, system='robot.yaml'):
        return [sys.executable, '-m', 'composer', *words[:1], system, 'hosts.yaml', *words[1:]]

    @property
    def options(self):
        cache = {'XDG_CACHE_HOME': str(self.bed.cache), 'PYTHONPATH': str(ROOT)}
        return {'cwd': self.folder, 'env': self.bed.environment(**cache)}

    def run(self, *words, system='robot.yaml'):
        return self.bed.run(*self.words(*words, system=system), **self.options)

    def deploy(self, *words, system='robot.yaml', code=0):
        done = self.run('deploy', *words, system=system)
        assert done.returncode == code, done.stdout + done.stderr
        return done

    def begin(self, *words):
        """Start a deployment; it goes on in a process of its own."""
        command = self.bed.command(*self.words('deploy', *words))
        pipe = subprocess.PIPE
        return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, **self.options)

    def states(self, system='robot'):
        """Return what systemd says of the units, and which process and release they run."""
        return [self.state(name, system) for name in HOSTS]

    def state(self, name, system='robot'):
        unit = f'composer-{system}@{name}.service'
        names = 'ActiveState,UnitFileState,MainPID'
        shown = self.bed[name].run('systemctl', '--user', 'show', '-p', names, unit).stdout
        found = dict(line.split('=') for line in shown.split())
        root = f'{FOLDER}/systems/{system}'
        release = self.bed[name].run('cat', f'{root}/current').stdout.strip()
        pending = not self.bed[name].run('test', '-e', f'{root}/pending').returncode
        return (found['ActiveState'], found['UnitFileState'], release, pending), found['MainPID']

    def pids(self):
        return [pid for _, pid in self.states()]

    def releases(self):
        """Return the release that each host runs."""
        return [release for (_, _, release, _), _ in self.states()]

    def runs(self, releases):
        """Return whether each host runs a release, and will after a boot."""
        return [state for state, _ in self.states()] == [
            ('active', 'enabled', each, False) for each in releases
        ]

    def hears(self, text):
        self.rear.run('rm', '-f', 'heard')
        wait_for(lambda: self.rear.run('cat', 'heard').stdout == text, f'{text!r} to be heard')
