"""Declare the commands: their arguments, options and help.

Each command is implemented in a file of its own, imported when the command runs.
"""

from __future__ import annotations

import gc
from pathlib import Path

import click

from composer.cli.common.argument_types import (
    NUMBERS_ARE_VALUES,
    check_log_levels,
    check_rule,
    check_rules,
    refuse_options,
    refuse_together,
    split_words,
    takes_host,
    takes_settings,
    takes_system,
    takes_topics,
)
from composer.cli.common.recording_options import RecordingOptions
from composer.cli.exporting.declarations import export_command
from composer.cli.hosts.declarations import COMMANDS as HOST_COMMANDS
from composer.cli.recording.recording_commands import COMMANDS as RECORDING_COMMANDS
from composer.cli.running.declarations import COMMANDS as RUNNING_COMMANDS
from composer.cli.testing.declarations import test_command
from composer.drawing import FORMATS as PICTURE_FORMATS
from composer.errors import ExitCode
from composer.reports import FORMATS
from composer.terminal import escape

# What `check --types` can be followed by.
TYPE_CHECKERS = ('mypy', 'pyright')
# What a check or a plan imports and reads lives until its end: to look for garbage in it as often
# as usual takes a fifth more.
_OBJECTS_BETWEEN_COLLECTIONS = 1_000_000
# Required: without a command, there is only help.
_SUBCOMMAND = 'COMMAND [ARGS]...'


def _show_version(context: click.Context, _option: click.Parameter, value: object) -> None:
    if value and not context.resilient_parsing:
        from composer.version import find_version

        click.echo(f'composer, version {find_version()}')
        context.exit()


