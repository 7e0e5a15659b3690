"""Hosts for tests: each with its own network, file system, systemd, sshd and user `robot`.

A bed is a bridge in a network of its own, with the laptop's address on it, and hosts beside it.
All of it is Linux namespaces on this machine, so root is needed, and the packages `openssh-server`,
`systemd` with `libpam-systemd`, `dbus`, `iproute2` and `nftables` of Debian. Networks of several beds, and of
the machine itself, do not see each other. What hosts write lies in memory and is gone with the bed:
they see the machine's files, without /root, /opt, /home, /tmp and the project. There is no internet.

    with Bed(folder, ['front', 'rear']) as bed:
        bed.run('composer', 'ps', 'robot.yaml')     # on the laptop: its ~/.ssh knows all hosts
        bed.ssh('front', 'hostname')                # the same by the program ssh
        front = bed['front']
        front.run('systemctl', '--user', 'status')  # there, as robot; user='root' as root
        front.cut()                                 # pulls the plug of its network; front.join()
        front.lose(5)                               # percent of the packets; front.lose(0)
        front.kill()                                # as a loss of power; front.boot() starts it

By hand, `python -m tests.host_bed 2` opens a shell on the laptop, with hosts h1 and h2. There,
`ssh h1`, `bed-cut h1`, `bed-join h1` and `bed-enter h1` do what they say.
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from contextlib import suppress
from pathlib import Path

import pytest

from tests.running import ROOT

LAPTOP_ADDRESS = '10.77.0.1'
USER_ID = 1777
_BOOT_SEC = 60.0
_PROGRAMS = (
    'ip',
    'nft',
    'unshare',
    'nsenter',
    'setpriv',
    '/usr/sbin/sshd',
    '/lib/systemd/systemd',
)
# What ends with who started it, whatever becomes of that.
_BOUND = ('setpriv', '--pdeathsig', 'KILL')

# Remove the folder $0 of groups. The kernel may still be at work with what was in them.
_LEAVE_GROUPS = """
for each in $(seq 200); do
  [ -d "$0" ] || exit 0
  find "$0" -depth -type d -delete 2>/dev/null && exit 0
  sleep 0.05
done
"""

# Run in the namespaces of a host, with its folder and name: $1 and $2.
_BOOT = """
set -e
root=$1/root
mount -t overlay overlay -o lowerdir=/,upperdir=$1/upper,workdir=$1/work $root
mount -t proc proc $root/proc
mount -t sysfs -o ro sysfs $root/sys
mount -t cgroup2 cgroup2 $root/sys/fs/cgroup
for each in run dev root opt $3; do mount -t tmpfs -o mode=755 tmpfs $root/$each; done
mount -t tmpfs -o mode=1777 tmpfs $root/tmp
mount --bind $1/home $root/home
for each in null zero full random urandom tty; do
  touch $root/dev/$each
  mount --bind /dev/$each $root/dev/$each
