"""The command line: arguments in, exit code out. Only here an exception becomes an exit code."""

from __future__ import annotations

import faulthandler
import io
import platform
import re
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.drawing import FORMATS as PICTURE_FORMATS
from composer.errors import ComposerError, ExitCode, UsageError
from composer.reports import FORMATS

if TYPE_CHECKING:
    from collections.abc import Sequence

_SET_HELP = 'Change a value, as in nodes.talker.log_level=debug; null removes it.'
_LONGEST_EXIT_SEC = 10.0
_LOG_LEVEL = re.compile(r'([\w/.]+:=)?(debug|info|warn|error|fatal)', re.IGNORECASE)


def main() -> None:
    """Run the command that the process was started with, and exit with its code."""
    for stream in (sys.stdout, sys.stderr):
        # File names and YAML may hold what the terminal's encoding has no character for.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors='backslashreplace')
    code = run(sys.argv[1:])
    # What behaviours leave behind, as threads or functions of `atexit`, does not keep the process.
    with suppress(RuntimeError, ValueError):
        faulthandler.dump_traceback_later(_LONGEST_EXIT_SEC, exit=True)
    sys.exit(code)


def run(arguments: list[str]) -> int:
    """Run a command and return its exit code; nothing is raised."""
    try:
        own, ros_arguments = split_ros_arguments(arguments)
        return int(cli.main(own, 'composer', standalone_mode=False, obj=ros_arguments) or 0)
    except click.exceptions.Exit as error:
        return error.exit_code
    except click.ClickException as error:
        error.show()
        return ExitCode.USAGE
    except (KeyboardInterrupt, click.Abort):
        return ExitCode.FAILED
    except ComposerError as error:
        click.echo(f'error: {error}', err=True)
        if error.help:
            click.echo(f'  help: {error.help}', err=True)
        return ExitCode.USAGE if isinstance(error, UsageError) else ExitCode.FAILED
    except BrokenPipeError:
        # Whoever read our output has gone; there is nobody to tell.
        sys.stderr.close()
        return ExitCode.FAILED
    except Exception:  # noqa: BLE001 - what gets here is a bug of Composer's own
        click.echo(_bug_report(arguments), err=True)
        return ExitCode.BUG


