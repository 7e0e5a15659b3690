"""`composer doctor`: what this computer has of what systems need, and what to do about the rest.

Nothing is changed. A node of its own starts in a process of its own, which may crash.
"""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import re
import shutil
import socket
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, distributions, requires
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from composer.errors import ComposerError, ExitCode
from composer.records import record
from composer.version import find_version

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

State = Literal['ok', 'note', 'warning', 'error']
_COLOURS: dict[State, str] = {'ok': 'green', 'note': 'blue', 'warning': 'yellow', 'error': 'red'}
_TIMEOUT_SEC = 30
# Docker gives a container so much of shared memory; a process of Fast DDS takes half a megabyte,
# and one with workers sixteen.
_LEAST_SHARED_BYTES = 64 << 20
_LEAST_DESCRIPTORS = 1024
_LEAST_PROCESSES = 512
# That of Fast DDS's discovery in domain 0, and a port that nobody minds.
_MULTICAST = ('239.255.0.1', 47_311)
# Ports of later domains are those that Linux gives to any program.
_LAST_SAFE_DOMAIN = 101
_OLD_DISTROS = ('humble', 'iron', 'galactic', 'foxy')
# Written by what keeps the clock, once it is right.
_SYNCHRONISED = (Path('/run/systemd/timesync/synchronized'), Path('/run/chrony/chronyd.pid'))
# Extras that are for other machines, or for the work on Composer itself.
_OTHER_EXTRAS = re.compile('ros-.*|test|dev')


@record
class Result:
    """What was found about one thing.

    Attributes:
        advice: What to do, if something is to be done.
    """

    name: str
    state: State
    detail: str
    advice: str = ''


def examine(format_name: str) -> int:
    """Print what there is; return the exit code, which is 1 if systems cannot run."""
    results = [result for each in _EXAMINATIONS for result in each()]
    if format_name == 'json':
        click.echo(json.dumps([asdict(each) for each in results], indent=2))
    else:
        for line in _lines(results):
            click.echo(line)
    return ExitCode.FAILED if any(each.state == 'error' for each in results) else ExitCode.DONE


def _lines(results: list[Result]) -> Iterator[str]:
    width = max(len(each.name) for each in results)
    for each in results:
        state = click.style(f'{each.state:<8}', fg=_COLOURS[each.state])
        yield f'{state} {each.name:<{width}}  {each.detail}'
        if each.advice:
            yield f'{"":<{width + 9}}  help: {each.advice}'
    bad = sum(each.state in {'warning', 'error'} for each in results)
    yield 'nothing to do' if not bad else f'{bad} of {len(results)} need something'


def _examine_versions() -> Iterator[Result]:
    yield Result('composer', 'ok', find_version())
    detail = f'{platform.python_version()}, {platform.machine()}, {sys.executable}'
    yield Result('python', 'ok', detail)
    found = sorted(
        path.name for path in Path('/opt/ros').glob('*') if (path / 'setup.sh').exists()
    )
    sourced = os.environ.get('ROS_DISTRO')
    if sourced in _OLD_DISTROS:
        advice = 'use Jazzy or later'
        yield Result('ros', 'error', f'{sourced} is sourced, which is too old', advice)
    elif sourced:
        yield Result('ros', 'ok', f'{sourced} is sourced')
    elif found:
        advice = f'to use it: . /opt/ros/{found[-1]}/setup.sh'
        yield Result(
            'ros', 'note', f'/opt/ros has {", ".join(found)}, and none is sourced', advice
        )
    else:
        yield Result('ros', 'ok', 'none is sourced, none is in /opt/ros: that of wheels is used')


# Its last line is what was found: rclpy may print others before.
_START = """
import json, rclpy
from rclpy.utilities import get_rmw_implementation_identifier
from composer.cli.doctor_accesses import find_missing
rclpy.init()
node = rclpy.create_node('composer_doctor', enable_rosout=False, start_parameter_services=False)
missing = [(each.name, each.gain, each.without) for each in find_missing(node)]
print(json.dumps([get_rmw_implementation_identifier(), rclpy.__path__[0], missing]), flush=True)
"""


