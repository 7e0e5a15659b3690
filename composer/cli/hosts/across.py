"""`composer ps`, `top`, `logs`, `reload` and `down` for all hosts of a system."""

from __future__ import annotations

import asyncio
import json
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from composer import signals
from composer.application.file_selection import load_given
from composer.application.output import show_findings
from composer.application.running_systems import answer_forms
from composer.application.running_systems.client import RunningSystem
from composer.cli.common.argument_types import split_words
from composer.cli.hosts.top_hosts import merge_health, watch_hosts
from composer.cli.running.ps import print_systems
from composer.cli.running.top import has_screen, print_health
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode
from composer.hosts.asking import (
    Reply,
    ask_all,
    ask_composer,
    state_command,
    stop_command,
)
from composer.hosts.bundle import choose_hosts
from composer.hosts.connection import import_asyncssh
from composer.hosts.journal import JournalReader
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.cli.running.asked_system import AskedSystem
    from composer.cli.running.top_table import View
    from composer.language.specs import HostSpec

_STOP_SEC = 60.0
_STATE_SEC = 10.0
# What systemctl says of a unit that it does not know.
_NO_UNIT = 5
_NOT_RUNNING = 'not running'
# As systemd names them.
_RUNNING_STATES = ('active', 'reloading')
# A part that is not on the graph, by the state of its unit. One that has ended by an error is
# started again after a while.
_PROBLEMS = {
    **dict.fromkeys(_RUNNING_STATES, 'no answer'),
    'activating': 'starting',
    'failed': 'failed',
}


def ps_across(asked: AskedSystem, *, format_name: str) -> int:
    """Print the parts of a system; return the exit code: 1 if one of them does not answer."""
    system, hosts = _read(asked)
    replies = asyncio.run(ask_composer(system, hosts, 'ps', '--format=json'))
    parts = [_part(system, each) for each in replies]
    states = _find_states(system, replies, parts)
    parts = [
        replace(part, problem=_PROBLEMS.get(states.get(reply.host.name, ''), part.problem))
        for part, reply in zip(parts, replies, strict=True)
    ]
    silent = [each for each in replies if states.get(each.host.name) in _RUNNING_STATES]
    print_systems(parts, format_name=format_name)
    _tell_unreachable(replies)
    for each in silent:
        text = f'error: host {escape(each.host.name)}: the part runs, and does not answer'
        click.echo(text, err=True)
        click.echo(escape_each(each.error), nl=False, err=True)
    return ExitCode.FAILED if any(part.status is None for part in parts) else ExitCode.DONE


def _find_states(
    system: str, replies: Sequence[Reply], parts: Sequence[RunningSystem]
) -> dict[str, str]:
    """Return what systemd says of the parts that are not on the graph, by their hosts."""
    hosts = [
        reply.host
        for reply, part in zip(replies, parts, strict=True)
        if part.problem == _NOT_RUNNING
    ]
    found = asyncio.run(ask_all(hosts, lambda host: state_command(system, host), _STATE_SEC))
    return {each.host.name: each.output.strip() for each in found}


def _part(system: str, reply: Reply) -> RunningSystem:
    name = f'{system}@{reply.host.name}'
    if reply.code is None:
        return RunningSystem(name, '', None, 'unreachable')
    if not reply.is_deployed:
        return RunningSystem(name, '', None, 'not deployed')
    with suppress(ComposerError, KeyError, IndexError):
        (told,) = answer_forms.read_answer(reply.output)['systems']
        status = answer_forms.read_answer(json.dumps({'version': 1, **told}), answer_forms.STATUS)
        return RunningSystem(name, '', status)
    return RunningSystem(name, '', None, _NOT_RUNNING)


def top_across(asked: AskedSystem, view: View, *, once: bool, format_name: str) -> int:
    """Show the health of the entities on all hosts; return the exit code.

    Args:
        view: What to show first.
        once: Whether to print it once. So it is where there is no screen, and as JSON.
    """
    system, hosts = _read(asked)
    if not once and format_name != 'json' and has_screen():
        watch_hosts(system, hosts, view)
        return ExitCode.DONE
    replies = asyncio.run(ask_composer(system, hosts, 'top', '--once', '--format=json'))
    told: dict[str, dict[str, Any]] = {}
    for each in replies:
        with suppress(ComposerError):
            told[each.host.name] = answer_forms.read_answer(each.output, answer_forms.TOP)
    if told:
        print_health(merge_health(told), view, format_name)
    _tell_problems(replies)
    return _code(replies)


