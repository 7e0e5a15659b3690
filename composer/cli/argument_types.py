"""What the words of a command line may be: files, values of arguments, rules, levels."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from composer.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

_Command = TypeVar('_Command', bound='Callable[..., Any]')

# A number below zero is a value; `split_words` refuses what else begins like an option.
NUMBERS_ARE_VALUES = {'ignore_unknown_options': True}
_LOG_LEVEL = re.compile(r'([\w/.]+:=)?(debug|info|warn|error|fatal)', re.IGNORECASE)
# A minus before a digit or a dot belongs to a number.
_OPTION = re.compile(r'-[^\W\d]|--')


def takes_system(command: _Command) -> _Command:
    """Let a command take a file with layers and arguments as `words`, `--set` as `settings`."""
    setting = click.option(
        '--set',
        'settings',
        multiple=True,
        metavar='PATH=VALUE',
        help='Change a value, as in nodes.talker.log_level=debug; null removes it. '
        'May be repeated.',
    )
    metavar = 'FILE [LAYER]... [NAME:=VALUE]...'
    words = click.argument('words', nargs=-1, type=click.UNPROCESSED, metavar=metavar)
    return words(setting(command))


def split_words(words: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Divide what the present command takes into files and the arguments that follow them.

    The first word is a file, and so are those right after it that end in `.yaml` or `.yml`.

    Raises:
        click.UsageError: There is no file, or an option that the command does not have.
        UsageError: The first word is empty.
    """
    context = click.get_current_context()
    for word in words:
        if _OPTION.match(word):
            raise click.NoSuchOption(word, possibilities=_find_near(word, context), ctx=context)
    if not words:
        message = "Missing argument 'FILE'."
        raise click.UsageError(message, context)
    if not words[0]:
        message = 'an empty word names no file'
        raise UsageError(message, help='a variable of the shell may have no value')
    count = 1
    while count < len(words) and words[count].endswith(('.yaml', '.yml')):
        count += 1
    return [Path(word) for word in words[:count]], list(words[count:])


def refuse_together(given: Mapping[str, bool]) -> None:
    """Refuse two options that exclude each other.

    Args:
        given: Whether each of them was given, by how it is written.

    Raises:
        UsageError: More than one of them was.
    """
    chosen = [option for option, is_given in given.items() if is_given]
    if len(chosen) > 1:
        message = f'{" and ".join(chosen)} exclude each other'
        raise UsageError(message, help='take one of them')


def check_log_levels(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the values of `--log-level`, as in `debug` and `talker:=debug`.

    Raises:
        UsageError: One of them is no level.
    """
    for value in values:
        if not _LOG_LEVEL.fullmatch(value):
            message = f"'{value}' is no log level"
            raise UsageError(message, help='debug, info, warn, error or fatal, or NODE:=LEVEL')
    return values


def check_rules(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the names of rules.

    Raises:
        UsageError: No rule is called so.
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
        message = f"no rule is called '{name}'"
        advice = "'composer explain' lists them"
        raise UsageError(message, help=suggest(name, list_rule_names(), otherwise=advice))


def _find_near(word: str, context: click.Context) -> list[str]:
    """Return the option of a command that a word was most likely meant to be, if there is one."""
    from composer.spelling import find_nearest

    options = [option for each in context.command.get_params(context) for option in each.opts]
    near = find_nearest(word.partition('=')[0], options)
    return [near] if near else []
