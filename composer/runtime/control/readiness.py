"""Tells who started this process that the system is up, as systemd's services do.

`systemd` does it for `Type=notify`, and `composer up --detach` for its child.
Source: https://www.freedesktop.org/software/systemd/man/latest/sd_notify.html
"""

from __future__ import annotations

import os
import socket
from contextlib import suppress

VARIABLE = 'NOTIFY_SOCKET'


def take_notify_socket() -> str | None:
    """Return the socket to notify; the processes that this one starts do not inherit it."""
    return os.environ.pop(VARIABLE, None)


def is_service() -> bool:
    """Return whether this is the main process of a service of systemd.

    That kills whatever is left of a service when its main process has ended, and the main process
    if it does not end.
    Source: https://www.freedesktop.org/software/systemd/man/latest/systemd.exec.html
    """
    return os.environ.get('SYSTEMD_EXEC_PID') == str(os.getpid())


def notify(address: str | None, state: str) -> None:
    """Tell a state, as in `READY=1`; without an address, nothing."""
    if address:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender, suppress(OSError):
            sender.sendto(state.encode(), f'\0{address[1:]}' if address[0] == '@' else address)
