"""Declare the command that exports systems: see `composer.cli.commands`."""

from __future__ import annotations

from pathlib import Path

import click

from composer.cli.common.argument_types import NUMBERS_ARE_VALUES, split_words, takes_system
from composer.errors import UsageError
from composer.export import ANSIBLE, FORMS, NODL


@click.command('export', context_settings=NUMBERS_ARE_VALUES)
@click.argument('form', metavar='FORM', type=click.Choice([*FORMS, ANSIBLE, NODL]))
@takes_system
@click.option(
    '--output',
    '-o',
    type=click.Path(path_type=Path, file_okay=False),
    metavar='DIR',
    help='Write the files to this folder. Default: print them.',
)
@click.option(
    '--image',
    default='',
    metavar='NAME',
    help='The container image to run; it must have Composer and ROS 2. Default for compose: one '
    'is built.',
)
@click.option(
    '--user/--system',
    'is_of_user',
    default=None,
    help='Write units for the service manager of a user, or of the system. Default: what the '
    'hosts of the file say, or of a user.',
)
@click.pass_context
def export_command(
    context: click.Context,
    form: str,
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    output: Path | None,
    image: str,
    *,
    is_of_user: bool | None,
) -> int:
    """Write units, manifests or playbooks that run FILE.

    FORM is systemd, compose or kubernetes, with a service for each host of FILE, or one for all;
    ansible, a folder with what 'composer deploy' runs; or nodl, with a document about each node.
    Layers, arguments, --set and --ros-args are those that 'composer up' will be given. Values of
    environment variables that FILE reads stand in no file: each says how to give them.
    """
    if form in {'systemd', ANSIBLE, NODL} and image:
        message = '--image is for compose and kubernetes'
        raise UsageError(message)
    if form != 'systemd' and is_of_user is not None:
        message = '--user and --system are for systemd'
        raise UsageError(message)
    paths, arguments = split_words(words)
    if form == ANSIBLE:
        from composer.cli.hosts.deploy import export_ansible

        if output is None:
            message = 'ansible is a folder of files'
            raise UsageError(message, help='say where: --output DIR')
        return export_ansible(paths, arguments, set_values, output)
    from composer.cli.exporting.export import export

    return export(
        form,
        paths,
        arguments,
        set_values,
        context.obj,
        output=output,
        image=image,
        scope=None if is_of_user is None else 'user' if is_of_user else 'system',
    )
