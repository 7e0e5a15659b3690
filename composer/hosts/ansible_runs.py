"""Runs of Ansible's playbooks, and what becomes of the hosts."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.errors import ComposerError, ExitCode
from composer.hosts.requirements import PlatformSpec
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from composer.language.specs import HostSpec

State: TypeAlias = Literal['changed', 'nothing to do', 'failed', 'unreachable']

# Before what does not end by itself is killed.
_END_SEC = 10.0
_COLOUR = re.compile(r'\x1b\[[0-9;]*m')
_RECAP = re.compile(r'^(\S+)\s+: ok=\d+\s+changed=(\d+)\s+unreachable=(\d+)\s+failed=(\d+)')


@record
class Outcome:
    """What a playbook has done.

    Attributes:
        states: What became of each host.
        code: What tells of it.
    """

    states: dict[str, State]
    code: ExitCode


def check_ansible() -> None:
    """Check that there is an Ansible.

    Raises:
        ComposerError: It is not installed.
    """
    if find_spec('ansible') is None:
        message = 'hosts are deployed to by ansible-core, which is not installed'
        raise ComposerError(message, help="pip install 'rclpy-composer[hosts]'")


def read_targets(folder: Path, hosts: Sequence[HostSpec]) -> dict[str, PlatformSpec]:
    """Return what hosts have answered to the playbook that asks them, by their names."""
    targets = {}
    for host in hosts:
        text = (folder / f'{host.name}.json').read_text(encoding='utf-8')
        (major, minor), machine, glibc, ros = json.loads(text)
        targets[host.name] = PlatformSpec((major, minor), machine, glibc, ros)
    return targets


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
    has_failed = process.wait() != 0
    code = ExitCode.UNREACHABLE if 'unreachable' in states.values() else ExitCode(has_failed)
    return Outcome(states, code)


def _state(changed: int, unreachable: int, failed: int) -> State:
    if unreachable:
        return 'unreachable'
    if failed:
        return 'failed'
    return 'changed' if changed else 'nothing to do'
