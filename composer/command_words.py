"""What the words of a command line may be: files, values of arguments, rules, levels."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Sequence

_LOG_LEVEL = re.compile(r'([\w/.]+:=)?(debug|info|warn|error|fatal)', re.IGNORECASE)


def split_words(words: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Divide what a command line says into files and the arguments that follow them.

    The first word is a file, and so are those right after it that end in `.yaml` or `.yml`.
    """
    count = 1
    while count < len(words) and words[count].endswith(('.yaml', '.yml')):
        count += 1
    return [Path(word) for word in words[:count]], list(words[count:])


def check_log_levels(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the values of `--log-level`, as in `debug` and `talker:=debug`.

    Raises:
        click.BadParameter: One of them is no level.
    """
    for value in values:
        if not _LOG_LEVEL.fullmatch(value):
            message = f"'{value}' is no level: debug, info, warn, error, fatal, or NODE:=LEVEL"
            raise click.BadParameter(message)
    return values


def check_rules(
    _context: click.Context, _option: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Return the names of rules.

    Raises:
        click.BadParameter: No rule is called so.
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
    from composer.names import suggest
    from composer.rules import RULES

    if name not in RULES:
        near = suggest(name, RULES)
        advice = f"did you mean '{near}'?" if near else "'composer explain' lists them"
        message = f"no rule is called '{name}'; {advice}"
        raise click.BadParameter(message)
