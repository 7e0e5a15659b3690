"""Declare the commands for hosts: see `composer.cli.commands`."""

from __future__ import annotations

import click

from composer.cli.common.argument_types import (
    NUMBERS_ARE_VALUES,
    refuse_together,
    split_words,
    takes_system,
)


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
    '--leave',
    'leave',
    multiple=True,
    metavar='NAME',
    help='Leave this host, which is to run nothing any more, as it is. Can be repeated.',
)
def deploy_command(
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    hosts: tuple[str, ...],
    leave: tuple[str, ...],
    *,
    only_plans: bool,
    removes: bool,
) -> int:
    """Bring FILE to its hosts over SSH, and run each part there.

    Each host gets its part: files, behaviours, and the packages that it lacks; and a unit of
    systemd that runs it, from each boot on. Only what has changed is brought. All hosts change
    together: if one fails, all go back. No file is overwritten that somebody edited there. A host
    that nothing is to run on any more has its part stopped and removed.
    """
    refuse_together({'--plan': only_plans, '--remove': removes})
    from composer.cli.hosts.deploy import deploy

    paths, arguments = split_words(words)
    return deploy(
        paths, arguments, set_values, hosts, leave, only_plans=only_plans, removes=removes
    )


COMMANDS = (deploy_command,)
