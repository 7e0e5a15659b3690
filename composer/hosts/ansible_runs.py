"""Runs of Ansible for the hosts of a system: what they are, and playbooks."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.errors import ComposerError, ExitCode
from composer.hosts.bundle import GROUP
from composer.hosts.requirements import PlatformSpec
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from composer.language.specs import HostSpec

State: TypeAlias = Literal['changed', 'nothing to do', 'failed', 'unreachable']

_LOOK = (
    'import glob, json, platform, sys, venv; '
    'print(json.dumps([sys.version_info[:2], platform.machine(), platform.libc_ver()[1], '
    'sorted(glob.glob("/opt/ros/*/setup.sh"))]))'
)
_END_SEC = 10.0
_OLDEST_PYTHON = (3, 11)
_ANSWER = re.compile(
    r'^(\S+) \| (\w+)[^\n]*? (?:>>|=>)\s*(.*?)(?=^\S+ \| \w+|\Z)', re.MULTILINE | re.DOTALL
)
_COLOUR = re.compile(r'\x1b\[[0-9;]*m')
_RECAP = re.compile(r'^(\S+)\s+: ok=\d+\s+changed=(\d+)\s+unreachable=(\d+)\s+failed=(\d+)')


class UnreachableError(ComposerError):
    """A host cannot be reached, and nothing was done."""


@record
class Outcome:
    """What a playbook has done.

    Attributes:
        states: What became of each host.
        code: What Ansible has ended with.
    """

    states: dict[str, State]
    code: int


def check_ansible() -> None:
    """Check that there is an Ansible.

    Raises:
        ComposerError: It is not installed.
    """
    if find_spec('ansible') is None:
        message = 'hosts are deployed to by ansible-core, which is not installed'
        raise ComposerError(message, help="pip install 'rclpy-composer[hosts]'")


def ask_hosts(folder: Path, hosts: Sequence[HostSpec]) -> dict[str, PlatformSpec]:
    """Return what hosts are, by their names.

    Raises:
        UnreachableError: One cannot be reached.
        ComposerError: One has no Python that Composer runs on.
    """
    command = f'{{{{ ansible_python_interpreter }}}} -c {shlex.quote(_LOOK)}'
    words = ['adhoc', GROUP, '-m', 'ansible.builtin.raw', '-a', command]
    done = subprocess.run(  # noqa: S603 - of this Python
        [sys.executable, '-m', 'ansible', *words],
        check=False,
        capture_output=True,
        text=True,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        env={**os.environ, 'ANSIBLE_NOCOLOR': '1', 'ANSIBLE_CALLBACK_RESULT_FORMAT': 'json'},
    )
    answers = {name: (state, text) for name, state, text in _ANSWER.findall(done.stdout)}
    targets, problems = {}, []
    for host in hosts:
        state, text = answers.get(host.name, ('', done.stderr))
        try:
            targets[host.name] = _read_target(text)
        except ValueError:
            problems.append((host, state, text))
    if not problems:
        return targets
    message = '\n'.join(_explain(*problem) for problem in problems)
    if any(state.startswith('UNREACHABLE') for _, state, _ in problems):
        raise UnreachableError(message, help='nothing was done; see if ssh HOST works')
    python = '.'.join(map(str, _OLDEST_PYTHON))
    raise ComposerError(message, help=f'a host needs Python {python} with the module venv')


def _read_target(text: str) -> PlatformSpec:
    # Around it may be what the login prints, and ssh.
    line = next((line for line in text.splitlines() if line.startswith('[[')), '')
    (major, minor), machine, glibc, setups = json.loads(line)
    if (major, minor) < _OLDEST_PYTHON:
        message = f'Python {major}.{minor}'
        raise ValueError(message)
    return PlatformSpec((major, minor), machine, glibc, setups[-1].split('/')[3] if setups else '')


def _explain(host: HostSpec, state: str, text: str) -> str:
    if state.startswith('UNREACHABLE'):
        found = re.search(r'"msg": "(.*?)",?$', text, re.MULTILINE)
        reason = (
            found[1].replace('\\r\\n', ' ').replace('\\n', ' ').strip() if found else 'no answer'
        )
        reason = reason.rpartition('via ssh: ')[2]
        return f'host {host.name} ({host.address}) cannot be reached: {reason}'
    lines = [
        line for line in text.strip().splitlines() if not line.startswith('Shared connection')
    ]
    reason = ' '.join(lines) or 'no answer'
    return f"host {host.name} ({host.address}): '{host.python}' there cannot be used: {reason}"


def run_playbook(
    folder: Path, name: str, options: Sequence[str], take: Callable[[str], None], *, colour: bool
) -> Outcome:
    """Run a playbook of a folder; return what became of the hosts.

    Args:
        take: What is given each line that it prints.

    Raises:
        KeyboardInterrupt: A signal came, and Ansible has ended.
    """
    states: dict[str, State] = {}
    process = subprocess.Popen(  # noqa: S603 - of this Python
        [sys.executable, '-m', 'ansible', 'playbook', name, *options],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors='backslashreplace',
        env={**os.environ, 'ANSIBLE_FORCE_COLOR' if colour else 'ANSIBLE_NOCOLOR': '1'},
        # Of a signal to the group it would hear twice.
        start_new_session=True,
    )
    try:
        for line in process.stdout or ():
            take(line.rstrip('\n'))
            if found := _RECAP.match(_COLOUR.sub('', line)):
                states[found[1]] = _state(*map(int, found.groups()[1:]))
    except KeyboardInterrupt:
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.communicate(timeout=_END_SEC)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        raise
    return Outcome(states, process.wait())


def _state(changed: int, unreachable: int, failed: int) -> State:
    if unreachable:
        return 'unreachable'
    if failed:
        return 'failed'
    return 'changed' if changed else 'nothing to do'


def exit_code_of(outcome: Outcome) -> ExitCode:
    """Return the exit code that tells what has become of hosts."""
    if 'unreachable' in outcome.states.values():
        return ExitCode.UNREACHABLE
    return ExitCode.FAILED if outcome.code else ExitCode.DONE
