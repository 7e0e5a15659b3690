"""Text for terminals and logs: its colours, and its control characters.

What a file, a message, the ROS graph or the name of a file contributes to it may hold anything.
Shown as it is, it could clear the screen, or look like a line that Composer wrote.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rclpy.impl.rcutils_logger import RcutilsLogger

_INDENT = '  '


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
    first, *others = text.split('\n')
    lines = (f'{_INDENT}{escape(line)}' if line else '' for line in others)
    return '\n'.join([escape(first), *lines])


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


def colour_of(environment: Mapping[str, str]) -> bool | None:
    """Return whether environment variables ask for colours; `None` if they say nothing.

    Source: https://no-color.org, https://force-color.org
    """
    if environment.get('NO_COLOR'):
        return False
    if environment.get('FORCE_COLOR'):
        return True
    return False if environment.get('TERM') == 'dumb' else None
