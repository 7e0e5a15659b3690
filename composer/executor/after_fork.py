"""What a forked child does with the executors of its parent: it lets them be.

An epoll, an eventfd or a kernel timer is one thing in both processes: what the child reads, sets
or unregisters, the parent misses. So the child closes them, and puts a silent one under those
numbers to which the middleware writes (`replace_descriptors`). The parent's threads are not in the
child, but the locks that they held are, in the executor and in the middleware. So the child uses
nothing of them and destroys nothing: whoever wants to spin is refused (`RefusedSpinner`).

A child that was forked in a callback ends when that callback does.
"""

import os
import sys
import traceback
from collections.abc import Iterable
from contextlib import suppress
from typing import NoReturn

from composer.errors import ComposerError


def replace_descriptors(descriptors: Iterable[int], new: int) -> None:
    """Make `descriptors` duplicates of `new`."""
    for descriptor in descriptors:
        os.dup2(new, descriptor, inheritable=False)


class RefusedSpinner:
    """Stands in a forked child for what the executor of its parent spins with."""

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith('__'):
            raise AttributeError(name)
        message = 'a forked child cannot use an executor of its parent'
        raise ComposerError(message, help='create the executor in the child')


def end_child(error: BaseException | None = None) -> NoReturn:
    """End this process, a forked child, as Python ends a program.

    Args:
        error: What the callback that forked it raised.
    """
    code = 0
    # The child may have broken anything; it must end all the same.
    with suppress(Exception):
        code = _exit_code(error)
    flush_output()
    os._exit(code & 0xFF)


def flush_output() -> None:
    """Write the buffers of standard output and error, if that is still possible."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()


def _exit_code(error: BaseException | None) -> int:
    """Print `error` as Python does, and return the exit code that it leads to."""
    code = error.code if isinstance(error, SystemExit) else None
    if code is None and (error is None or isinstance(error, SystemExit)):
        return 0
    if isinstance(code, int):
        return code
    with suppress(Exception):
        if code is None:
            traceback.print_exception(error)
        else:
            print(code, file=sys.stderr)  # noqa: T201 (as Python does)
    return 1
