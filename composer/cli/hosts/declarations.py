"""Declare the commands for hosts: see `composer.cli.commands`."""

from __future__ import annotations

import click

from composer.cli.common.argument_types import (
    NUMBERS_ARE_VALUES,
    refuse_together,
    split_words,
    takes_system,
)

_ROLLBACK_SEC = 90.0


@click.command('deploy', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--host',
    'hosts',
    multiple=True,
    metavar='NAME',
    help='Only this host. Can be repeated.',
)
@click.option('--plan', 'only_plans', is_flag=True, help='Show what would be done, do nothing.')
@click.option(
    '--remove', 'removes', is_flag=True, help='Stop the system, and remove it from its hosts.'
)
@click.option(
    '--rollback-after',
    'rollback_sec',
    type=click.FloatRange(min=1),
    default=_ROLLBACK_SEC,
    show_default=True,
    metavar='SEC',
    help='After how long without a further step a host goes back by itself.',
)
def deploy_command(
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    hosts: tuple[str, ...],
    rollback_sec: float,
    *,
    only_plans: bool,
    removes: bool,
) -> int:
    """Bring FILE to its hosts by Ansible, and run each part there.

    Each host gets its part: files, behaviours, and the packages that it lacks; and a unit of
    systemd that runs it, from each boot on. All hosts change together: if one fails, all go back.
    No file is overwritten that somebody edited there. A host that nothing is to run on any more
    has its part stopped and removed. 'composer export ansible' writes what is run.

    The exit code is 0 if all hosts have what FILE says, 1 if one has failed, and 4 if one could
    not be reached.
    """
    refuse_together({'--plan': only_plans, '--remove': removes})
    from composer.cli.hosts.deploy import deploy

    paths, arguments = split_words(words)
    return deploy(
        paths,
        arguments,
        set_values,
        hosts,
        only_plans=only_plans,
        removes=removes,
        rollback_sec=rollback_sec,
    )


COMMANDS = (deploy_command,)
