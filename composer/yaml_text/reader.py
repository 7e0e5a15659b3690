"""YAML text → plain data, with the position of every key and value beside it."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from composer.diagnostics import Diagnostic, SourceFile
from composer.input_limits import (
    MAX_FILE_BYTES,
    MAX_LINES,
    UnreadableFileError,
    explain_missing,
    format_size,
    read_file,
)
from composer.yaml_text.document import Document
from composer.yaml_text.plain_data import construct_data
from composer.yaml_text.positions import SourceMap
from composer.yaml_text.tree import CompositionError, compose_tree

if TYPE_CHECKING:
    from pathlib import Path

# Of a launch file in Python or XML; in YAML, these begin no line.
_LAUNCH_CODE = ('def generate_launch_description(', '<launch>', '<launch ')


def read_document(path: Path, name: str | None = None) -> Document:
    """Read a file.

    Args:
        name: The name of the file in findings; by default `path`.
    """
    name = name or str(path)
    content = read_content(path, name)
    return (
        _without_data(content)
        if isinstance(content, Diagnostic)
        else parse_document(content, name)
    )


def read_content(path: Path, name: str) -> bytes | Diagnostic:
    """Return the content of a file, or why it cannot be read."""
    try:
        return read_file(path)
    except UnreadableFileError as error:
        is_missing = not os.path.lexists(path)
        return _unreadable(name, str(error), help=explain_missing(path) if is_missing else None)


def decode_content(content: bytes, name: str) -> str | Diagnostic:
    """Return the text of a file, or why it cannot be used: it must be UTF-8, and not too large."""
    if len(content) > MAX_FILE_BYTES:
        return _unreadable(name, f'the file is larger than {format_size(MAX_FILE_BYTES)}')
    if content.count(b'\n') + content.count(b'\r') > MAX_LINES:
        return _unreadable(name, f'the file has more than {MAX_LINES:,} lines')
    try:
        return content.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        line = content.count(b'\n', 0, error.start) + 1
        return _unreadable(
            name,
            f'the file is not UTF-8: byte {content[error.start]:#04x} in line {line}',
            help='save the file as UTF-8',
        )


def parse_document(content: bytes, name: str) -> Document:
    """Read the text of a file: UTF-8, one YAML document, a mapping at its top."""
    text = decode_content(content, name)
    if isinstance(text, Diagnostic):
        return _without_data(text)
    if is_launch_code(text):
        return _without_data(refuse_launch_file(name))
    positions = SourceMap(SourceFile(name, tuple(text.splitlines())))
    try:
        tree = compose_tree(text, positions.source)
        data, findings = construct_data(tree, positions)
    except CompositionError as error:
        return Document(None, positions, [error.diagnostic])
    if isinstance(data, dict):
        return Document(data, positions, [*findings])
    if tree is None:
        return _without_data(
            _unreadable(name, 'the file is empty', help="begin with 'version: 1'")
        )
    top = Diagnostic(
        'wrong-type',
        'a file must be a mapping with the keys version and nodes',
        name,
        tree.span,
        help="begin with 'version: 1'",
    )
    return Document(None, positions, [*findings, top])


def is_launch_code(text: str) -> bool:
    """Return whether a text is a launch file in Python or XML."""
    return any(f'\n{code}' in f'\n{text}' for code in _LAUNCH_CODE)


def refuse_launch_file(name: str) -> Diagnostic:
    """Return the finding for a launch file that is given as a system."""
    message = 'this is a launch file, and no system'
    return Diagnostic(
        'wrong-type', message, name, help=f"'composer import {name}' turns it into a system"
    )


def _unreadable(name: str, message: str, help: str | None = None) -> Diagnostic:  # noqa: A002
    return Diagnostic('unreadable-file', message, name, help=help)


def _without_data(finding: Diagnostic) -> Document:
    return Document(None, SourceMap(SourceFile(finding.file, ())), [finding])
