"""Declare the commands that show what files say: see `composer.cli.commands`."""

from __future__ import annotations

from pathlib import Path

import click

from composer.cli.common.argument_types import (
    NUMBERS_ARE_VALUES,
    read_words,
    refuse_together,
    split_words,
    takes_format,
    takes_settings,
    takes_system,
    takes_words,
)
from composer.drawing import FORMATS as PICTURE_FORMATS


@click.command('show', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@takes_format(['yaml', 'json'])
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
    format_name: str,
    *,
    origin: bool,
    wants_arguments: bool,
    wants_parameters: bool,
) -> int:
    """Print the final system, with everything resolved.

    This runs the commands that values of the file are read from: show only what you trust.

    Includes, layers, arguments and expressions are replaced by what they result in. The output
    is a valid system itself. Takes LAYER and NAME:=VALUE as `composer up` does.
    """
    from composer.cli.showing.show import show, show_arguments, show_parameters

    refuse_together(
        {
            '--args': wants_arguments,
            '--params': wants_parameters,
            '--origin': origin,
            '--format json': format_name == 'json',
        }
    )
    paths, arguments = split_words(words)
    if wants_arguments:
        return show_arguments(paths, set_values)
    if wants_parameters:
        return show_parameters(paths, arguments, set_values)
    return show(paths, arguments, set_values, format_name=format_name, origins=origin)


@click.command('page', context_settings=NUMBERS_ARE_VALUES)
@takes_words('[SYSTEM | [PACKAGE] FILE [LAYER]... [NAME:=VALUE]...]')
@takes_settings
@click.option(
    '--port', type=click.IntRange(0, 65535), default=0, help='Default: one that is free.'
)
@click.option(
    '--listen', default='127.0.0.1', metavar='ADDRESS', help='Only this computer may be.'
)
@click.option('--no-browser', 'opens', flag_value=False, default=True, help='Only print it.')
@click.option(
    '--allow-changes',
    'allows_changes',
    is_flag=True,
    help='Let the page set parameters, reload, restart nodes, call services and publish.',
)
@click.option(
    '--editor',
    default='vscode://file{file}:{line}',
    show_default=True,
    metavar='ADDRESS',
    help="What a place in a file links to; '' for no links.",
)
@click.option('--ends-with-input', is_flag=True, hidden=True)
def page_command(  # noqa: PLR0913 - one for each option
    words: tuple[str, ...],
    set_values: tuple[str, ...],
    *,
    port: int,
    listen: str,
    opens: bool,
    allows_changes: bool,
    editor: str,
    ends_with_input: bool,
) -> int:
    """Serve a page of the running SYSTEM, or of a FILE.

    The page shows what is wrong, the graph, the nodes with their figures, parameters and log, and
    the text of the files. If only one system runs, it need not be named. Only this computer can
    open it, by the address that is printed.
    """
    from composer.page.server import PageOptions, serve

    is_name = len(words) == 1 and not set_values and not words[0].endswith(('.yaml', '.yml'))
    paths, arguments = ([], []) if is_name or not words else split_words(words)
    name = words[0] if is_name else None
    return serve(
        name,
        paths,
        arguments,
        set_values,
        PageOptions(port, listen, opens, allows_changes, editor, ends_with_input),
    )


@click.command('graph', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--format',
    'format_name',
    type=click.Choice(list(PICTURE_FORMATS)),
    help='The format; by default that of the suffix of --output, else mermaid.',
)
@click.option(
    '--output',
    '-o',
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

    Shows types, QoS that is not the default, and what `composer check` finds. svg needs Graphviz:
    the program, or the extra 'graph'. Takes LAYER and NAME:=VALUE as `composer up` does.
    """
    from composer.cli.showing.graph import graph

    paths, arguments = split_words(words)
    return graph(paths, arguments, set_values, format_name=format_name, output=output)


@click.command('schema')
@click.option('--path', 'path_only', is_flag=True, help='Print the path of the schema file.')
@click.option('--matrix', is_flag=True, help='Print the schema of the files of check --matrix.')
@click.option('--scenarios', is_flag=True, help='Print the schema of scenario files.')
def schema_command(*, path_only: bool, matrix: bool, scenarios: bool) -> int:
    """Print the JSON Schema of system files, for editors."""
    from composer.cli.showing.editors import print_schema

    refuse_together({'--path': path_only, '--matrix': matrix})
    return print_schema(path_only=path_only, matrix=matrix, scenarios=scenarios)


@click.command('stubs', context_settings=NUMBERS_ARE_VALUES)
@takes_system
@click.option(
    '--output',
    '-o',
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
    from composer.cli.showing.editors import write_stubs

    return write_stubs(read_words(words), set_values, output)


COMMANDS = (show_command, page_command, graph_command, schema_command, stubs_command)