done
mkdir $root/dev/shm $root/dev/pts
mount -t tmpfs -o mode=1777 tmpfs $root/dev/shm
mount -t devpts -o newinstance,ptmxmode=0666 devpts $root/dev/pts
ln -s pts/ptmx $root/dev/ptmx
hostname $2
mkdir -p $root/old
cd $root
pivot_root . old
umount -l /old
exec env -i container=bed PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  /lib/systemd/systemd --unit=bed.target --log-target=console >/boot.log 2>&1 </dev/null
"""

_TARGET = """[Unit]
Requires=basic.target ssh.service dbus.service
Wants=systemd-logind.service systemd-user-sessions.service getty-pre.target
After=basic.target
AllowIsolate=yes
"""

_SHELL = """
bed-cut() { ip link set "bed-$1" down; }
bed-join() { ip link set "bed-$1" up; }
ssh() { command ssh -F "$BED/ssh_config" "$@"; }
bed-enter() { nsenter --all --target "$(cat "$BED/$1.pid")" su - robot; }
PS1='(laptop) \\w\\$ '
"""


def why_there_is_none():
    """Return why this machine cannot have a bed; empty if it can."""
    if os.geteuid():
        return 'hosts are namespaces, which only root can make'
    missing = [each for each in _PROGRAMS if shutil.which(each) is None]
    return f'hosts need {", ".join(missing)}' if missing else ''


class Bed:
    """A laptop and hosts on a network of their own, while it is entered."""

    def __init__(self, folder, names):
        self.folder = Path(folder)
        self.groups = self.folder / 'cgroups' / f'bed-{uuid.uuid4().hex}'
        self.home = self.folder / 'laptop'
        self.hosts = {
            name: Host(self, name, f'10.77.1.{number}') for number, name in enumerate(names, 1)
        }

    def __getitem__(self, name):
        return self.hosts[name]

    def __enter__(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self._laptop = subprocess.Popen(
            [*_BOUND, 'unshare', '--net', '--mount', '--propagation', 'private', 'sleep', 'inf'],
            stdin=subprocess.DEVNULL,
        )
        try:
            self._build()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for host in self.hosts.values():
            host.kill()
        with suppress(subprocess.CalledProcessError):
            self.enter('sh', '-c', _LEAVE_GROUPS, str(self.groups))
        self._laptop.kill()
        self._laptop.wait()

    def command(self, *words):
        """Return the command that runs `words` on the laptop's network."""
        return ['nsenter', '--net', '--target', str(self._laptop.pid), *words]

    def environment(self, **more):
        """Return the environment of the laptop's user: the home is another one."""
        kept = {key: value for key, value in os.environ.items() if key != 'SSH_AUTH_SOCK'}
        programs = f'{self.home}/bin:{kept["PATH"]}'
        return {**kept, 'HOME': str(self.home), 'PATH': programs, **more}

    def run(self, *words, **options):
        """Run a program on the laptop; the result has its output as text."""
        options = {'env': self.environment(), 'text': True, 'capture_output': True} | options
        return subprocess.run(self.command(*words), check=False, **options)

    def ssh(self, *words):
        """Run the program ssh on the laptop."""
        return self.run('ssh', '-F', str(self.folder / 'ssh_config'), *words)

    def enter(self, *words):
        """Run a program on the laptop's network, in the mounts of the bed."""
        target = str(self._laptop.pid)
        subprocess.run(
            ['nsenter', '--net', '--mount', '--target', target, *words],
            check=True,
            stdin=subprocess.DEVNULL,
        )

    def _build(self):
        own = Path('/proc/self/ns/net').readlink()
        _wait(lambda: Path(f'/proc/{self._laptop.pid}/ns/net').readlink() != own, 'a network')
        _wait(lambda: _name_of(self._laptop.pid) == 'sleep', 'mounts')
        self.enter('mkdir', '-p', str(self.folder / 'hosts'))
        self.enter('mount', '-t', 'tmpfs', 'tmpfs', str(self.folder / 'hosts'))
        self.enter('mkdir', '-p', str(self.groups.parent))
        self.enter('mount', '-t', 'cgroup2', 'none', str(self.groups.parent))
        self.enter('mkdir', str(self.groups))
        self.enter('ip', 'link', 'set', 'lo', 'up')
        self.enter('ip', 'link', 'add', 'bed', 'type', 'bridge')
        self.enter('ip', 'address', 'add', f'{LAPTOP_ADDRESS}/16', 'dev', 'bed')
        self.enter('ip', 'link', 'set', 'bed', 'up')
        ssh = self.home / '.ssh'
        ssh.mkdir(parents=True, mode=0o700)
        _make_key(ssh / 'id_ed25519')
        for host in self.hosts.values():
            host.prepare((ssh / 'id_ed25519.pub').read_text())
        lines = [f'Host {each.name}\n  HostName {each.address}' for each in self.hosts.values()]
        (ssh / 'config').write_text('\n'.join([*lines, 'Host *\n  User robot\n']))
        # The program ssh asks the system for the home, not the environment.
        (self.folder / 'ssh_config').write_text(
            f'Include {ssh}/config\nHost *\n  IdentityFile {ssh}/id_ed25519\n'
            f'  UserKnownHostsFile {ssh}/known_hosts\n  BatchMode yes\n'
        )
        program = self.home / 'bin/ssh'
        program.parent.mkdir()
        program.write_text(
            f'#!/bin/sh\nexec {shutil.which("ssh")} -F {self.folder}/ssh_config "$@"\n'
        )
        program.chmod(0o755)
        self.know_hosts()
        for host in self.hosts.values():
            host.boot(waits=False)
        for host in self.hosts.values():
            host.wait_until_up()

    def know_hosts(self):
        """Write the hosts' keys to the `known_hosts` of the laptop."""
        lines = [f'{each.name},{each.address} {each.public_key}' for each in self.hosts.values()]
        (self.home / '.ssh' / 'known_hosts').write_text('\n'.join([*lines, '']))


