"""Text for terminals and logs: its colours, and its control characters.

What a file, a message, the ROS graph or the name of a file contributes to it may hold anything.
Shown as it is, it could clear the screen, or look like a line that Composer wrote.
"""

from __future__ import annotations

import os
import re
import select
import stat
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rclpy.impl.rcutils_logger import RcutilsLogger

_INDENT = '  '
_LINE_END = re.compile(r'\r?\n|\r')
_COLOUR = re.compile(r'(\x1b\[[0-9;:]{0,40}m)')
_RESET = '\x1b[0m'
_RESETS = (_RESET, '\x1b[m')


def escape(text: str) -> str:
    r"""Return a text on one line, without characters that are not printable.

    Control characters, bidirectional overrides and line separators become escapes, as in `\x1b`.
    """
    if text.isprintable():
        return text
    return ''.join(
        character if character.isprintable() else character.encode('unicode_escape').decode()
        for character in text
    )


def escape_lines(text: str) -> str:
    """Return a text of several lines for a log: escaped, and with all but the first indented.

    So no text that is quoted in it can begin a line, which would look like an entry of its own.
    """
    return _indented(map(escape, text.split('\n')))


def escape_log(text: str) -> str:
    """Return a text as `escape_lines` does, in which tabs and colours (SGR) stay."""
    return text if text.isprintable() else _indented(map(_escape_coloured, text.split('\n')))


def _indented(lines: Iterable[str]) -> str:
    first, *others = lines
    return '\n'.join([first, *(f'{_INDENT}{line}' if line else '' for line in others)])


def escape_output(text: str) -> str:
    r"""Return what another program has written, of one or more lines, as `escape` does.

    Tabs and colours (SGR) stay, up to the end of their line. A carriage return ends a line: what
    comes after it would hide the beginning. Nothing but colours is obeyed by a terminal: not its
    title, nor its clipboard (OSC 52).
    """
    return '\n'.join(map(_escape_coloured, _LINE_END.split(text)))


def _escape_coloured(line: str) -> str:
    if line.isprintable():
        return line
    # Text, and colours between it.
    parts = _COLOUR.split(line)
    parts[::2] = ('\t'.join(map(escape, part.split('\t'))) for part in parts[::2])
    is_coloured = len(parts) > 1 and parts[-2] not in _RESETS
    return ''.join([*parts, _RESET if is_coloured else ''])


class EscapingLogger:
    """A ROS logger for texts that quote what others have written.

    A logger of rclpy accepts one level from each line of code, so each level has its own.
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self.name: str = logger.name
        self._logger = logger

    def info(self, text: str) -> None:
        """Log what happened."""
        self._logger.info(escape_lines(text))

    def warning(self, text: str) -> None:
        """Log what may be wrong."""
        self._logger.warning(escape_lines(text))

    def error(self, text: str) -> None:
        """Log what is wrong."""
        self._logger.error(escape_lines(text))


def is_output_unread() -> bool:
    """Return whether standard output or error is a pipe whose reader has gone, as `head` does."""
    poll = select.poll()
    for descriptor in (1, 2):
        with suppress(OSError):
            # Of other kinds, as sockets of a journal, readers may come back.
            if stat.S_ISFIFO(os.fstat(descriptor).st_mode):
                poll.register(descriptor, 0)
    return any(event & select.POLLERR for _, event in poll.poll(0))


def colour_of(environment: Mapping[str, str]) -> bool | None:
    """Return whether environment variables ask for colours; `None` if they say nothing.

    Source: https://no-color.org, https://force-color.org
    """
    if environment.get('NO_COLOR'):
        return False
    if environment.get('FORCE_COLOR'):
        return True
    return False if environment.get('TERM') == 'dumb' else None
