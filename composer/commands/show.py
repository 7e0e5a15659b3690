"""`composer show`: the final system, with all that is included in it and nothing to evaluate."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import click

from composer.diagnostics import has_errors
from composer.errors import ExitCode
from composer.language import LoadedSystem, load_system
from composer.language.arguments import describe_arguments
from composer.reports.text import render_finding
from composer.reports.yaml import render_yaml

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.language.positions import DataPath

# What is settled when a system is shown.
_SETTLED = ('args', 'max_nodes')


def show(
    paths: Sequence[Path],
    words: Sequence[str],
    settings: Sequence[str],
    *,
    output_format: str,
    origins: bool,
) -> int:
    """Print a system; return the exit code.

    Raises:
        UsageError: The arguments or settings do not fit the file.
    """
    system = load_system(paths[0], words, layers=paths[1:], settings=settings)
    for finding in system.diagnostics:
        click.echo(render_finding(finding) + '\n', err=True)
    if has_errors(system.diagnostics):
        return ExitCode.FAILED
    data = final_data(system)
    if output_format == 'json':
        click.echo(json.dumps(data, indent=2))
    else:
        remark = (lambda path: describe_origin(system, path)) if origins else None
        click.echo(render_yaml(data, remark), nl=False)
    return ExitCode.DONE


def show_arguments(paths: Sequence[Path]) -> int:
    """Print the arguments that a file declares; return the exit code."""
    system = load_system(paths[0], layers=paths[1:])
    for finding in system.diagnostics:
        click.echo(render_finding(finding) + '\n', err=True)
    click.echo(describe_arguments(system.arguments))
    return ExitCode.FAILED if has_errors(system.diagnostics) else ExitCode.DONE


def final_data(system: LoadedSystem) -> dict[str, Any]:
    """Return a system as data that `composer up` accepts, wherever they are written to."""
    data = {key: value for key, value in system.data.items() if key not in _SETTLED}
    data = {key: value for key, value in data.items() if value != {} or key == 'nodes'}
    if 'interfaces' in data:
        data['interfaces'] = {
            package: _absolute(system, ('interfaces', package), folder)
            for package, folder in data['interfaces'].items()
        }
    return data


def describe_origin(system: LoadedSystem, path: DataPath) -> str:
    """Return where a value was written, and where what its expressions use comes from."""
    if not path:
        return ''
    place = system.positions.value(path).place
    note = system.notes.get(path)
    return f'{place}, {note}' if note else place


def _absolute(system: LoadedSystem, path: DataPath, relative: str) -> str:
    folder = system.positions.value(path).source.folder
    return os.path.abspath(folder / relative)  # noqa: PTH100 - without following links
