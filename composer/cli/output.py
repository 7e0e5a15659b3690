"""What commands have to say: to the terminal, and to the files that a command line names."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import click

from composer.errors import ComposerError
from composer.reports.text import render_finding

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from composer.diagnostics import Diagnostic


def wants_colour(*, is_error: bool = False) -> bool:
    """Return whether standard output (or error) is a terminal, and nobody forbids colours.

    Source: https://no-color.org
    """
    stream = sys.stderr if is_error else sys.stdout
    return stream.isatty() and not os.environ.get('NO_COLOR') and os.environ.get('TERM') != 'dumb'


def show_findings(findings: Iterable[Diagnostic]) -> None:
    """Show findings on standard error, which leaves standard output to what was asked for."""
    colour = wants_colour(is_error=True)
    for finding in findings:
        click.echo(render_finding(finding, colour=colour) + '\n', err=True, color=colour)


def write_file(path: Path, text: str, what: str) -> None:
    """Write what a command has made to the file of `--output`.

    Args:
        what: What it is, for the message if it cannot be written: `the report`.

    Raises:
        ComposerError: It cannot be written.
    """
    try:
        path.write_text(text, encoding='utf-8', errors='backslashreplace')
    except OSError as error:
        message = f'cannot write {what} to {path}: {error.strerror}'
        raise ComposerError(message) from error