class Host:
    """A host of a bed; see there."""

    def __init__(self, bed, name, address):
        self.name, self.address = name, address
        self._bed = bed
        self._link = f'bed-{name}'
        self._folder = bed.folder / 'hosts' / name
        self._process = None
        self._init = 0

    @property
    def files(self):
        """Where its files are, as this machine sees them while it runs."""
        return Path(f'/proc/{self._init}/root')

    @property
    def public_key(self):
        return (self._bed.folder / f'{self.name}.key.pub').read_text().strip()

    def prepare(self, authorized):
        """Write its files, as an installation does.

        Args:
            authorized: The public key of who may log in, as robot and as root.
        """
        folder = self._folder
        plan = self._bed.folder / f'{self.name}.files'
        etc = plan / 'upper' / 'etc'
        for each in ('ssh', 'systemd/system'):
            (etc / each).mkdir(parents=True)
        _make_key(self._bed.folder / f'{self.name}.key')
        for ending in ('', '.pub'):
            key = self._bed.folder / f'{self.name}.key{ending}'
            shutil.copy(key, etc / 'ssh' / f'ssh_host_ed25519_key{ending}')
        (etc / 'ssh' / 'sshd_config').write_text(
            'HostKey /etc/ssh/ssh_host_ed25519_key\nUsePAM yes\nPermitRootLogin yes\n'
            'PasswordAuthentication no\nKbdInteractiveAuthentication no\n'
            'AuthorizedKeysFile /etc/ssh/authorized_keys/%u\nUseDNS no\n'
        )
        keys = etc / 'ssh' / 'authorized_keys'
        keys.mkdir()
        for user in ('robot', 'root'):
            (keys / user).write_text(authorized)
        (etc / 'systemd/system/bed.target').write_text(_TARGET)
        # What a machine does beside is not asked for.
        for unit in ('timers.target', 'systemd-resolved.service', 'networking.service'):
            (etc / 'systemd/system' / unit).symlink_to('/dev/null')
        (etc / 'machine-id').write_text('')
        (etc / 'hostname').write_text(f'{self.name}\n')
        self._add_user(etc)
        linger = plan / 'upper/var/lib/systemd/linger/robot'
        linger.parent.mkdir(parents=True)
        linger.touch()
        for each in ('work', 'root', 'home/robot'):
            (plan / each).mkdir(parents=True)
        os.chown(plan / 'home/robot', USER_ID, USER_ID)
        for each in (plan, plan / 'upper', etc):
            each.chmod(0o755)
        self._bed.enter('cp', '-a', str(plan), str(folder))
        shutil.rmtree(plan)

    def _add_user(self, etc):
        lines = {
            'passwd': f'robot:x:{USER_ID}:{USER_ID}::/home/robot:/bin/bash',
            'group': f'robot:x:{USER_ID}:',
            'shadow': 'robot:*:19000:0:99999:7:::',
        }
        for name, line in lines.items():
            shutil.copy2(f'/etc/{name}', etc / name)
            with (etc / name).open('a') as stream:
                stream.write(f'{line}\n')

    def boot(self, *, waits=True):
        """Start it; what its disks have stays."""
        ours = {each.split('/')[1] for each in (str(ROOT), sys.prefix)}
        hidden = ' '.join(ours - {'root', 'opt', 'home', 'tmp', 'usr'})
        group = self._bed.groups / self.name
        script = (
            f'mkdir -p {group}; echo $$ >{group}/cgroup.procs; '
            'exec setpriv --pdeathsig KILL unshare --net --cgroup --pid --fork --kill-child '
            '--mount --uts --ipc --propagation private sh -c "$0" sh "$@"'
        )
        target = str(self._bed._laptop.pid)
        self._process = subprocess.Popen(
            [
                *_BOUND,
                'nsenter',
                '--mount',
                '--target',
                target,
                'sh',
                '-c',
                script,
                _BOOT,
                str(self._folder),
                self.name,
                hidden,
            ],
            stdin=subprocess.DEVNULL,
            # `unshare` complains when its child is killed.
            stderr=subprocess.DEVNULL,
        )
        self._init = _wait(lambda: _child_of(self._process.pid), f'{self.name} to begin')
        (self._bed.folder / f'{self.name}.pid').write_text(str(self._init))
        self._plug_in()
        if waits:
            self.wait_until_up()

    def _plug_in(self):
        link, init = self._link, str(self._init)
        ends = ['name', 'eth0', 'netns', init]
        self._bed.enter('ip', 'link', 'add', link, 'type', 'veth', 'peer', *ends)
        self._bed.enter('ip', 'link', 'set', link, 'master', 'bed', 'up')
        inside = ['nsenter', '--net', '--target', init, 'ip']
        # A network card keeps its address when its host starts again.
        card = f'02:77:00:00:01:{int(self.address.rpartition(".")[2]):02x}'
        for words in (
            ['link', 'set', 'eth0', 'address', card],
            ['link', 'set', 'lo', 'up'],
            ['address', 'add', f'{self.address}/16', 'dev', 'eth0'],
            ['link', 'set', 'eth0', 'up'],
        ):
            subprocess.run([*inside, *words], check=True)

    def wait_until_up(self):
        """Wait until one can log in, and the user has a systemd."""
        script = f'test -S /run/user/{USER_ID}/bus && systemctl is-active -q ssh'
        _wait(lambda: self.run('sh', '-c', script, user='root').returncode == 0, f'{self.name}')

    def kill(self):
        """End it at once, as a loss of power does; its disks keep what they have."""
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.kill(self._init, signal.SIGKILL)
            # It ends when all processes there have.
            self._process.wait(_BOOT_SEC)
            self._process = None

    def run(self, *words, user='robot', stdin=''):
        """Run a program there; the result has its output as text."""
        identity = str(USER_ID if user == 'robot' else 0)
        home = '/home/robot' if user == 'robot' else '/root'
        runtime = f'/run/user/{identity}'
        return subprocess.run(
            [
                'nsenter',
                '--all',
                '--target',
                str(self._init),
                'setpriv',
                f'--reuid={identity}',
                f'--regid={identity}',
                '--clear-groups',
                'env',
                '-i',
                '-C',
                home,
                f'HOME={home}',
                f'USER={user}',
                'LANG=C.UTF-8',
                'PATH=/usr/bin:/bin:/usr/sbin',
                f'XDG_RUNTIME_DIR={runtime}',
                *words,
            ],
            check=False,
            capture_output=True,
            text=True,
            input=stdin,
        )

    def cut(self):
        """Pull the plug of its network."""
        self._bed.enter('ip', 'link', 'set', self._link, 'down')

    def join(self):
        """Put the plug in again."""
        self._bed.enter('ip', 'link', 'set', self._link, 'up')

    def lose(self, percent):
        """Lose as many of the packets to it and from it."""
        table = f'table bridge lose_{self.name}'
        rule = f'numgen random mod 100 < {percent} drop' if percent < 100 else 'drop'
        chains = [
            f'chain {hook}_{way} {{ type filter hook {hook} priority 0; {way} "{self._link}" {rule}; }}'
            for hook, way in (
                ('forward', 'iifname'),
                ('forward', 'oifname'),
                ('input', 'iifname'),
                ('output', 'oifname'),
            )
        ]
        self._bed.enter('nft', f'add {table}; delete {table};')
        if percent:
            self._bed.enter('nft', f'{table} {{ {"; ".join(chains)}; }}')


