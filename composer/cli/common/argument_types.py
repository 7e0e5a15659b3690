"""Parse and check the parameters of commands: files, arguments, rules, log levels."""

from __future__ import annotations

import glob
import os
import re
import shlex
from typing import TYPE_CHECKING, Any, TypeVar

import click

from composer.errors import UsageError
from composer.foxglove import BridgeOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from click.shell_completion import CompletionItem

_Command = TypeVar('_Command', bound='Callable[..., Any]')

# Negative numbers are values; `split_words` refuses everything else that starts with a dash.
NUMBERS_ARE_VALUES = {'ignore_unknown_options': True}
_LOG_LEVEL = re.compile(r'([\w/.]+:=)?(debug|info|warn|error|fatal)', re.IGNORECASE)
# A dash before a digit or a dot starts a number.
# What rcl takes, and Composer only after --ros-args.
_OF_ROS = frozenset(('-p', '-r', '--param', '--params-file', '--remap', '--log-config-file'))
_OPTION = re.compile(r'-[^\W\d]|--')


def takes_system(command: _Command) -> _Command:
    """Add the file, layers and arguments (`words`) and `--set` (`set_values`) to a command."""
    metavar = '[PACKAGE] FILE [LAYER]... [NAME:=VALUE]...'
    return takes_words(metavar)(takes_settings(command))


def takes_words(metavar: str, *, required: bool = False) -> Callable[[_Command], _Command]:
    """Add words to a command, the first of which name files, or files of packages."""
    return click.argument(
        'words',
        nargs=-1,
        type=click.UNPROCESSED,
        metavar=metavar,
        required=required,
        shell_complete=_complete_words,
    )


