"""`composer import`: print or write the system that a launch file is."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.checks.checker import check_system
from composer.diagnostics import errors_first
from composer.errors import ComposerError, ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.launch_files.importing import import_file, read_words
from composer.launch_files.system_file import render_system
from composer.reports.text import render_finding
from composer.rules import Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.launch_files.system_file import SystemFile

_ENDINGS = ('.py', '.xml', '.yaml', '.yml', '.launch')
_OF_INSTALLATION = (
    'missing-package',
    'uninstalled-package',
    'unknown-executable',
    'missing-launch-file',
)


def import_launch_file(
    path: Path, words: Sequence[str], output: Path | None, *, verifies: bool
) -> int:
    """Import a launch file; return the exit code.

    Args:
        words: The arguments, `name:=value`.
        output: Where the system is written; `None` to print it.
        verifies: Whether both are run and compared; without an output, nothing is printed then.

    Raises:
        UsageError: The arguments are not of that form, or it is no launch file.
        ComposerError: It cannot be imported, or the output cannot be written.
    """
    given = read_words(words)
    if path.suffix not in _ENDINGS:
        message = f"'{path}' is no launch file: it ends with none of {', '.join(_ENDINGS)}"
        raise UsageError(message)
    if not os.path.isfile(path):
        message = f"there is no file '{path}'"
        raise ComposerError(message)
    stem = output.stem if output else path.name.partition('.')[0]
    imported = import_file(path, given)
    system = render_system(imported, path, output)
    if output is not None:
        for written in _write(system, output):
            click.echo(f'wrote {written}', err=True)
    elif not verifies:
        click.echo(system.text, nl=False)
        if system.files:
            names = ', '.join(system.files)
            click.echo(f'{names}: parameter files of the system; -o writes them, too', err=True)
    arguments = imported.words()
    with tempfile.TemporaryDirectory(prefix='composer-import-') as temporary:
        checked = output or Path(temporary) / f'{stem}.yaml'
        if output is None:
            list(_write(system, checked))
        is_refused = check_imported(checked, arguments)
        if is_refused or not verifies:
            return ExitCode.FAILED if is_refused else ExitCode.DONE
        from composer.application.importing.verification import verify, without_launch_files

        copy = Path(temporary) / 'plain' / f'{stem}.yaml'
        list(_write(render_system(without_launch_files(imported), path), copy))
        return verify(path, arguments, imported, copy)


def check_imported(path: Path, words: Sequence[str]) -> bool:
    """Print the errors of a system that was written; return whether there are any."""
    system = load_system(path, words)
    found = errors_first(check_system(system, InterfaceCatalogue()))
    # What is not installed here, `ros2 launch` does not find either.
    errors = [
        each
        for each in found
        if each.severity is Severity.ERROR and each.rule not in _OF_INSTALLATION
    ]
    for each in errors:
        click.echo(f'{render_finding(each)}\n', err=True)
    if errors:
        click.echo('the system that was imported has errors', err=True)
    return bool(errors)


def _write(system: SystemFile, output: Path) -> Iterator[Path]:
    """Write a system and its parameter files; yield their paths."""
    written = {output: system.text}
    written |= {output.parent / name: text for name, text in system.files.items()}
    for path, text in written.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding='utf-8')
        except OSError as error:
            message = f'cannot write {path}: {error.strerror}'
            raise ComposerError(message) from error
        yield path
