"""List the commands, and declare those that have no room of their own.

Each command is declared in its room, and implemented in a file of its own, which is imported when
the command runs.
"""

from __future__ import annotations

from pathlib import Path

import click

from composer.cli.checking.declarations import COMMANDS as CHECKING_COMMANDS
from composer.cli.common.argument_types import takes_format
from composer.cli.exporting.declarations import export_command
from composer.cli.hosts.declarations import COMMANDS as HOST_COMMANDS
from composer.cli.importing.declarations import import_command
from composer.cli.recording.declarations import COMMANDS as RECORDING_COMMANDS
from composer.cli.running.declarations import COMMANDS as RUNNING_COMMANDS
from composer.cli.showing.declarations import COMMANDS as SHOWING_COMMANDS
from composer.cli.starting.declarations import up_command
from composer.cli.testing.declarations import test_command
from composer.errors import ExitCode

# Required: without a command, there is only help.
_SUBCOMMAND = 'COMMAND [ARGS]...'
# What ros2 and other tools call them.
_OTHER_COMMANDS = {
    **dict.fromkeys(('launch', 'run'), 'up'),
    'kill': 'down',
    **dict.fromkeys(('lint', 'validate'), 'check'),
    'init': 'new',
    'play': 'replay',
}


def _show_version(context: click.Context, _option: click.Parameter, value: object) -> None:
    if value and not context.resilient_parsing:
        from composer.version import find_version

        click.echo(f'composer, version {find_version()}')
        context.exit()


class _Commands(click.Group):
    """The commands; those of other tools are reported with the one that does the same."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        meant = _OTHER_COMMANDS.get(args[0])
        if meant is not None:
            message = f"no such command '{args[0]}'. Did you mean '{meant}'?"
            ctx.fail(message)
        return super().resolve_command(ctx, args)


def _help_without_command(context: click.Context) -> int:
    """Print the help if no command was given."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help(), err=True)
    return ExitCode.USAGE


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    subcommand_metavar=_SUBCOMMAND,
    context_settings={'help_option_names': ['-h', '--help']},
)
@click.option(
    '--version',
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help='Show the version and exit.',
)
@click.pass_context
def cli(context: click.Context) -> int:
    """Check and run ROS 2 systems declared in YAML.

    Exit codes: 0 success, 1 wrong input or a failed run, 2 wrong usage, 3 a bug in Composer.
    """
    return _help_without_command(context)


@cli.command('new')
@click.argument('name')
@click.option('--ros-package', 'is_package', is_flag=True, help='Create a ROS package for colcon.')
def new_command(name: str, *, is_package: bool) -> int:
    """Create a project in a new folder NAME.

    The project has a system, its behaviours, tests, a CI workflow, and the schemas for editors; a
    ROS package has message definitions, and tests for 'colcon test', instead of the last two.
    """
    from composer.cli.new import create_project

    return create_project(name, is_package=is_package)


@cli.command('doctor')
@takes_format()
def doctor_command(format_name: str) -> int:
    """Say what systems lack on this computer, and what to do."""
    from composer.cli.doctor import examine

    return examine(format_name)


@cli.group('interfaces', invoke_without_command=True, subcommand_metavar=_SUBCOMMAND)
@click.pass_context
def interfaces_group(context: click.Context) -> int:
    """Build, find, list and show interface packages."""
    return _help_without_command(context)


@interfaces_group.command('build')
@click.argument('files', nargs=-1, required=True, type=click.Path(path_type=Path))
def interfaces_build_command(files: tuple[Path, ...]) -> int:
    """Build the packages of FILES that are not installed or built yet."""
    from composer.cli.interfaces import build

    return build(files)


@interfaces_group.command('path')
@click.argument('files', nargs=-1, type=click.Path(path_type=Path))
def interfaces_path_command(files: tuple[Path, ...]) -> int:
    """Print where the packages of FILES are, and build them if need be.

    Without FILES, print where all built packages are.
    """
    from composer.cli.interfaces import print_path

    return print_path(files)


@interfaces_group.command('env')
@click.argument('files', nargs=-1, type=click.Path(path_type=Path))
@click.option(
    '--shell',
    type=click.Choice(['sh', 'fish']),
    default='sh',
    show_default=True,
    help='The shell that reads the commands; sh stands for bash, zsh and dash, too.',
)
def interfaces_env_command(files: tuple[Path, ...], shell: str) -> int:
    """Print shell commands by which programs find the packages of FILES.

    In bash and zsh: eval "$(composer interfaces env FILE)".
    In fish: composer interfaces env --shell fish FILE | source.
    Without FILES, programs find all built packages.
    """
    from composer.cli.interfaces import print_environment

    return print_environment(files, shell)


@interfaces_group.command('list')
@click.argument('package', required=False)
def interfaces_list_command(package: str | None) -> int:
    """List the interfaces that are installed or built, all or of PACKAGE."""
    from composer.cli.interfaces import list_all

    return list_all(package)


@interfaces_group.command('show')
@click.argument('name')
def interfaces_show_command(name: str) -> int:
    """Show the fields, constants and comments of an interface.

    NAME is its full name, as in std_msgs/msg/Header.
    """
    from composer.cli.interfaces import show

    return show(name)


for _command in (
    up_command,
    *CHECKING_COMMANDS,
    *SHOWING_COMMANDS,
    import_command,
    *RUNNING_COMMANDS,
    *HOST_COMMANDS,
    *RECORDING_COMMANDS,
    test_command,
    export_command,
):
    cli.add_command(_command)
