"""Timelines of systems: taken, and written to files."""

from __future__ import annotations

import json
import time
import zlib
from base64 import b64decode
from typing import IO, TYPE_CHECKING

import click

from composer.application.running_systems.client import STATUS_SEC, Client
from composer.application.running_systems.discovery import Discovery
from composer.errors import ComposerError
from composer.runtime.control import protocol
from composer.runtime.tracing.timeline import Timeline
from composer.runtime.tracing.tracer import TracePart

if TYPE_CHECKING:
    from collections.abc import Mapping

_READ_SEC = 60.0


def write_timeline(file: IO[str], parts: Mapping[str, TracePart]) -> None:
    """Write a timeline, and print its summary."""
    timeline = Timeline(parts)
    file.write(timeline.render())
    file.flush()
    where = f"written to '{file.name}': open it in https://ui.perfetto.dev"
    click.echo(f'{timeline.summarize()}\n{where}')


def trace(name: str | None, trace_sec: float, file: IO[str]) -> None:
    """Have a running system noted, and write its timeline.

    Args:
        name: Of the system; `None` for the only one.
        trace_sec: How long.

    Raises:
        ComposerError: There is no such system, it is traced already, or it ended.
        UsageError: There are several systems.
    """
    with Client() as client:
        system = Discovery(client).find(name)
        begun = client.ask(system, protocol.TRACE, STATUS_SEC)
        if not begun.succeeded:
            raise ComposerError(begun.text)
        try:
            time.sleep(trace_sec)
        finally:
            # Also if it is interrupted: else the system would go on to note.
            read = client.ask(system, protocol.TRACE_READ, _READ_SEC)
    if not read.succeeded:
        raise ComposerError(read.text)
    parts = json.loads(zlib.decompress(b64decode(read.text)))
    write_timeline(file, {worker: TracePart(*part) for worker, part in parts.items()})
