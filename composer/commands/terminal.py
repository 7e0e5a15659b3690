"""What the terminal takes."""

from __future__ import annotations

import os
import sys


def wants_colour(*, is_error: bool = False) -> bool:
    """Return whether standard output (or error) is a terminal, and nobody forbids colours.

    Source: https://no-color.org
    """
    stream = sys.stderr if is_error else sys.stdout
    return stream.isatty() and not os.environ.get('NO_COLOR') and os.environ.get('TERM') != 'dumb'
