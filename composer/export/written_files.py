"""Files that are written into a folder, and are known again: those of others stay as they are.

The first line of each has a checksum of what follows. A file without one was written by somebody
else, and one with another was edited since.
"""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.input_limits import read_file

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

_MARK = re.compile(rb"# Written by 'composer export \w+' \(([0-9a-f]{16})\)[^\n]*\n")


def mark(form: str, text: str) -> str:
    """Return a text with the line by which it is known."""
    return f"# Written by 'composer export {form}' ({_checksum(text.encode())})\n{text}"


def write_files(folder: Path, files: Mapping[str, str]) -> list[Path]:
    """Write texts that are marked into a folder, all or none; return their paths.

    Raises:
        ComposerError: A file is there that somebody else has written, or has edited; or it cannot
            be written.
    """
    paths = {folder / name: text for name, text in files.items()}
    try:
        for path in paths:
            _check(path)
        folder.mkdir(parents=True, exist_ok=True)
        for path, text in paths.items():
            path.write_text(text, encoding='utf-8')
    except (OSError, ValueError) as error:
        what = getattr(error, 'strerror', None) or error
        message = f'cannot write the files to {folder}: {what}'
        raise ComposerError(message) from error
    return [*paths]


def _check(path: Path) -> None:
    if not path.exists():
        return
    content = read_file(path)
    found = _MARK.match(content)
    if found and _checksum(content[found.end() :]).encode() == found[1]:
        return
    what = 'was edited since it was exported' if found else "was not written by 'composer export'"
    message = f'{path} {what}, and is not overwritten'
    raise ComposerError(message, help='remove it, or write to another folder')


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]
