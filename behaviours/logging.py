"""Log one line at each level."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Generator

    from composer import Node


def log_every_level(node: Node) -> Generator[None, None, None]:
    """Log one line at each level, then end the timer."""
    node.logger.debug('This is a debug message.')
    node.logger.info('This is an info message.')
    node.logger.warning('This is a warn message.')
    node.logger.error('This is an error message.')
    node.logger.fatal('This is a fatal message.')
    return
    yield