def _examine_ros() -> Iterator[Result]:
    """Start a node, in another process: a middleware that fails may take its process with it."""
    if importlib.util.find_spec('rclpy') is None:
        yield Result('rclpy', 'error', 'this Python has none', _explain_no_rclpy())
        return
    try:
        found = subprocess.run(  # noqa: S603
            [sys.executable, '-c', _START],
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_SEC,
            check=False,
        )
    except subprocess.TimeoutExpired:
        detail = f'a node did not start within {_TIMEOUT_SEC} s'
        yield Result('rclpy', 'error', detail, 'see what discovery waits for: ROS_STATIC_PEERS')
        return
    lines = found.stdout.splitlines()
    # What a process says that crashes while it ends counts, too.
    if not lines or not lines[-1].startswith('['):
        last = (found.stderr.strip().splitlines() or [f'exit code {found.returncode}'])[-1]
        wanted = os.environ.get('RMW_IMPLEMENTATION')
        advice = f"RMW_IMPLEMENTATION is '{wanted}': install it, or unset this" if wanted else ''
        yield Result('rclpy', 'error', f'a node cannot start: {last}', advice)
        return
    middleware, path, missing = json.loads(lines[-1])
    yield Result('rclpy', 'ok', f'{_find_rclpy_version()}, {path}')
    yield Result('middleware', 'ok', f'{middleware}: a node has started')
    for name, gain, without in missing:
        detail = f'{name} are not there as Composer knows them: {gain}'
        yield Result('accesses', 'warning', detail, f'this version is not supported: {without}')
    if not missing:
        yield Result('accesses', 'ok', 'all that is used beside documented interfaces is there')


def _explain_no_rclpy() -> str:
    if platform.machine() not in {'x86_64', 'AMD64'}:
        return (
            f'there are no wheels of ROS for {platform.machine()}: source a ROS 2 '
            '(. /opt/ros/jazzy/setup.sh), or use a container or conda (RoboStack)'
        )
    return "pip install 'rclpy-composer[ros]', or source yours: . /opt/ros/jazzy/setup.sh"


def _find_rclpy_version() -> str:
    for each in distributions():
        name = each.metadata['Name'] or ''
        if re.fullmatch('(ros-[a-z]+-)?rclpy', name):
            return f'{name} {each.version}'
    return 'of unknown version'


def _examine_variables() -> Iterator[Result]:
    from composer.checks.environment import find_environment_problems
    from composer.runtime.environment import check_log_folder

    results = [
        Result('variables', 'error', message, help_text or '')
        for _, message, help_text in find_environment_problems(dict(os.environ))
    ]
    try:
        check_log_folder(())
    except ComposerError as error:
        results.append(Result('variables', 'error', str(error), error.help or ''))
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    if domain.isdecimal() and int(domain) > _LAST_SAFE_DOMAIN:
        detail = f'ROS_DOMAIN_ID is {domain}: Linux gives its ports to other programs'
        results.append(Result('variables', 'warning', detail, f'use 0 to {_LAST_SAFE_DOMAIN}'))
    if os.path.exists('DEFAULT_FASTDDS_PROFILES.xml'):
        detail = 'DEFAULT_FASTDDS_PROFILES.xml of this folder changes how Fast DDS delivers'
        results.append(Result('variables', 'warning', detail, 'run systems from another folder'))
    for name in ('AMENT_PREFIX_PATH', 'PYTHONPATH'):
        for entry in filter(None, os.environ.get(name, '').split(os.pathsep)):
            if not os.path.isdir(entry):
                detail = f"{name}: there is no folder '{entry}'"
                results.append(
                    Result('variables', 'warning', detail, 'source what built it again')
                )
            elif problem := _find_other_python(entry):
                results.append(Result('variables', 'warning', f"{name}: '{entry}' {problem}"))
    said = ', '.join(
        f'{name}={value}'
        for name, value in sorted(os.environ.items())
        if name in {'ROS_DOMAIN_ID', 'RMW_IMPLEMENTATION', 'ROS_LOCALHOST_ONLY'}
        or name.startswith(('ROS_AUTOMATIC', 'ROS_STATIC', 'FASTRTPS_', 'FASTDDS_', 'ROS_DISC'))
    )
    yield from results or [Result('variables', 'ok', said or 'none of ROS says anything special')]


def _find_other_python(entry: str) -> str:
    """Return what is wrong with a folder of packages that another Python has installed."""
    found = re.search(r'/python(3\.\d+)/', f'{entry}/')
    own = f'{sys.version_info.major}.{sys.version_info.minor}'
    return f'is for Python {found[1]}, and this is {own}' if found and found[1] != own else ''


