"""`composer deploy`: bring a system to its hosts, and run it there."""

from __future__ import annotations

import asyncio
import signal
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from composer import signals
from composer.application.file_selection import load_given
from composer.application.output import show_findings
from composer.application.system_reader import list_files
from composer.checks.checker import check_in_context, create_context
from composer.checks.placement.hosts_and_workers import find_unplaced
from composer.diagnostics import has_errors
from composer.errors import ExitCode
from composer.export.parts import choose_read
from composer.expressions.functions import variables_noted
from composer.hosts.bundle import Bundle, choose_hosts
from composer.hosts.connection import find_real_address, import_asyncssh
from composer.hosts.deployment import Deployment
from composer.hosts.host_plan import render_plan
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.network.addresses import is_loopback
from composer.network.servers import list_sought, used_hosts
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Coroutine, Sequence
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.language.specs import HostSpec, SystemSpec


def deploy(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    hosts: Sequence[str],
    leave: Sequence[str] = (),
    *,
    only_plans: bool,
    removes: bool,
) -> int:
    """Bring a system to its hosts; return the exit code.

    Args:
        paths: The file and its layers.
        words: Values for the arguments that the file declares.
        set_values: Values to change.
        hosts: The names of those to change; empty for all.
        leave: The names of hosts without anything to run that are left as they are.
        only_plans: Whether to show what would be done only.
        removes: Whether to remove the system.

    Raises:
        ComposerError: It could not be done, and everything is as it was.
    """
    import_asyncssh()
    with variables_noted() as names:
        context = _read(paths, words, set_values, needs_hosts=not removes)
    if context is None:
        return ExitCode.FAILED
    chosen = choose_hosts(context.spec, hosts)
    if removes:
        return _run(_remove(context.spec, chosen, hosts, leave))
    addresses = find_addresses(context.spec)
    looked_for = [f'hosts.{name}.address={address}' for name, address in addresses.items()]
    settings = [f'--set={each}' for each in (*set_values, *looked_for)]
    read = choose_read(names)
    bundle = Bundle(context, paths, list_files(context), [*words, *settings], read, addresses)
    return _run(_deploy(context.spec, chosen, hosts, leave, bundle, only_plans=only_plans))


def _run(work: Coroutine[Any, Any, None]) -> int:
    """Do something on hosts; return the exit code. After a signal, what was done is taken back."""
    received: list[int] = []

    async def run() -> None:
        task = asyncio.ensure_future(work)
        loop = asyncio.get_running_loop()

        def stop(number: int) -> None:
            received.append(number)
            task.cancel()

        for number in signals.HANDLED:
            if signal.getsignal(number) is not signal.SIG_IGN:
                loop.add_signal_handler(number, stop, number)
        with suppress(asyncio.CancelledError):
            await task

    asyncio.run(run())
    return 128 + received[0] if received else ExitCode.DONE


def _read(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    *,
    needs_hosts: bool,
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


def find_addresses(spec: SystemSpec) -> dict[str, str]:
    """Return the addresses by which hosts find each other, by name, where ssh has others.

    Raises:
        ComposerError: The configuration of ssh cannot be read.
    """
    found = {}
    for host in list_sought(spec, used_hosts(spec)):
        address = find_real_address(host)
        if address == host.address:
            continue
        known = f"host {host.name}: '{host.address}' is {address} for ssh here (HostName)"
        if is_loopback(address):
            _tell(f"warning: {known}: all hosts must know it as '{host.address}'")
        else:
            _tell(f'{known}: the hosts find each other by that')
            found[host.name] = address
    return found


async def _deploy(
    spec: SystemSpec,
    hosts: Sequence[HostSpec],
    wanted: Sequence[str],
    leave: Sequence[str],
    bundle: Bundle,
    *,
    only_plans: bool,
) -> None:
    system = spec.name
    async with Deployment(system, hosts, _tell) as deployment:
        if not only_plans:
            await deployment.lock()
        facts = await deployment.look()
        deployment.check_variables(bundle.needed_variables)
        if not only_plans:
            await deployment.repair()
        await deployment.find_left(spec.hosts, wanted, leave, locks=not only_plans)
        plans = deployment.plan(bundle.build(hosts, facts))
        for each in plans:
            click.echo('\n'.join(map(escape, render_plan(each))))
        if only_plans:
            return
        deployment.check(plans)
        await deployment.apply(plans)
    busy = sum(each.action != 'nothing' for each in plans)
    _tell(f'{system}: {_count(busy)} changed' if busy else f'{system}: nothing to change')


async def _remove(
    spec: SystemSpec, hosts: Sequence[HostSpec], wanted: Sequence[str], leave: Sequence[str]
) -> None:
    async with Deployment(spec.name, hosts, _tell) as deployment:
        await deployment.lock()
        await deployment.look()
        await deployment.find_left(spec.hosts, wanted, leave, locks=True)
        await deployment.remove()


def _count(hosts: int) -> str:
    return f'{hosts} host' if hosts == 1 else f'{hosts} hosts'


def _tell(line: str) -> None:
    click.echo(escape(line), err=True)