def _make_key(path):
    command = ['ssh-keygen', '-q', '-t', 'ed25519', '-N', '', '-f', str(path)]
    subprocess.run(command, check=True)


def _child_of(pid):
    """Return the first process of a PID namespace: the only child of who made it."""
    with suppress(OSError):
        for each in Path(f'/proc/{pid}/task/{pid}/children').read_text().split():
            if Path(f'/proc/{each}/status').read_text().split('NSpid:')[1].split()[1] == '1':
                return int(each)
    return 0


def _name_of(pid):
    return Path(f'/proc/{pid}/comm').read_text().strip()


def _wait(condition, what):
    deadline = time.monotonic() + _BOOT_SEC
    while not (result := condition()):
        if time.monotonic() > deadline:
            pytest.fail(f'in vain waited for {what}')
        time.sleep(0.02)
    return result


def main():
    """Open a shell on the laptop of a bed with as many hosts as the argument says."""
    folder = tempfile.mkdtemp(prefix='bed-')
    names = [f'h{number}' for number in range(1, int(sys.argv[1]) + 1)]
    try:
        with Bed(folder, names) as bed:
            (bed.home / '.bedrc').write_text(_SHELL)
            shell = ['bash', '--rcfile', str(bed.home / '.bedrc')]
            subprocess.run(bed.command(*shell), env=bed.environment(BED=folder), check=False)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == '__main__':
    main()
