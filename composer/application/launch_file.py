"""A launch file as a system, without a file being written for it: what it says is checked.

Findings are about the launch file: the line of the action, where launch tells it.
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, SourceFile, Span
from composer.errors import UsageError
from composer.input_limits import UnreadableFileError, read_file
from composer.language.pipeline import load_system
from composer.launch_files.results import LaunchError
from composer.yaml_text.document import Document
from composer.yaml_text.positions import SourceMap
from composer.yaml_text.reader import is_launch_code, parse_document

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from composer.language.loaded_system import LoadedSystem
    from composer.launch_files.results import Origin
    from composer.launch_files.system_file import SystemFile
    from composer.yaml_text.positions import DataPath

LAUNCH_SUFFIXES = ('.py', '.xml', '.launch')
# The files that imports have written; they are gone when the process ends.
_folders: list[tempfile.TemporaryDirectory[str]] = []
_sources: dict[Path, SourceFile] = {}
# The actions that these files are for, by their paths.
_owners: dict[str, Span] = {}


def is_launch_file(path: Path) -> bool:
    """Return whether a file is one of launch: in Python, XML, or YAML with `launch:`."""
    if not os.path.isfile(path):
        return False
    if path.suffix in LAUNCH_SUFFIXES:
        return True
    try:
        text = read_file(path)
    except UnreadableFileError:
        return False  # reading it as a system will report the error
    if is_launch_code(text.decode(errors='replace')):
        return True
    # Only such a file is read twice.
    if b'launch' not in text:
        return False
    data = parse_document(text, str(path)).data or {}
    return 'version' not in data and isinstance(data.get('launch'), list)


def load_launch_file(
    path: Path, words: Sequence[str], layers: Sequence[Path], set_values: Sequence[str]
) -> LoadedSystem:
    """Return the system that a launch file is; it is run by the installed launch, as an import is.

    Args:
        words: Its arguments, `name:=value`.
        layers: Must be none, as values to set.

    Raises:
        UsageError: Layers or values are given, or words are no arguments.
        ComposerError: `launch` is not installed.
    """
    from composer.launch_files.importing import import_file, read_words
    from composer.launch_files.system_file import render_system

    if layers or set_values:
        message = f"'{path}' is a launch file: layers and --set are for systems"
        raise UsageError(message, help=f"'composer import {path} -o FILE' turns it into one")
    try:
        imported = import_file(path, read_words(words))
    except LaunchError as error:
        message = str(error).removeprefix(f'{path.absolute()}: ')
        finding = Diagnostic('unreadable-file', message, str(path), help=error.help)
        empty = Document(None, SourceMap(SourceFile(str(path), ())), [finding])
        return load_system(path, text=lambda: empty)
    system = render_system(imported, path)
    return load_system(path, imported.words(), text=_reader(system, path))


def _reader(system: SystemFile, path: Path) -> Callable[[], Document]:
    """Return what reads the system of a launch file, with the files beside it in a folder."""
    folder = tempfile.TemporaryDirectory(prefix='composer-launch-')
    _folders.append(folder)
    files = {name: os.path.join(folder.name, name) for name in system.files}  # noqa: PTH118
    for name, text in system.files.items():
        os.makedirs(os.path.dirname(files[name]), exist_ok=True)  # noqa: PTH103, PTH120
        with open(files[name], 'w', encoding='utf-8') as file:  # noqa: PTH123
            file.write(text)

    def read() -> Document:
        text = system.text.replace('{{ here }}', folder.name)
        document = parse_document(text.encode(), str(path))
        document.data = _with_files(document.data, files)
        positions = document.positions
        whole = Span(_source_of(path), 1, 1, 0)
        starts = sorted(system.origins)
        spans: dict[int, Span] = {}
        for found in (positions.keys, positions.values):
            for at, span in found.items():
                if span.line not in spans:
                    start = max((each for each in starts if each <= span.line), default=0)
                    spans[span.line] = _span_of(system.origins.get(start), whole)
                found[at] = spans[span.line]
        for at, span in positions.values.items():
            named = _value_at(document.data, at)
            if isinstance(named, str) and named.startswith(folder.name):
                _owners[named] = span
        return document

    return read


def relocate(findings: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return findings; those in files that imports have written, at the actions these are for."""
    return [
        replace(each, span=owner, file=owner.source.name)
        if each.span and (owner := _owners.get(each.span.source.name))
        else each
        for each in findings
    ]


def _value_at(data: Any, path: DataPath) -> Any:
    for key in path:
        data = data[key]
    return data


def _with_files(data: Any, files: dict[str, str]) -> Any:
    """Return data with the paths of the files that were written in place of their names."""
    if isinstance(data, dict):
        return {key: _with_files(value, files) for key, value in data.items()}
    if isinstance(data, list):
        return [_with_files(value, files) for value in data]
    return files.get(data, data) if isinstance(data, str) else data


def _span_of(origin: Origin | None, whole: Span) -> Span:
    """Return the line of an action; the file where nobody knows it."""
    if origin is None or not origin.line:
        return whole
    source = _source_of(origin.path)
    text = source.line(origin.line)
    indent = len(text) - len(text.lstrip())
    return Span(source, origin.line, indent + 1, max(1, len(text.strip())))


def _source_of(path: Path) -> SourceFile:
    if path not in _sources:
        shown = os.path.relpath(path) if path.is_absolute() else str(path)
        name = str(path) if shown.startswith('..') else shown
        lines = read_file(path).decode(errors='replace').splitlines()
        _sources[path] = SourceFile(name, tuple(lines))
    return _sources[path]