def _help_without_command(context: click.Context) -> int:
    """Print the help if no command was given."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help(), err=True)
    return ExitCode.USAGE


@click.group(
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


@cli.command('up', context_settings={**NUMBERS_ARE_VALUES, 'help_option_names': []})
@takes_system
@click.option(
    '--log-level',
    'log_levels',
    multiple=True,
    metavar='[NODE:=]LEVEL',
    callback=check_log_levels,
    help='Set the log level (debug, info, warn, error or fatal) of all nodes, or of one. '
    'Overrides the file. Can be repeated.',
)
@takes_host
@click.option(
    '--watch', 'watches', is_flag=True, help='Change the running system when its files change.'
)
@click.option(
    '--detach',
    '-d',
    'detaches',
    is_flag=True,
    help="Give the terminal back once all of it is up. 'composer logs' shows what it says.",
)
@click.option(
    '--no-control',
    'is_asked',
    is_flag=True,
    default=True,
    flag_value=False,
    help="Leave out the services that 'composer reload', 'down' and the like use.",
)
@click.option(
    '--record',
    type=click.Path(path_type=Path),
    metavar='FILE',
    help='Record its topics to this MCAP file; a name without .mcap is a folder of rosbag2.',
)
@takes_topics
@click.option(
    '--hold',
    type=click.Path(path_type=Path, dir_okay=False),
    metavar='FILE',
    help='Create all nodes, but run no behaviour while this file is there, for 60 s at most.',
)
# What a system that must start again asks of another process before.
@click.option('--rehearse', 'rehearses', is_flag=True, hidden=True)
@click.option(
    '--help', '-h', 'wants_help', is_flag=True, help='Show this help and the arguments of FILE.'
)
@click.pass_context
def up_command(  # noqa: PLR0913 - one for each option
    context: click.Context,
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    log_levels: tuple[str, ...],
    host: str,
    *,
    watches: bool,
    detaches: bool,
    is_asked: bool,
    record: Path | None,
    topics: tuple[str, ...],
    hold: Path | None,
    rehearses: bool,
    wants_help: bool,
) -> int:
    """Check FILE, then run its system until it is stopped.

    Each LAYER (.yaml or .yml) changes the files before it. Give the arguments that FILE declares
    by name, NAME:=VALUE, or in their order, VALUE. ROS arguments follow --ros-args and go to every
    node.
    """
    from composer.cli.up import describe_file_arguments, up

    if wants_help:
        click.echo(context.get_help())
        if words:
            paths, _ = split_words(words)
            click.echo(f'\n{escape(str(paths[0]))}: {describe_file_arguments(paths)}')
        return ExitCode.DONE
    paths, arguments = split_words(words)
    if detaches:
        from composer.cli.running.detach import start_detached

        options = [f'--set={each}' for each in set_values]
        options += [f'--log-level={each}' for each in log_levels]
        options += [f'--host={host}'] * bool(host)
        options += ['--watch'] * watches + ['--no-control'] * (not is_asked)
        options += [f'--record={record}'] * (record is not None)
        options += [f'--topics={each}' for each in topics]
        options += [f'--hold={hold}'] * (hold is not None)
        given = [*options, *words, '--ros-args', *context.obj, '--']
        return start_detached(paths[0], given, host)
    return up(
        paths,
        arguments,
        context.obj,
        log_levels,
        set_values,
        host=host,
        watches=watches,
        is_asked=is_asked,
        recording=RecordingOptions(record, topics),
        hold=hold,
        ends_process=True,
        rehearses=rehearses,
    )


@cli.command('check', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--matrix',
    metavar='FILE',
    type=click.Path(path_type=Path, dir_okay=False),
    help='Check the system in each combination of arguments, layers and settings that this file '
    "names, instead of those under 'check:'.",
)
@click.option(
    '--format',
    'format_name',
    type=click.Choice(list(FORMATS)),
    default='text',
    show_default=True,
    help='The format of the report.',
)
@click.option(
    '--output',
    type=click.Path(path_type=Path, dir_okay=False),
    help='Write the report to this file, and print the findings as text.',
)
@click.option('--strict', is_flag=True, help='Fail on warnings, too.')
@click.option(
    '--ignore',
    'ignored',
    metavar='RULE',
    multiple=True,
    callback=check_rules,
    help='Leave out the findings of this rule. Can be repeated.',
)
@click.option(
    '--expect',
    'expected',
    metavar='RULE',
    multiple=True,
    callback=check_rules,
    help='Pass only if this rule finds something and no other rule does. Can be repeated.',
)
@click.option(
    '--import',
    'imports',
    is_flag=True,
    help='Import the behaviours and check the functions, too. Runs the code of their modules.',
)
@click.option(
    '--types',
    is_flag=True,
    help='Run a type checker over the behaviours, too: one that is installed, or the one that is '
    'named, as in --types pyright (mypy or pyright).',
)
@click.option('--quiet', '-q', is_flag=True, help='Print only errors and warnings.')
@click.option(
    '--skip-other-files',
    is_flag=True,
    help='Skip named files that are not systems, such as other YAML.',
)
@click.option(
    '--strict-packages',
    is_flag=True,
    help='Without ROS 2: report packages that are not installed as errors, too.',
)
@click.option(
    '--stdin-filename',
    metavar='PATH',
    default='<stdin>',
    help='The path to report for standard input, as editors need it.',
)
def check_command(  # noqa: PLR0913 - one for each option
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    *,
    matrix: Path | None,
    format_name: str,
    output: Path | None,
    strict: bool,
    ignored: tuple[str, ...],
    expected: tuple[str, ...],
    imports: bool,
    types: bool,
    quiet: bool,
    skip_other_files: bool,
    strict_packages: bool,
    stdin_filename: str,
) -> int:
    """Check FILE for errors, without running anything.

    Works without ROS 2. Takes LAYER and NAME:=VALUE as `composer up` does. Without arguments and
    --set, there can be several systems: a FILE can be a folder (to check all systems in it), a
    quoted pattern, or - for standard input. Of several files, one without 'version:' is a layer
    of the one before it.
    """
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    from composer.cli.check import CheckOptions, check

    # The name of a type checker is a word of its own: the option works without.
    type_checker = next((word for word in words if types and word in TYPE_CHECKERS), None)
    words = tuple(word for word in words if word != type_checker)
    options = CheckOptions(
        format=format_name,
        output=output,
        set_values=set_values,
        matrix=matrix,
        is_strict=strict,
        ignored=ignored,
        expected=expected,
        is_quiet=quiet,
        imports=imports,
        types=types,
        type_checker=type_checker,
        skip_other_files=skip_other_files,
        strict_packages=strict_packages,
        stdin_name=stdin_filename,
    )
    refuse_options(words)
    return check(words, options)


@cli.command('explain')
@click.argument('rule', required=False, callback=check_rule)
def explain_command(rule: str | None) -> int:
    """Explain RULE with an example, or list all rules."""
    from composer.cli.explain import explain

    return explain(rule)


@cli.command('schema')
@click.option('--path', 'path_only', is_flag=True, help='Print the path of the schema file.')
@click.option('--matrix', is_flag=True, help='Print the schema of the files of check --matrix.')
@click.option('--scenarios', is_flag=True, help='Print the schema of scenario files.')
def schema_command(*, path_only: bool, matrix: bool, scenarios: bool) -> int:
    """Print the JSON Schema of system files, for editors."""
    from composer.cli.editors import print_schema

    refuse_together({'--path': path_only, '--matrix': matrix})
    return print_schema(path_only=path_only, matrix=matrix, scenarios=scenarios)


@cli.command('show', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--format',
    'output_format',
    type=click.Choice(['yaml', 'json']),
    default='yaml',
    show_default=True,
    help='The output format.',
)
@click.option('--origin', is_flag=True, help='Add to each value where it comes from.')
@click.option(
    '--args', 'wants_arguments', is_flag=True, help='List the arguments that FILE declares.'
)
@click.option(
    '--params',
    'wants_parameters',
    is_flag=True,
    help='Print the parameters of all nodes as a ROS parameter file.',
)
def show_command(
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    output_format: str,
    *,
    origin: bool,
    wants_arguments: bool,
    wants_parameters: bool,
) -> int:
    """Print the final system, with everything resolved.

    Includes, layers, arguments and expressions are replaced by what they result in. The output
    is a valid system itself. Takes LAYER and NAME:=VALUE as `composer up` does.
    """
    from composer.cli.show import show, show_arguments, show_parameters

    refuse_together(
        {
            '--args': wants_arguments,
            '--params': wants_parameters,
            '--origin': origin,
            '--format json': output_format == 'json',
        }
    )
    paths, arguments = split_words(words)
    if wants_arguments:
        return show_arguments(paths, set_values)
    if wants_parameters:
        return show_parameters(paths, arguments, set_values)
    return show(paths, arguments, set_values, output_format=output_format, origins=origin)


@cli.command('plan', context_settings=NUMBERS_ARE_VALUES)
@click.argument(
    'words', nargs=-1, type=click.UNPROCESSED, metavar='[OLD] NEW [NAME:=VALUE]...', required=True
)
@click.option(
    '--layer',
    'layers',
    multiple=True,
    type=click.Path(path_type=Path, dir_okay=False),
    metavar='FILE',
    help='Change both systems by this file. Can be repeated.',
)
@takes_settings
@takes_host
@click.option(
    '--format',
    'format_name',
    type=click.Choice(['text', 'json']),
    default='text',
    show_default=True,
    help='The output format.',
)
@click.option(
    '--exit-code',
    'tells_difference',
    is_flag=True,
    help='Exit with 2 if there is a difference.',
)
def plan_command(
    words: tuple[str, ...],
    layers: tuple[Path, ...],
    set_values: tuple[str, ...],
    host: str,
    format_name: str,
    *,
    tells_difference: bool,
) -> int:
    """Show what turns OLD, or the running system, into NEW.

    Without OLD, the system that runs is asked which has the name of NEW.
    There is a line for each operation: + added, ~ changed in place, ± recreated, - removed; with
    old and new values, why something must be recreated, and what is lost.
    """
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    from composer.cli.plan import plan

    paths, arguments = split_words(words)
    if arguments[:1] == ['-']:
        paths.append(Path(arguments.pop(0)))
    return plan(
        paths,
        arguments,
        set_values,
        layers=layers,
        host=host,
        format_name=format_name,
        tells_difference=tells_difference,
    )


@cli.command('graph', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--format',
    'format_name',
    type=click.Choice(list(PICTURE_FORMATS)),
    help='The format; by default that of the suffix of --output, else mermaid.',
)
@click.option(
    '--output',
    type=click.Path(path_type=Path, dir_okay=False),
    help='Write the drawing to this file.',
)
def graph_command(
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    *,
    format_name: str | None,
    output: Path | None,
) -> int:
    """Draw the graph of nodes, topics, services and actions.

    Shows types, QoS that is not the default, and what `composer check` finds. svg and html need
    Graphviz: the program, or the extra 'graph'. Takes LAYER and NAME:=VALUE as `composer up` does.
    """
    from composer.cli.graph import graph

    paths, arguments = split_words(words)
    return graph(paths, arguments, set_values, format_name=format_name, output=output)


@cli.command('stubs', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--output',
    type=click.Path(path_type=Path, file_okay=False),
    default=Path('typings'),
    show_default=True,
    metavar='DIR',
    help='The folder to write them to.',
)
def stubs_command(words: tuple[str, ...], set_values: tuple[str, ...], output: Path) -> int:
    """Write typed stubs of the messages and nodes of FILE.

    Layers, arguments and --set are those of 'composer up'; without arguments and --set, several
    files, folders and patterns may be named.

    Annotate a behaviour with the class of its node, as in `node: Governor` after
    `from composer_stubs.robot import Governor` under `if TYPE_CHECKING:`.
    """
    from composer.cli.editors import write_stubs

    return write_stubs(words, set_values, output)


@cli.command('import', context_settings=NUMBERS_ARE_VALUES)
@click.argument('file', type=click.Path(path_type=Path))
@click.argument('words', nargs=-1, metavar='[NAME:=VALUE]...')
@click.option(
    '--output',
    '-o',
    type=click.Path(path_type=Path),
    help='Write the system to this file, and its parameter files beside it. Default: print it.',
)
@click.option(
    '--verify',
    'verifies',
    is_flag=True,
    help='Also run both with stand-ins for their programs, and compare what each is given.',
)
def import_command(
    file: Path, words: tuple[str, ...], output: Path | None, *, verifies: bool
) -> int:
    """Turn the launch file FILE into a system.

    It is resolved by the installed launch and launch_ros, with these values for its arguments. All
    of its arguments remain arguments of the system. What cannot be kept is a comment with the line
    that it comes from.
    """
    from composer.cli.importing.import_launch import import_launch_file

    return import_launch_file(file, words, output, verifies=verifies)


@cli.command('new')
@click.argument('name')
def new_command(name: str) -> int:
    """Create a project in a new folder NAME.

    The project has a system, its behaviours, tests, a CI workflow, and the schemas for editors.
    """
    from composer.cli.new import create_project

    return create_project(name)


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
    *RUNNING_COMMANDS,
    *HOST_COMMANDS,
    *RECORDING_COMMANDS,
    test_command,
    export_command,
):
    cli.add_command(_command)
