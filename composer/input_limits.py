"""How large input may be, and the one way to read a file that may be anything.

What is allowed is several times what large systems have, and takes seconds at most.
`docs/checking.md` lists the limits.
"""

from __future__ import annotations

import os
import stat
from typing import TYPE_CHECKING

from composer.errors import ComposerError
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from pathlib import Path

# Of a system, a parameter file or a type description. A thousand nodes with five thousand entities
# take one megabyte.
MAX_FILE_BYTES = 10_000_000
MAX_LINES = 1_000_000
# Keys and values of a file, with what its aliases stand for: five times those of such a system.
MAX_VALUES = 300_000
# Levels of data, aliases and merges; the walks over the data are safe from deep recursion by it.
MAX_DEPTH = 100
# Files that include each other, one in the other.
# Each is a check of the whole system.
MAX_COMBINATIONS = 100
MAX_INCLUDE_DEPTH = 30
# The entries of each of nodes, include and processes, unless a file says more.
MAX_ENTRIES = 10_000
# Nobody reads more findings of a file.
MAX_FINDINGS = 1000
# Of a .msg, .srv or .action file, and of all of a package.
MAX_DEFINITION_BYTES = 100_000
MAX_PACKAGE_BYTES = 2_000_000
# Of a Python module: its words and signs are what its syntax tree grows with. Real code has nine
# in a line, so that this is 20,000 lines; the modules of a system may have more together.
MAX_MODULE_BYTES = 2_000_000
MAX_MODULE_TOKENS = 200_000
MAX_TOKENS_OF_MODULES = 500_000

_YAML = ('.yaml', '.yml')
_KINDS = {
    stat.S_IFIFO: 'a named pipe',
    stat.S_IFSOCK: 'a socket',
    stat.S_IFCHR: 'a device',
    stat.S_IFBLK: 'a device',
}


class UnreadableFileError(ComposerError):
    """A file does not exist, cannot be read, is no regular file, or is too large.

    Attributes:
        is_too_large: Whether only its size is the reason.
    """

    is_too_large = False


class FileTooLargeError(UnreadableFileError):
    """A file is larger than what is read."""

    is_too_large = True


def read_file(path: Path, limit: int = MAX_FILE_BYTES) -> bytes:
    """Return the content of a regular file; nothing is read of what could block or has no end.

    Args:
        limit: The largest size, in bytes.

    Raises:
        UnreadableFileError: Why it cannot be read.
    """
    try:
        kind = _KINDS.get(stat.S_IFMT(path.stat().st_mode))
        if kind:
            message = f'cannot read the file: it is {kind}, not a regular file'
            raise UnreadableFileError(message)
        with open(path, 'rb', opener=_open_without_waiting) as file:
            if os.fstat(file.fileno()).st_size > limit:
                raise _too_large(limit)
            # Files of the kernel say that they are empty.
            content = file.read(limit + 1) or b''
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        message = f'cannot read the file: {reason}'
        raise UnreadableFileError(message) from error
    if len(content) > limit:
        raise _too_large(limit)
    return content


def explain_missing(path: Path) -> str | None:
    """Return the help for a path that does not exist: the nearest one, or what is there."""
    lineage = [path, *path.parents]
    found = next((i for i, at in enumerate(lineage) if os.path.isdir(at)), 0)  # noqa: PTH112
    folder, missing = lineage[found], lineage[found - 1]
    try:
        entries = sorted(folder.iterdir()) if found else []
    except OSError:
        return None
    entries = [each for each in entries if not each.name.startswith('.')]
    if missing != path:
        folders = {each.name: each for each in entries if each.is_dir()}
        if near := find_nearest(missing.name, folders):
            return did_you_mean(str(folders[near] / path.relative_to(missing)))
        return suggest(missing.name, folders, f"the folders in '{folder}' are")
    inside = next((each / path.name for each in entries if (each / path.name).is_file()), None)
    if inside:
        return did_you_mean(str(inside))
    # All have the same suffix, which makes them no more alike.
    files = {each.stem: each for each in entries if each.suffix in _YAML}
    if near := find_nearest(path.stem, files):
        return did_you_mean(str(files[near]))
    names = [each.name for each in files.values()]
    return suggest('', names, f"in '{folder}' there are")


def format_size(size: int) -> str:
    """Return a number of bytes as people write it."""
    return f'{size / 1e6:g} MB' if size >= 1e6 else f'{size / 1e3:g} kB'  # noqa: PLR2004


def _open_without_waiting(path: str, flags: int) -> int:
    # It may have become a pipe since its kind was read.
    return os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)


def _too_large(limit: int) -> FileTooLargeError:
    return FileTooLargeError(f'the file is larger than {format_size(limit)}')
