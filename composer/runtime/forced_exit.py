"""Ends the process at once."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import NoReturn


def leave(code: int) -> NoReturn:
    """End the process with this exit code, whatever its threads do."""
    flush_output()
    os._exit(code)


def flush_output() -> None:
    """Write the buffers of standard output and error, if that is still possible."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()
