"""`composer deploy`: bring a system to its hosts, and run it there."""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer import signals
from composer.application.file_selection import load_given
from composer.application.output import show_findings, wants_colour
from composer.application.system_reader import list_files
from composer.checks.checker import check_in_context, create_context
from composer.checks.placement.hosts_and_workers import find_unplaced
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode
from composer.export.parts import check_words, choose_read
from composer.expressions.functions import variables_noted
from composer.hosts.ansible_runs import Outcome, check_ansible, read_targets, run_playbook
from composer.hosts.bundle import PLAYBOOKS, Bundle, choose_hosts, write_playbooks
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.network.addresses import is_loopback
from composer.network.servers import list_sought, used_hosts
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from composer.checks.context import CheckContext
    from composer.language.specs import HostSpec, SystemSpec


def deploy(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    hosts: Sequence[str],
    *,
    only_plans: bool,
    removes: bool,
    rollback_sec: float,
) -> int:
    """Bring a system to its hosts; return the exit code.

    Args:
        paths: The file and its layers.
        words: Values for the arguments that the file declares.
        set_values: Values to change.
        hosts: The names of those to change; empty for all.
        only_plans: Whether to show what would be done only.
        removes: Whether to remove the system.
        rollback_sec: After how long without a further step a host goes back.

    Raises:
        ComposerError: Nothing was done.
    """
    check_ansible()
    with variables_noted() as names:
        context = _read(paths, words, set_values, needs_hosts=not removes)
    if context is None:
        return ExitCode.FAILED
    chosen = choose_hosts(context.spec, hosts)
    with signals.interrupting(), tempfile.TemporaryDirectory(prefix='composer-deploy-') as name:
        folder = Path(name)
        write_playbooks(folder, context.spec, chosen)
        options = [f'--extra-vars=composer_rollback_sec={rollback_sec:g}']
        playbook = PLAYBOOKS[removes]
        if not removes:
            bundle = _create_bundle(context, paths, words, set_values, names)
            outcome = run_playbook(folder, PLAYBOOKS[2], [], click.echo, colour=wants_colour())
            if outcome.code:
                _tell(f"error: '{context.spec.name}' was not deployed: nothing was changed")
                return outcome.code
            bundle.write(folder, chosen, read_targets(folder, chosen))
            options += ['--check', '--diff'] * only_plans
        try:
            outcome = run_playbook(folder, playbook, options, click.echo, colour=wants_colour())
        except KeyboardInterrupt:
            _tell(f'interrupted: each host that has changed goes back within {rollback_sec:g} s')
            raise
    _summarize(context.spec.name, outcome, rollback_sec, 'would be ' * only_plans)
    return outcome.code


def _summarize(system: str, outcome: Outcome, rollback_sec: float, would: str) -> None:
    for host, state in outcome.states.items():
        _tell(f'{host}: {would if state == "changed" else ""}{state}')
    states = list(outcome.states.values())
    if outcome.code:
        back = f'; one that was lost does so within {rollback_sec:g} s'
        more = back if 'unreachable' in states else ''
        _tell(f"error: '{system}' was not deployed: all that had changed went back{more}")
        return
    count = states.count('changed')
    hosts = '1 host' if count == 1 else f'{count} hosts'
    _tell(f'{system}: {hosts} {would}changed' if count else f'{system}: nothing to do')


def export_ansible(
    paths: Sequence[Path], words: Sequence[str], set_values: Sequence[str], output: Path
) -> int:
    """Write what brings a system to hosts that are as this computer; return the exit code.

    Raises:
        ComposerError: A file is there that was edited, or a package is not here.
    """
    with variables_noted() as names:
        context = _read(paths, words, set_values, needs_hosts=True)
    if context is None:
        return ExitCode.FAILED
    bundle = _create_bundle(context, paths, words, set_values, names)
    for path in bundle.write(output, choose_hosts(context.spec)):
        _tell(f'wrote {path}')
    return ExitCode.DONE


def _read(
    paths: Sequence[Path], words: Sequence[str], set_values: Sequence[str], *, needs_hosts: bool
) -> CheckContext | None:
    """Return a system without errors, as it is checked here; `None` if it has errors.

    What is known only when it starts is read where it starts.
    """
    system = load_given(paths, words, set_values)
    context = create_context(system, InterfaceCatalogue())
    findings = check_in_context(system, context)
    if context is not None and context.spec.hosts and needs_hosts:
        findings += find_unplaced(context)
    show_findings(findings)
    return None if has_errors(findings) else context


def _create_bundle(
    context: CheckContext,
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    names: Collection[str],
) -> Bundle:
    given, read = [*words, *(f'--set={value}' for value in set_values)], choose_read(names)
    check_words(given, read)
    spec, addresses = context.spec, find_addresses(context.spec)
    given += [f'--set=hosts.{name}.address={address}' for name, address in addresses.items()]
    hosts = {
        name: replace(host, address=addresses.get(name, host.address))
        for name, host in spec.hosts.items()
    }
    found = replace(context, spec=replace(spec, hosts=hosts))
    return Bundle(found, paths, list_files(context), given, read)


def find_addresses(spec: SystemSpec) -> dict[str, str]:
    """Return the addresses by which hosts find each other, by name, where ssh has others.

    Raises:
        ComposerError: The configuration of ssh cannot be read.
    """
    addresses = {}
    for host in list_sought(spec, used_hosts(spec)):
        address = _find_real_address(host)
        known = f"host {host.name}: '{host.address}' is {address} for ssh here (HostName)"
        if is_loopback(address) and address != host.address:
            _tell(f"warning: {known}: all hosts must know it as '{host.address}'")
        elif address != host.address:
            _tell(f'{known}: the hosts find each other by that')
            addresses[host.name] = address
    return addresses


def _find_real_address(host: HostSpec) -> str:
    """Return the `HostName` that the configuration of ssh has for the address of a host."""
    command = ['ssh', '-G', '--', host.address]
    try:
        done = subprocess.run(command, check=True, capture_output=True, text=True)  # noqa: S603 - ssh itself reads its configuration
    except (OSError, subprocess.CalledProcessError) as error:
        message = f'host {host.name} ({host.address}): {getattr(error, "stderr", "") or error}'
        raise ComposerError(message.strip(), help='see ~/.ssh/config') from error
    options = dict(line.partition(' ')[::2] for line in done.stdout.splitlines())
    return options.get('hostname') or host.address


def _tell(line: str) -> None:
    click.echo(escape(line), err=True)
