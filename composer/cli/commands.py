"""The commands with their arguments and options, and what their `--help` says of them.

What a command does is in its file in `composer/commands/`, which is imported when it is run.
"""

from __future__ import annotations

from pathlib import Path

import click

from composer.cli.argument_types import (
    NUMBERS_ARE_VALUES,
    check_log_levels,
    check_rule,
    check_rules,
    refuse_together,
    split_words,
    takes_system,
)
from composer.drawing import FORMATS as PICTURE_FORMATS
from composer.errors import ExitCode
from composer.reports import FORMATS

# Without one there is help, and exit code 2: it is not for choice.
_SUBCOMMAND = 'COMMAND [ARGS]...'


def _show_version(context: click.Context, _option: click.Parameter, value: object) -> None:
    if value and not context.resilient_parsing:
        from composer.version import find_version

        click.echo(f'composer, version {find_version()}')
        context.exit()


def _help_without_command(context: click.Context) -> int:
    """Show what commands there are, if none was given."""
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
    """Run ROS 2 systems that are declared in YAML.

    Exit codes: 0 done, 1 the input or the run failed, 2 wrong usage, 3 a bug in Composer.
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
    help='debug, info, warn, error or fatal; of all nodes, or of one. Wins over the file. '
    'May be repeated.',
)
@click.option(
    '--help', '-h', 'wants_help', is_flag=True, help='Show this, and the arguments of FILE.'
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
    """Check FILE, then run its system until it is stopped.

    LAYERs are files (.yaml, .yml) that change what those before them say. The file's own
    arguments are given by name, NAME:=VALUE, or as values in their order. What follows --ros-args
    (up to the end, or a --) goes to every node.
    """
    from composer.cli.up import describe_file_arguments, up

    if wants_help:
        click.echo(context.get_help())
        if words:
            paths, _ = split_words(words)
            click.echo(f'\n{paths[0]}: {describe_file_arguments(paths)}')
        return ExitCode.DONE
    paths, arguments = split_words(words)
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
    callback=check_rules,
    help='Leave out what this rule finds. May be repeated.',
)
@click.option(
    '--expect',
    'expected',
    metavar='RULE',
    multiple=True,
    callback=check_rules,
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
    '--skip-other-files', is_flag=True, help='Pass over named files that do not look like systems.'
)
@click.option(
    '--stdin-filename',
    metavar='PATH',
    default='<stdin>',
    help='The path of what comes from standard input, for an editor.',
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
    skip_other_files: bool,
    stdin_filename: str,
) -> int:
    """Say all that is wrong with FILES, without running anything.

    It needs no ROS 2. A FILE may be a pattern in quotes, a folder (all systems in it are
    checked), or - for standard input.
    """
    from composer.cli.check import CheckOptions, check

    options = CheckOptions(
        format=format_name,
        output=output,
        is_strict=strict,
        ignored=ignored,
        expected=expected,
        is_quiet=quiet,
        imports=imports,
        skip_other_files=skip_other_files,
        stdin_name=stdin_filename,
    )
    return check(files, options)


@cli.command('explain')
@click.argument('rule', required=False, callback=check_rule)
def explain_command(rule: str | None) -> int:
    """Say what RULE means, with examples; without RULE, list all."""
    from composer.cli.explain import explain

    return explain(rule)


@cli.command('schema')
@click.option('--path', 'path_only', is_flag=True, help='Print where the schema lies.')
def schema_command(*, path_only: bool) -> int:
    """Print the schema of the language (JSON Schema), for editors."""
    from composer.cli.schema import print_schema

    return print_schema(path_only=path_only)


@cli.command('show', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--format',
    'output_format',
    type=click.Choice(['yaml', 'json']),
    default='yaml',
    help='How it is written; yaml by default.',
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
    """Print the final system, with nothing left to evaluate.

    LAYERs and NAME:=VALUE are as for `composer up`, which accepts what is printed.
    """
    from composer.cli.show import show, show_arguments
    from composer.cli.show_parameters import show_parameters

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
        return show_arguments(paths, settings)
    if wants_parameters:
        return show_parameters(paths, arguments, settings)
    return show(paths, arguments, settings, output_format=output_format, origins=origin)


@cli.command('graph', context_settings=NUMBERS_ARE_VALUES)
@takes_system
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
    """Draw who publishes, hears, serves and calls what.

    Types, QoS that differs from the default, and what `composer check` finds are in it. svg and
    html need Graphviz: the program, or the extra 'graph'. LAYERs and NAME:=VALUE are as for
    `composer up`.
    """
    from composer.cli.graph import graph

    paths, arguments = split_words(words)
    return graph(paths, arguments, settings, format_name=format_name, output=output)


@cli.command('new')
@click.argument('name')
def new_command(name: str) -> int:
    """Create the folder NAME with a project that works.

    It has a system, behaviours, tests that run it, CI, and the schema for editors.
    """
    from composer.cli.new import create_project

    return create_project(name)


@cli.group('interfaces', invoke_without_command=True, subcommand_metavar=_SUBCOMMAND)
@click.pass_context
def interfaces_group(context: click.Context) -> int:
    """Build, list and show interface packages."""
    return _help_without_command(context)


@interfaces_group.command('build')
@click.argument('file', type=click.Path(path_type=Path))
def interfaces_build_command(file: Path) -> int:
    """Build the packages of FILE that are not there yet."""
    from composer.cli.interfaces import build

    return build(file)


@interfaces_group.command('list')
@click.argument('package', required=False)
def interfaces_list_command(package: str | None) -> int:
    """List all installed interfaces, or those of PACKAGE."""
    from composer.cli.interfaces import list_all

    return list_all(package)


@interfaces_group.command('show')
@click.argument('name')
def interfaces_show_command(name: str) -> int:
    """Show fields, constants and comments of NAME.

    NAME is a full one, as in std_msgs/msg/Header.
    """
    from composer.cli.interfaces import show

    return show(name)
