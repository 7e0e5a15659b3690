"""Lines from a serial port; without a port, from a pseudo-terminal that this node writes to."""

from __future__ import annotations

import os
import tty
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer import Node


def open_port(node: Node) -> None:
    """Open the port, or a pseudo-terminal."""
    port = str(node.parameters.port)
    if port:
        node.state.port = os.open(port, os.O_RDWR | os.O_NOCTTY)
    else:
        node.state.device, node.state.port = os.openpty()
    tty.setraw(node.state.port)


def simulate(node: Node) -> None:
    """Write a line as a receiver would."""
    if node.state.device is not None:
        os.write(node.state.device, b'$GPGLL,4916.45,N,12311.12,W\n')


def read_lines(node: Node) -> Iterator[str]:
    """Yield each line, without its end."""
    received = b''
    while True:
        *lines, received = (received + os.read(node.state.port, 1024)).split(b'\n')
        for line in lines:
            yield line.decode(errors='replace').strip()


def end_read(node: Node) -> None:
    """Write something, so that who reads goes on."""
    if node.state.device is not None:
        os.write(node.state.device, b'\n')


def close_port(node: Node) -> None:
    """Close what was opened."""
    for descriptor in (node.state.device, node.state.port):
        if descriptor is not None:
            os.close(descriptor)
