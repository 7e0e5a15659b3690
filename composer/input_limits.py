"""How large input may be, and the one way to read a file that may be anything.

What is allowed is several times what large systems have, and takes seconds at most.
`docs/checking.md` lists the limits.
"""

from __future__ import annotations

import os
import stat
from typing import IO, TYPE_CHECKING

from composer.errors import ComposerError
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from pathlib import Path

# Of a system, a parameter file or a type description. A thousand nodes with five thousand entities
# take one megabyte.
MAX_FILE_BYTES = 10_000_000
MAX_LINES = 1_000_000
# Keys and values of a file, with what its aliases stand for; also of all that a system includes,
# and of all its parameter files together: nearly three times those of such a system.
MAX_VALUES = 150_000
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
# Of a .msg, .srv or .action file, and of all in the packages of a system; a file counts as some
# lines more. All packages of ROS's common interfaces together have 200 files and 1,200 fields.
MAX_DEFINITION_BYTES = 100_000
MAX_BYTES_OF_DEFINITIONS = 2_000_000
MAX_LINES_OF_DEFINITIONS = 40_000
LINES_OF_DEFINITION = 5
# Of a Python module: its words and signs are what its syntax tree grows with. Real code has nine
# in a line, so that this is 10,000 lines; the modules of a system may have more together.
MAX_MODULE_BYTES = 2_000_000
MAX_MODULE_TOKENS = 100_000
MAX_TOKENS_OF_MODULES = 400_000
# Of a recording, an entry at once; and what a check reads to find its topics. Each number and
# text in it counts as some bytes more: a million of them take a second.
MAX_RECORDED_BYTES = 100_000_000
MAX_SCANNED_BYTES = 200_000_000
BYTES_OF_RECORDED_VALUE = 100
# What is built of its definitions: each takes a quarter of a second.
MAX_RECORDED_TYPES = 500

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
    with open_file(path) as file:
        if os.fstat(file.fileno()).st_size > limit:
            raise _too_large(limit)
        try:
            # Files of the kernel say that they are empty.
            content = file.read(limit + 1) or b''
        except OSError as error:
            raise _unreadable(error) from error
    if len(content) > limit:
        raise _too_large(limit)
    return content


def open_file(path: Path) -> IO[bytes]:
    """Open a regular file, without waiting for anything else that has its name.

    Raises:
        UnreadableFileError: It cannot be opened, or is no regular file.
    """
    try:
        kind = _KINDS.get(stat.S_IFMT(path.stat().st_mode))
        if kind:
            message = f'cannot read the file: it is {kind}, not a regular file'
            raise UnreadableFileError(message)
        return open(path, 'rb', opener=_open_without_waiting)
    except (OSError, ValueError) as error:
        raise _unreadable(error) from error


def explain_missing(
    path: Path, base: Path | None = None, *, is_folder: bool = False
) -> str | None:
    """Return the help for a path that does not exist: the nearest one, or what is there.

    Args:
        base: The folder that the path is written relative to; an absolute path stays absolute.
        is_folder: Whether a folder is missing, not a file.
    """

    def shown(found: Path) -> str:
        return str(found) if base is None else os.path.relpath(found, base)

    lineage = [path, *path.parents]
    found = next((i for i, at in enumerate(lineage) if os.path.isdir(at)), 0)
    folder, missing = lineage[found], lineage[found - 1]
    try:
        entries = sorted(folder.iterdir()) if found else []
    except OSError:
        return None
    entries = [each for each in entries if not each.name.startswith('.')]
    if missing != path:
        folders = {each.name: each for each in entries if os.path.isdir(each)}
        if near := find_nearest(missing.name, folders):
            return did_you_mean(shown(folders[near] / path.relative_to(missing)))
        return suggest('', folders, f"the folders in '{shown(folder)}' are")
    if is_folder:
        names = [shown(each) for each in entries if os.path.isdir(each)]
        return suggest(shown(path), names, 'there are')
    inside = next((each / path.name for each in entries if os.path.isfile(each / path.name)), None)
    if inside:
        return did_you_mean(shown(inside))
    # All have the same suffix, which makes them no more alike.
    suffixes = _YAML if path.suffix in ('', *_YAML) else (path.suffix,)
    files = {each.stem: each for each in entries if each.suffix in suffixes}
    if near := find_nearest(path.stem, files):
        return did_you_mean(shown(files[near]))
    names = [each.name for each in files.values()]
    where = shown(folder)
    return suggest('', names, 'there are' if where == '.' else f"in '{where}' there are")


def format_size(size: int) -> str:
    """Return a number of bytes as people write it."""
    return f'{size / 1e6:g} MB' if size >= 1e6 else f'{size / 1e3:g} kB'  # noqa: PLR2004


def _open_without_waiting(path: str, flags: int) -> int:
    # It may have become a pipe since its kind was read.
    return os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)


def _unreadable(error: Exception) -> UnreadableFileError:
    reason = (error.strerror if isinstance(error, OSError) else None) or error
    return UnreadableFileError(f'cannot read the file: {reason}')


def _too_large(limit: int) -> FileTooLargeError:
    return FileTooLargeError(f'the file is larger than {format_size(limit)}')
