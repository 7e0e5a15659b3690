"""`composer graph`: draw a system."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.application.file_selection import load_given
from composer.application.launch_file import relocate
from composer.application.output import show_findings, write_file
from composer.checks.absent_packages import AbsentPackages
from composer.checks.checker import check_in_context, create_context
from composer.drawing import FORMATS, render_picture
from composer.drawing.picture import build_picture
from composer.errors import ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.reports.text import summarize

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def graph(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    *,
    format_name: str | None,
    output: Path | None,
) -> int:
    """Draw a system, with its errors and warnings marked; return the exit code.

    A system with errors is drawn too, unless nothing of it could be read.

    Args:
        format_name: One of `composer.drawing.FORMATS`; `None` to use the suffix of `output`.
        output: The file to write; `None` for standard output.

    Raises:
        UsageError: The arguments or `--set` do not fit the file, or no format has the suffix of
            `output`.
        ComposerError: The format needs Graphviz, which is missing or failed, or the drawing cannot
            be written.
    """
    format_name = format_name or _format_of(output)
    system = load_given(paths, words, set_values, is_shown=True)
    context = create_context(system, InterfaceCatalogue())
    findings = relocate(AbsentPackages().leave_out(check_in_context(system, context)))
    if context is None:
        show_findings(findings)
        return ExitCode.FAILED
    text = render_picture(build_picture(context, findings), format_name)
    if output is None:
        click.echo(text, nl=False, color=False)
    else:
        write_file(output, text, 'the drawing')
    if findings:
        click.echo(f'{summarize(findings)}, marked in the drawing', err=True)
    return ExitCode.DONE


def _format_of(output: Path | None) -> str:
    suffix = output.suffix if output else ''
    name = next((name for name, known in FORMATS.items() if suffix.lower() in known), None)
    if name is None:
        message = f"no format has the suffix '{suffix}'"
        raise UsageError(message, help=f'choose one with --format: {", ".join(FORMATS)}')
    return name