def _examine_memory() -> Iterator[Result]:
    shared = Path('/dev/shm')  # noqa: S108 - where Linux has it
    name = 'shared memory'
    if not os.access(shared, os.W_OK):
        yield Result(name, 'error', f'{shared} cannot be written to', 'mount a tmpfs there')
        return
    free = shutil.disk_usage(shared).free
    left = sum(not _is_locked(path) for path in shared.glob('fast*_el'))
    detail = f'{free >> 20} MB are free; {left} segments of killed processes'
    if free < _LEAST_SHARED_BYTES:
        advice = 'of a container: --shm-size 512m; a start of Composer removes what is left'
        yield Result(name, 'warning', detail, advice)
    else:
        yield Result(name, 'ok', detail)


def _is_locked(path: Path) -> bool:
    import fcntl

    with suppress(OSError), path.open('rb') as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return False
    return True


def _examine_limits() -> Iterator[Result]:
    import resource

    from composer.processes.kernel import check_kernel

    try:
        check_kernel()
        yield Result('kernel', 'ok', f'{platform.system()} {platform.release()}')
    except ComposerError as error:
        yield Result('kernel', 'error', str(error), error.help or '')
    infinite = resource.RLIM_INFINITY
    found = {
        'open files': (resource.getrlimit(resource.RLIMIT_NOFILE)[1], _LEAST_DESCRIPTORS),
        'processes and threads': (_find_most_processes(resource), _LEAST_PROCESSES),
    }
    for name, (limit, least) in found.items():
        text = 'no limit' if limit == infinite else f'at most {limit}'
        if limit != infinite and limit < least:
            advice = f'a large system needs {least}: ulimit, LimitNOFILE= and TasksMax= of a unit'
            yield Result('limits', 'warning', f'{name}: {text}', f'{advice}, or --pids-limit')
        else:
            yield Result('limits', 'ok', f'{name}: {text}')


def _find_most_processes(resource: object) -> int:
    limit: int = resource.getrlimit(resource.RLIMIT_NPROC)[0]  # type: ignore[attr-defined]
    with suppress(OSError, ValueError, IndexError):
        group = Path('/proc/self/cgroup').read_text().splitlines()[-1].split(':', 2)[2]
        most = int(Path(f'/sys/fs/cgroup{group}/pids.max').read_text())
        return most if limit < 0 else min(limit, most)
    return limit


def _examine_network() -> Iterator[Result]:
    """Send oneself a message by multicast, as discovery does."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        group, port = _MULTICAST
        try:
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            receiver.bind(('', port))
            membership = socket.inet_aton(group) + socket.inet_aton('0.0.0.0')  # noqa: S104
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
            receiver.settimeout(1)
            sender.sendto(b'composer', _MULTICAST)
            receiver.recv(16)
        except OSError as error:
            detail = f'multicast does not work: {error.strerror or "nothing came back"}'
            advice = 'other computers are not found by themselves: see network: of a system'
            yield Result('network', 'warning', detail, advice)
        else:
            yield Result('network', 'ok', 'multicast reaches this computer')


def _examine_clock() -> Iterator[Result]:
    if any(path.exists() for path in _SYNCHRONISED):
        yield Result('clock', 'ok', 'it is kept by NTP')
    else:
        advice = 'of several computers, stamps are compared: chrony or systemd-timesyncd keep them'
        yield Result('clock', 'note', 'nothing here seems to keep it', advice)


def _examine_extras() -> Iterator[Result]:
    """Name what the extras of this package need and what is not installed."""
    try:
        wanted = requires('rclpy-composer') or []
    except PackageNotFoundError:
        return
    installed = {_normal(each.metadata['Name'] or '') for each in distributions()}
    missing: dict[str, list[str]] = {}
    for requirement in wanted:
        extra = re.search(r"""extra == ['"]([\w-]+)['"]""", requirement)
        package = re.match(r'[\w.-]+', requirement)
        if not extra or not package or _OTHER_EXTRAS.fullmatch(extra[1]):
            continue
        if extra[1] == 'ros' and importlib.util.find_spec('rclpy'):
            continue
        if _normal(package[0]) not in installed:
            missing.setdefault(extra[1], []).append(package[0])
    for name, packages in missing.items():
        advice = f"if you need it: pip install 'rclpy-composer[{name}]'"
        yield Result('extras', 'note', f'[{name}] lacks {", ".join(packages)}', advice)
    if not missing:
        yield Result('extras', 'ok', 'all are installed')


def _normal(name: str) -> str:
    return re.sub(r'[-_.]+', '-', name).lower()


_EXAMINATIONS: tuple[Callable[[], Iterator[Result]], ...] = (
    _examine_versions,
    _examine_ros,
    _examine_variables,
    _examine_memory,
    _examine_limits,
    _examine_network,
    _examine_clock,
    _examine_extras,
)
