"""`composer check`: say all that is wrong with files."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from composer.checks import check_system
from composer.diagnostics import has_errors
from composer.errors import ExitCode
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language import load_system
from composer.reports.text import render_finding

if TYPE_CHECKING:
    from pathlib import Path

    from composer.diagnostics import Diagnostic


def check(paths: tuple[Path, ...]) -> int:
    """Check files and print what was found; return the exit code."""
    catalogue = InterfaceCatalogue()
    found: list[Diagnostic] = []
    for path in paths:
        system = load_system(path)
        findings = check_system(system, catalogue)
        for finding in findings:
            click.echo(render_finding(finding) + '\n')
        if not findings and system.spec:
            click.echo(f'{path}: ok, {count(len(system.spec.nodes), "node")}')
        found += findings
    if not catalogue.available:
        click.echo('not checked without ROS 2: interface types and the fields of messages')
    if found:
        faulty = len({finding.file for finding in found})
        click.echo(f'{count(len(found), "fault")} in {count(faulty, "file")}', file=sys.stderr)
    return ExitCode.FAILED if has_errors(found) else ExitCode.DONE


def count(number: int, noun: str) -> str:
    """Return `1 node`, `2 nodes`."""
    return f'{number} {noun}' if number == 1 else f'{number} {noun}s'
