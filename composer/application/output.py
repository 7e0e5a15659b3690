"""Output of commands: findings on the terminal, and the files named by `--output`."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from composer.errors import ComposerError
from composer.reports.text import render_finding
from composer.terminal import colour_of

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from composer.diagnostics import Diagnostic


def wants_colour(*, is_error: bool = False) -> bool:
    """Return whether standard output (or error) is to be coloured."""
    wanted = colour_of(os.environ)
    stream = sys.stderr if is_error else sys.stdout
    return stream.isatty() if wanted is None else wanted


def show_findings(findings: Iterable[Diagnostic]) -> None:
    """Print findings to standard error; standard output is for the result of the command."""
    colour = wants_colour(is_error=True)
    for finding in findings:
        click.echo(render_finding(finding, colour=colour) + '\n', err=True, color=colour)


def write_file(path: Path, text: str, what: str) -> None:
    """Write the result of a command to a file.

    Args:
        what: What it is, for the error message, as in `the report`.

    Raises:
        ComposerError: It cannot be written.
    """
    try:
        path.write_text(text, encoding='utf-8', errors='backslashreplace')
    except OSError as error:
        message = f'cannot write {what} to {path}: {error.strerror}'
        raise ComposerError(message) from error
