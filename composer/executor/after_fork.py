"""What a forked child makes of its parent's executors: they are shut down, and out of reach.

An epoll, an eventfd or a kernel timer is one thing in both processes: what the child reads, sets
or unregisters there, the parent misses. So the child puts others of its own under the same numbers
(`lay_over`). The parent's threads are not in the child, but the locks that they held are: these
are made free. Nothing is destroyed, for that would be done by the middleware, whose threads and
locks are in the same state.

A child that was forked in a callback ends when that callback does.
"""

import os
import sys
import traceback
from contextlib import suppress
from typing import Any, NoReturn


def lay_over(descriptors: Any, fresh: int) -> None:
    """Let `descriptors` mean what `fresh` does."""
    for descriptor in descriptors:
        os.dup2(fresh, descriptor, inheritable=False)


def free_locks(owners: Any) -> None:
    """Free the locks that are attributes of `owners`, whichever thread held them."""
    for owner in owners:
        for value in vars(owner).values():
            # What the standard library's modules call in a child.
            with suppress(AttributeError):
                value._at_fork_reinit()  # noqa: SLF001


def end_child(error: BaseException | None = None) -> NoReturn:
    """End this process, the child, as Python would end a program.

    Args:
        error: What the callback raised that forked it.
    """
    code = 0
    # What the child did may have left anything broken; it must end all the same.
    with suppress(Exception):
        code = _exit_code(error)
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()
    os._exit(code & 0xFF)


def _exit_code(error: BaseException | None) -> int:
    """Return the exit code after an error, and show what is to be shown of it."""
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
