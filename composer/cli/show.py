"""`composer show`: the final system, with all that is included in it and nothing to evaluate."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import click

from composer.cli.output import show_findings
from composer.cli.show_comments import append_comments, find_kept_comments
from composer.diagnostics import has_errors
from composer.errors import ExitCode
from composer.language.arguments import describe_arguments
from composer.language.pipeline import load_system
from composer.yaml_text.writer import render_yaml

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath

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
    show_findings(system.diagnostics)
    if has_errors(system.diagnostics):
        return ExitCode.FAILED
    data = final_data(system)
    if output_format == 'json':
        click.echo(json.dumps(data, indent=2))
    else:
        remark = (lambda path: describe_origin(system, path)) if origins else None
        comments = find_kept_comments(system, render_yaml(data))
        click.echo(append_comments(render_yaml(data, remark), comments), nl=False)
    return ExitCode.DONE


def show_arguments(paths: Sequence[Path], settings: Sequence[str]) -> int:
    """Print the arguments that a file declares; return the exit code.

    Raises:
        UsageError: The settings do not fit the file.
    """
    system = load_system(paths[0], layers=paths[1:], settings=settings)
    show_findings(system.diagnostics)
    click.echo(describe_arguments(system.arguments))
    return ExitCode.FAILED if has_errors(system.diagnostics) else ExitCode.DONE


def final_data(system: LoadedSystem) -> dict[str, Any]:
    """Return a system as data that `composer up` accepts, wherever they are written to."""
    data = {
        key: value
        for key, value in system.entries.items()
        if key not in _SETTLED and not key.startswith('x-') and (value != {} or key == 'nodes')
    }
    return _with_absolute_paths(data)


def describe_origin(system: LoadedSystem, path: DataPath) -> str:
    """Return where a value was written, and where what its expressions use comes from."""
    if not path:
        return ''
    place = system.positions.value(path).place
    note = system.notes.get(path)
    return f'{place}, {note}' if note else place


def _with_absolute_paths(data: dict[str, Any]) -> dict[str, Any]:
    absolute = dict(data)
    if 'interfaces' in data:
        folders = data['interfaces'].items()
        absolute['interfaces'] = {package: _absolute(folder) for package, folder in folders}
    for section in ('nodes', 'processes'):
        if section in data:
            entries = data[section].items()
            absolute[section] = {name: _entry_with_absolute(entry) for name, entry in entries}
    return absolute


def _entry_with_absolute(entry: dict[str, Any]) -> dict[str, Any]:
    changed: dict[str, Any] = {}
    if 'cwd' in entry:
        changed['cwd'] = _absolute(entry['cwd'])
    if 'parameter_files' in entry:
        changed['parameter_files'] = [_absolute(text) for text in entry['parameter_files']]
    return entry | changed


def _absolute(path: str) -> str:
    # As written otherwise: links are not followed.
    return path if path.startswith('package://') else os.path.abspath(path)  # noqa: PTH100