def _complete_words(
    context: click.Context, _argument: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Return what the shell completes a word to: files, packages, and systems of these."""
    from click.shell_completion import CompletionItem

    from composer.application.package_files import complete_file

    names = complete_file(context.params.get('words') or (), incomplete)
    # The shell would offer the names alone, or files alone.
    files = glob.glob(f'{glob.escape(incomplete)}*') if names else ()  # noqa: PTH207 - keeps ./
    offered = [*names, *(f'{file}/' if os.path.isdir(file) else file for file in files)]
    return [*map(CompletionItem, offered)] or [CompletionItem(incomplete, type='file')]


def takes_settings(command: _Command) -> _Command:
    """Add `--set` (`set_values`) to a command."""
    set_option = click.option(
        '--set',
        'set_values',
        multiple=True,
        metavar='PATH=VALUE',
        help='Change a value, as in nodes.talker.log_level=debug; null removes it. '
        'Can be repeated.',
    )
    return set_option(command)


def takes_host(command: _Command) -> _Command:
    """Add `--host` to a command."""
    host_option = click.option(
        '--host',
        metavar='NAME',
        default='',
        help='Only the part that this host runs, of a system for several.',
    )
    return host_option(command)


def takes_topics(command: _Command) -> _Command:
    """Add `--topics` to a command."""
    topics_option = click.option(
        '--topics',
        multiple=True,
        metavar='PATTERN',
        help="Only topics of these names; '*' stands for any characters, as in '/camera/*'. "
        'Can be repeated.',
    )
    return topics_option(command)


def takes_format(
    names: Sequence[str] = ('text', 'json'), what: str = 'The output format.'
) -> Callable[[_Command], _Command]:
    """Add `--format` (`format_name`) to a command; the first one is the default."""
    return click.option(
        '--format',
        'format_name',
        type=click.Choice(names),
        default=names[0],
        show_default=True,
        help=what,
    )


def split_words(words: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Split the words of the current command into files and the arguments that follow them.

    Raises:
        click.UsageError: There is no file, or an unknown option.
        UsageError: The first word is empty, or a folder, or no file of its package.
    """
    from composer.application import file_selection

    return file_selection.split_words(read_words(words))


def read_words(words: Sequence[str]) -> list[str]:
    """Return words with paths for the files of packages, if none is meant for an option.

    Raises:
        click.UsageError: There is none, or an unknown option.
        UsageError: The first word names a package, and this or its file is not there.
    """
    from composer.application.package_files import resolve_words

    resolved = resolve_words(words)
    refuse_options(resolved)
    return resolved


def refuse_options(words: Sequence[str]) -> None:
    """Check that there are words, and that none of them is meant for an option.

    Raises:
        click.UsageError: There is none, or an unknown option.
    """
    context = click.get_current_context()
    for index, word in enumerate(words):
        if _OPTION.match(word):
            _refuse_argument(words, index)
            if word in _OF_ROS:
                message = f"no such option '{word}': ROS arguments follow --ros-args"
                given = shlex.join(words[index : index + 2])
                raise UsageError(message, help=f"write '--ros-args {given}'")
            raise click.NoSuchOption(word, possibilities=_find_near(word, context), ctx=context)
    if not words:
        message = "Missing argument 'FILE'."
        raise click.UsageError(message, context)


def _refuse_argument(words: Sequence[str], index: int) -> None:
    """Check that an unknown option is no argument that the file declares."""
    from pathlib import Path

    from composer.language.arguments import parse_declarations
    from composer.yaml_text.reader import read_document

    name, is_given, value = words[index].lstrip('-').partition('=')
    if index and name in parse_declarations(read_document(Path(words[0])).data or {}):
        value = value if is_given else ''.join(words[index + 1 : index + 2]) or 'VALUE'
        message = f"no such option '{words[index]}': '{name}' is an argument of the file"
        raise UsageError(message, help=f"write '{name}:={value}'")


def refuse_together(given: Mapping[str, bool]) -> None:
    """Check that at most one of several options was given.

    Args:
        given: Whether each option was given, by the option as the user writes it.

    Raises:
        UsageError: More than one was given.
    """
    chosen = [option for option, is_given in given.items() if is_given]
    if len(chosen) > 1:
        message = f'{" and ".join(chosen)} cannot be used together'
        raise UsageError(message, help='choose one of them')


def check_log_levels(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the values of `--log-level`, as in `debug` and `talker:=debug`.

    Raises:
        UsageError: One of them is not a log level.
    """
    for value in values:
        if not _LOG_LEVEL.fullmatch(value):
            message = f"'{value}' is not a log level"
            raise UsageError(message, help='use debug, info, warn, error or fatal, or NODE:=LEVEL')
    return values


def check_rules(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the names of rules.

    Raises:
        UsageError: There is no such rule.
    """
    for value in values:
        _find_rule(value)
    return values


def check_rule(
    _context: click.Context, _argument: click.Parameter, value: str | None
) -> str | None:
    """Return the name of a rule, or `None` if there is none; see `check_rules`."""
    if value is not None:
        _find_rule(value)
    return value


def _find_rule(name: str) -> None:
    from composer.rules import list_rule_names
    from composer.spelling import suggest

    if name not in list_rule_names():
        message = f"there is no rule '{name}'"
        advice = "'composer explain' lists them"
        raise UsageError(message, help=suggest(name, list_rule_names(), otherwise=advice))


def _find_near(word: str, context: click.Context) -> list[str]:
    """Return the option of a command that a misspelt word most likely meant, if any."""
    from composer.spelling import find_nearest

    options = [option for each in context.command.get_params(context) for option in each.opts]
    near = find_nearest(word.partition('=')[0], options)
    return [near] if near else []


FOXGLOVE_PORT = 8765
LAST_PORT = 65_535


def takes_bridge(command: _Command) -> _Command:
    """Add how Foxglove is served (`address`, `allows_changes`) to a command."""
    changes = click.option(
        '--allow-changes',
        'allows_changes',
        is_flag=True,
        help='Let Foxglove publish, call services and set parameters.',
    )
    listen = click.option(
        '--listen',
        'address',
        metavar='ADDRESS',
        help='Let Foxglove connect from elsewhere, as 0.0.0.0 does. Default: 127.0.0.1.',
    )
    return listen(changes(command))


def bridge_options(
    port: int | None, address: str | None, *, allows_changes: bool
) -> BridgeOptions | None:
    """Return how Foxglove is served; `None` without a port.

    Raises:
        UsageError: It is not served, but options say how.
    """
    if port is not None:
        return BridgeOptions(port, address or '127.0.0.1', allows_changes)
    if address or allows_changes:
        message = '--listen and --allow-changes are for --foxglove'
        raise UsageError(message, help='add it, as in --foxglove 8765')
    return None
