"""`composer plan`: show what an edit would do to a running system."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer import confidential
from composer.checks.checker import check_in_context, create_context
from composer.cli.common.file_selection import load_given
from composer.cli.common.output import show_findings, wants_colour
from composer.diagnostics import has_errors
from composer.errors import ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.planning import json_document, text
from composer.planning.differences import compare
from composer.planning.snapshot import take_snapshot

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.planning.snapshot import Snapshot


def plan(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    *,
    layers: Sequence[Path],
    format_name: str,
    tells_difference: bool,
) -> int:
    """Print what turns one system into another; return the exit code.

    Args:
        paths: The file of the old system, and that of the new one.
        words: Values for the arguments that both files declare.
        set_values: Values to change in both.
        layers: Files that change both.
        format_name: `text` or `json`.
        tells_difference: Whether the exit code is 2 if there is any.

    Raises:
        UsageError: There are not two files, or the arguments or `--set` do not fit them.
    """
    if len(paths) != 2:  # noqa: PLR2004
        message = f'a plan compares two files, not {len(paths)}'
        raise UsageError(message, help='give layers with --layer')
    snapshots = []
    hidden: dict[str, str] = {}
    for path in paths:
        snapshots.append(_read([path, *layers], words, set_values))
        hidden |= confidential.hidden_values()
    confidential.hide_again(hidden)
    old, new = snapshots
    if old is None or new is None:
        return ExitCode.FAILED
    result = compare(old, new)
    if format_name == 'json':
        click.echo(json_document.render_plan(result), nl=False, color=False)
    else:
        colour = wants_colour()
        click.echo(text.render_plan(result, colour=colour), nl=False, color=colour)
    return ExitCode.USAGE if result and tells_difference else ExitCode.DONE


def _read(
    paths: Sequence[Path], words: Sequence[str], set_values: Sequence[str]
) -> Snapshot | None:
    """Return the snapshot of a system; without one, its errors have been printed."""
    system = load_given(paths, words, set_values)
    context = create_context(system, InterfaceCatalogue())
    findings = check_in_context(system, context)
    show_findings(findings)
    if has_errors(findings) or context is None:
        return None
    return take_snapshot(context)
