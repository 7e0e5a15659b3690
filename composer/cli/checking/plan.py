"""`composer plan`: show what an edit would do to a running system."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.application.output import show_findings, wants_colour
from composer.application.plan import plan as find_plan
from composer.errors import ExitCode
from composer.planning import json_document, text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def plan(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    *,
    layers: Sequence[Path],
    host: str = '',
    format_name: str,
    tells_difference: bool,
) -> int:
    """Print what turns one system into another; return the exit code.

    Args:
        paths: See `composer.application.plan`, as for what is not listed here.
        format_name: `text` or `json`.
        tells_difference: Whether the exit code is 2 if there is any.
    """
    result, findings = find_plan(paths, words, set_values, layers=layers, host=host)
    show_findings(findings)
    if result is None:
        return ExitCode.FAILED
    if format_name == 'json':
        click.echo(json_document.render_plan(result), nl=False, color=False)
    else:
        colour = wants_colour()
        click.echo(text.render_plan(result, colour=colour), nl=False, color=colour)
    return ExitCode.USAGE if result and tells_difference else ExitCode.DONE
