"""`composer capture`: declarations of what runs on the ROS graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.application import capture as captures
from composer.application.output import write_file
from composer.errors import ExitCode
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def capture(nodes: Sequence[str], *, output: Path | None, timeout_sec: float) -> int:
    """Write what nodes on the ROS graph have; return the exit code.

    It is 1 if a node does not answer: what it did not say is missing.

    Args:
        nodes: See `composer.application.capture`, as for what is not listed here.
        output: The file to write; `None` for standard output.

    Raises:
        ComposerError: There is no such node, or the file cannot be written.
    """
    text, found = captures.capture(nodes, timeout_sec)
    if output is None:
        click.echo(text, nl=False, color=False)
    else:
        write_file(output, text, 'the declarations')
    for each in found:
        if each.problem:
            click.echo(escape(f"warning: node '{each.full_name}': {each.problem}"), err=True)
    return ExitCode.FAILED if any(each.is_silent for each in found) else ExitCode.DONE
