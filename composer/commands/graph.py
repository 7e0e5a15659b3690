"""`composer graph`: the system as people draw it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.checks import check_system, create_context
from composer.drawing import DEFAULT_FORMAT, format_of, render_picture
from composer.drawing.picture import build_picture
from composer.errors import ComposerError, ExitCode
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language import load_system
from composer.reports.text import render_finding, summarize

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def graph(
    paths: Sequence[Path],
    words: Sequence[str],
    settings: Sequence[str],
    *,
    format_name: str | None,
    output: Path | None,
) -> int:
    """Draw a system, with all that is wrong with it; return the exit code.

    Faults do not keep it from being drawn, unless nothing could be read.

    Args:
        format_name: One of `composer.drawing.FORMATS`; `None` to go by the ending of `output`.
        output: Where the drawing goes; `None` for standard output.

    Raises:
        DrawingError: The form needs Graphviz, and it is not there or fails.
        UsageError: The arguments or settings do not fit the file.
        ComposerError: The drawing cannot be written.
    """
    system = load_system(paths[0], words, layers=paths[1:], settings=settings)
    catalogue = InterfaceCatalogue()
    findings = check_system(system, catalogue)
    context, _ = create_context(system, catalogue)
    if context is None:
        for finding in findings:
            click.echo(render_finding(finding) + '\n', err=True)
        return ExitCode.FAILED
    usual = format_of(output.suffix) if output else DEFAULT_FORMAT
    text = render_picture(build_picture(context, findings), format_name or usual)
    _write(text, output)
    if findings:
        click.echo(f'{summarize(findings)}: they are in the drawing', err=True)
    return ExitCode.DONE


def _write(text: str, output: Path | None) -> None:
    if output is None:
        click.echo(text, nl=False, color=False)
        return
    try:
        output.write_text(text, encoding='utf-8', errors='backslashreplace')
    except OSError as error:
        message = f'cannot write the drawing to {output}: {error.strerror}'
        raise ComposerError(message) from error