def split_ros_arguments(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Take what stands between `--ros-args` and `--` (or the end) out of a command line.

    Source: https://docs.ros.org/en/jazzy/How-To-Guides/Node-arguments.html
    """
    own: list[str] = []
    ros: list[str] = []
    inside = False
    for argument in arguments:
        if argument == '--ros-args':
            inside = True
        elif inside and argument == '--':
            inside = False
        else:
            (ros if inside else own).append(argument)
    return own, ros


def split_words(words: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Divide what a command line says into files and the arguments that follow them.

    The first word is a file, and so are those right after it that end in `.yaml` or `.yml`.
    """
    count = 1
    while count < len(words) and words[count].endswith(('.yaml', '.yml')):
        count += 1
    return [Path(word) for word in words[:count]], list(words[count:])


def _check_log_levels(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    for value in values:
        if not _LOG_LEVEL.fullmatch(value):
            message = f"'{value}' is no level: debug, info, warn, error, fatal, or NODE:=LEVEL"
            raise click.BadParameter(message)
    return values


def _check_rules(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    for value in values:
        _find_rule(value)
    return values


def _check_rule(
    _context: click.Context, _argument: click.Parameter, value: str | None
) -> str | None:
    if value is not None:
        _find_rule(value)
    return value


def _find_rule(name: str) -> None:
    from composer.names import suggest
    from composer.rules import RULES

    if name not in RULES:
        near = suggest(name, RULES)
        advice = f"did you mean '{near}'?" if near else "'composer explain' lists them"
        message = f"no rule is called '{name}'; {advice}"
        raise click.BadParameter(message)


def _show_version(context: click.Context, _option: click.Parameter, value: object) -> None:
    if value and not context.resilient_parsing:
        from composer.version import find_version

        click.echo(f'composer, version {find_version()}')
        context.exit()


@click.group(context_settings={'help_option_names': ['-h', '--help']})
@click.option(
    '--version',
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help='Show the version and exit.',
)
def cli() -> None:
    """Run ROS 2 systems that are declared in YAML."""


@cli.command(
    'up',
    context_settings={'ignore_unknown_options': True, 'help_option_names': []},
    options_metavar='[OPTIONS]',
)
@click.argument(
    'words', nargs=-1, type=click.UNPROCESSED, metavar='FILE [LAYER]... [NAME:=VALUE]...'
)
@click.option('--set', 'settings', multiple=True, metavar='PATH=VALUE', help=_SET_HELP)
@click.option(
    '--help', '-h', 'wants_help', is_flag=True, help='Show this, and the arguments of FILE.'
)
@click.option(
    '--log-level',
    'log_levels',
    multiple=True,
    metavar='[NODE:=]LEVEL',
    callback=_check_log_levels,
    help='debug, info, warn, error or fatal; of all nodes, or of one. Wins over the file.',
)
@click.pass_context
def up_command(
    context: click.Context,
    words: tuple[str, ...],
    settings: tuple[str, ...],
    log_levels: tuple[str, ...],
    *,
    wants_help: bool,
) -> int:
    """Check FILE, then run the system that it declares until it is stopped.

    LAYERs are files (.yaml, .yml) that change what those before them say. The file's own
    arguments are given by name, NAME:=VALUE, or as values in their order. What follows --ros-args
    (up to the end, or a --) goes to every node.
    """
    from composer.commands.up import describe_file_arguments, up

    if wants_help:
        click.echo(context.get_help())
        if words:
            paths, _ = split_words(words)
            click.echo(f'\n{paths[0]}: {describe_file_arguments(paths)}')
        return ExitCode.DONE
    if not words:
        message = "Missing argument 'FILE'."
        raise click.UsageError(message, context)
    paths, arguments = split_words(words)
    for argument in arguments:
        # A minus before a digit or a dot belongs to a number.
        if re.match(r'-[^\W\d]|--', argument):
            raise click.NoSuchOption(argument, ctx=context)
    return up(paths, arguments, context.obj, log_levels, settings)


@cli.command('check')
@click.argument('files', nargs=-1, required=True, metavar='FILE...')
@click.option(
    '--format',
    'format_name',
    type=click.Choice(list(FORMATS)),
    default='text',
    help='The form of the report; text by default.',
)
@click.option(
    '--output',
    type=click.Path(path_type=Path, dir_okay=False),
    help='Write the report to this file, and show the findings as text.',
)
@click.option('--strict', is_flag=True, help='Let warnings count as faults.')
@click.option(
    '--ignore',
    'ignored',
    metavar='RULE',
    multiple=True,
    callback=_check_rules,
    help='Leave out what this rule finds. May be repeated.',
)
@click.option(
    '--expect',
    'expected',
    metavar='RULE',
    multiple=True,
    callback=_check_rules,
    help='Pass only if this rule finds something, and no other does. May be repeated.',
)
@click.option(
    '--import',
    'imports',
    is_flag=True,
    help='Import the behaviours, and check the functions too. Runs the code of their modules.',
)
@click.option('--quiet', '-q', is_flag=True, help='Show what is wrong and nothing else.')
@click.option(
    '--skip-foreign', is_flag=True, help='Pass over named files that do not look like systems.'
)
@click.option(
    '--stdin-filename', metavar='PATH', default='<stdin>', help='What to take - for, in an editor.'
)
def check_command(  # noqa: PLR0913 - one for each option
    files: tuple[str, ...],
    *,
    format_name: str,
    output: Path | None,
    strict: bool,
    ignored: tuple[str, ...],
    expected: tuple[str, ...],
    imports: bool,
    quiet: bool,
    skip_foreign: bool,
    stdin_filename: str,
) -> int:
    """Say all that is wrong with FILES, without running anything. Needs no ROS.

    A file may be a pattern in quotes, a folder (all systems in it are checked), or - for standard
    input.
    """
    from composer.commands.check import CheckOptions, check

    options = CheckOptions(
        format=format_name,
        output=output,
        is_strict=strict,
        ignored=ignored,
        expected=expected,
        is_quiet=quiet,
        imports=imports,
        skip_foreign=skip_foreign,
        stdin_name=stdin_filename,
    )
    return check(files, options)


@cli.command('explain')
@click.argument('rule', required=False, callback=_check_rule)
def explain_command(rule: str | None) -> int:
    """Say what RULE means, with a bad and a good example; without RULE, list all."""
    from composer.commands.explain import explain

    return explain(rule)


@cli.command('schema')
@click.option('--path', 'path_only', is_flag=True, help='Print where the schema lies.')
def schema_command(*, path_only: bool) -> int:
    """Print the schema of the language (JSON Schema), for editors."""
    from composer.commands.schema import print_schema

    return print_schema(path_only=path_only)


@cli.command('show', options_metavar='[OPTIONS]')
@click.argument('words', nargs=-1, required=True, metavar='FILE... [NAME:=VALUE]...')
@click.option('--set', 'settings', multiple=True, metavar='PATH=VALUE', help=_SET_HELP)
@click.option(
    '--format',
    'output_format',
    type=click.Choice(['yaml', 'json']),
    default='yaml',
    help='How it is written.',
)
@click.option('--origin', is_flag=True, help='Say of each value where it comes from.')
@click.option('--args', 'wants_arguments', is_flag=True, help='List the arguments of FILE.')
@click.option(
    '--params',
    'wants_parameters',
    is_flag=True,
    help="Write all parameters of all nodes, in ROS's own format.",
)
def show_command(
    words: tuple[str, ...],
    settings: tuple[str, ...],
    output_format: str,
    *,
    origin: bool,
    wants_arguments: bool,
    wants_parameters: bool,
) -> int:
    """Print the system that FILE declares: all included, and with nothing left to evaluate.

    Several FILEs are layers, each over those before it. `composer up` accepts what is printed.
    """
    from composer.commands.show import show, show_arguments
    from composer.commands.show_parameters import show_parameters

    paths, arguments = split_words(words)
    if wants_arguments:
        return show_arguments(paths)
    if wants_parameters:
        return show_parameters(paths, arguments, settings)
    return show(paths, arguments, settings, output_format=output_format, origins=origin)


@cli.command('graph', options_metavar='[OPTIONS]')
@click.argument('words', nargs=-1, required=True, metavar='FILE... [NAME:=VALUE]...')
@click.option('--set', 'settings', multiple=True, metavar='PATH=VALUE', help=_SET_HELP)
@click.option(
    '--format',
    'format_name',
    type=click.Choice(list(PICTURE_FORMATS)),
    help='What to draw; by the ending of --output, or mermaid, if not given.',
)
@click.option(
    '--output',
    type=click.Path(path_type=Path, dir_okay=False),
    help='Write the drawing to this file.',
)
def graph_command(
    words: tuple[str, ...],
    settings: tuple[str, ...],
    *,
    format_name: str | None,
    output: Path | None,
) -> int:
    """Draw the system that FILE declares: who publishes, hears, serves and calls what.

    Types, QoS that differs from the default, and what `composer check` finds are in it. svg and
    html need Graphviz: the program, or the extra 'graph'. Several FILEs are layers.
    """
    from composer.commands.graph import graph

    paths, arguments = split_words(words)
    return graph(paths, arguments, settings, format_name=format_name, output=output)


@cli.command('new')
@click.argument('name')
def new_command(name: str) -> int:
    """Create the folder NAME with a project that works: a system, behaviours, tests, CI."""
    from composer.commands.new import create_project

    return create_project(name)


@cli.group('interfaces')
def interfaces_group() -> None:
    """Build, list and show interface packages."""


@interfaces_group.command('build')
@click.argument('file', type=click.Path(path_type=Path))
def interfaces_build_command(file: Path) -> int:
    """Build the packages that FILE declares, where they are not there yet."""
    from composer.commands.interfaces import build

    return build(file)


@interfaces_group.command('list')
@click.argument('package', required=False)
def interfaces_list_command(package: str | None) -> int:
    """List the interfaces that are installed, or those of PACKAGE."""
    from composer.commands.interfaces import list_all

    return list_all(package)


@interfaces_group.command('show')
@click.argument('name')
def interfaces_show_command(name: str) -> int:
    """Show the fields, constants and comments of NAME, as in std_msgs/msg/Header."""
    from composer.commands.interfaces import show

    return show(name)


def _bug_report(arguments: list[str]) -> str:
    from composer.version import find_version

    python = f'Python {platform.python_version()}, {platform.platform()}'
    return '\n'.join(
        [
            'This is a bug in Composer, not in your file. Please report it with what follows.',
            f'  composer {find_version()}, {python}',
            f'  arguments: {arguments}',
            traceback.format_exc().rstrip(),
        ]
    )