def reload_across(asked: AskedSystem, timeout_sec: float, *, aborts_goals: bool) -> int:
    """Let each part read its files again; return the exit code."""
    system, hosts = _read(asked)
    options = [f'--timeout={timeout_sec:g}', *['--now'] * aborts_goals]
    replies = asyncio.run(ask_composer(system, hosts, 'reload', *options, timeout_sec=timeout_sec))
    for each in replies:
        click.echo(escape_each(each.output), nl=False)
    _tell_problems(replies)
    return _code(replies)


def down_across(asked: AskedSystem, timeout_sec: float) -> int:
    """Stop each part, until its host starts again or is deployed to; return the exit code."""
    system, hosts, others = _read_all(asked)
    replies = asyncio.run(
        ask_all(
            [*hosts, *others], lambda host: stop_command(system, host), timeout_sec + _STOP_SEC
        )
    )
    asked_first, more = replies[: len(hosts)], replies[len(hosts) :]
    for each in more:
        if each.code is None:
            unknown = f'whether {escape(system)} still runs there is not known'
            click.echo(f'warning: {escape(each.error)}: {unknown}', err=True)
    replies = [*asked_first, *(each for each in more if each.code not in (None, _NO_UNIT))]
    for each in replies:
        if each.code == 0:
            click.echo(f'{escape(system)}@{escape(each.host.name)}: stopped')
    _tell_problems(replies)
    return _code(replies)


def logs_across(asked: AskedSystem, *, follows: bool) -> int:
    """Print what the parts have said, each line with its host; return the exit code."""
    system, hosts = _read(asked)
    width = max(len(host.name) for host in hosts)

    def create_reader(host: HostSpec) -> JournalReader:
        def take(text: str) -> None:
            click.echo(f'{escape(host.name):{width}} | {escape(text)}')

        return JournalReader(system, host, take, _tell)

    readers = [create_reader(host) for host in hosts]

    async def read_all() -> None:
        await asyncio.gather(*(each.follow() if follows else each.read() for each in readers))

    with signals.interrupting():
        try:
            asyncio.run(read_all())
        except KeyboardInterrupt:
            if not any(each.has_failed for each in readers):
                raise
    return ExitCode.FAILED if any(each.has_failed for each in readers) else ExitCode.DONE


def _tell(line: str) -> None:
    click.echo(escape(line), err=True)


def _read(asked: AskedSystem) -> tuple[str, list[HostSpec]]:
    """Return the name of a system, and its hosts; see `_read_all`."""
    system, hosts, _ = _read_all(asked)
    return system, hosts


def _read_all(asked: AskedSystem) -> tuple[str, list[HostSpec], list[HostSpec]]:
    """Return the name of a system, the hosts that have a part, and those that may have had one.

    Raises:
        ComposerError: The file has errors, or no hosts.
    """
    import_asyncssh()
    paths, arguments = split_words(asked.words)
    system = load_given(paths, arguments, asked.set_values)
    if system.spec is None or has_errors(system.diagnostics):
        show_findings(system.diagnostics)
        message = f"'{paths[0]}' has errors"
        raise ComposerError(message)
    spec, hosts = system.spec, choose_hosts(system.spec, asked.hosts)
    others = [
        host
        for name, host in spec.hosts.items()
        if host not in hosts and (not asked.hosts or name in asked.hosts)
    ]
    return spec.name, hosts, others


def escape_each(text: str) -> str:
    """Return lines that others have written, fit for a terminal."""
    return ''.join(f'{escape(line)}\n' for line in text.splitlines())


def _tell_unreachable(replies: Sequence[Reply]) -> None:
    for each in replies:
        if each.code is None:
            click.echo(f'error: {escape(each.error)}', err=True)


def _tell_problems(replies: Sequence[Reply]) -> None:
    _tell_unreachable(replies)
    for each in replies:
        if each.code is not None and not each.is_deployed:
            click.echo(f'error: host {escape(each.host.name)}: not deployed', err=True)
        elif each.code:
            click.echo(escape_each(each.error), nl=False, err=True)


def _code(replies: Sequence[Reply]) -> int:
    has_failed = any(each.code != 0 for each in replies)
    return ExitCode.FAILED if has_failed else ExitCode.DONE
