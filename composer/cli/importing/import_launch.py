"""`composer import`: print or write the system that a launch file is."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.errors import ComposerError, ExitCode, UsageError
from composer.launch_files.importing import import_file
from composer.launch_files.system_file import render_system

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.launch_files.system_file import SystemFile

_ENDINGS = ('.py', '.xml', '.yaml', '.yml')


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
    given = _read_words(words)
    if path.suffix not in _ENDINGS:
        message = f"'{path}' is no launch file: it ends with none of {', '.join(_ENDINGS)}"
        raise UsageError(message)
    if not path.is_file():
        message = f"there is no file '{path}'"
        raise ComposerError(message)
    stem = output.stem if output else path.name.partition('.')[0]
    imported = import_file(path, given)
    # Not `resolve`: launch leaves links in its paths.
    folder = str(output.parent.absolute()) if output else None
    system = render_system(imported, path.name, stem, folder)
    if output is not None:
        for written in _write(system, output):
            click.echo(f'wrote {written}', err=True)
    elif not verifies:
        click.echo(system.text, nl=False)
        if system.files:
            names = ', '.join(system.files)
            click.echo(f'{names}: parameter files of the system; -o writes them, too', err=True)
    if not verifies:
        return ExitCode.DONE
    from composer.cli.importing.verification import verify, without_components

    with tempfile.TemporaryDirectory(prefix='composer-import-') as folder:
        copy = Path(folder) / f'{stem}.yaml'
        list(_write(render_system(without_components(imported), path.name, stem), copy))
        return verify(path, given, imported, copy)


def _read_words(words: Sequence[str]) -> dict[str, str]:
    given = {}
    for word in words:
        name, separator, value = word.partition(':=')
        if not separator or not name:
            message = f"'{word}' is no argument of a launch file"
            raise UsageError(message, help='write NAME:=VALUE')
        given[name] = value
    return given


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
