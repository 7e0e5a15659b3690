"""`composer page`: choose what is shown, and serve it."""

from __future__ import annotations

import os
import webbrowser
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from composer.errors import ExitCode, UsageError
from composer.page.server import PageServer
from composer.page.watched_system import DrawnFiles, WatchedSystem

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_LOOPBACK = ('127.0.0.1', 'localhost', '::1')


def serve(
    name: str | None,
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    *,
    port: int,
    listen: str,
    opens: bool,
) -> int:
    """Serve a page until a signal comes; return the exit code.

    Args:
        name: Of a running system, if there are no files; `None` for the only one.
        paths: A file and its layers.
        words: The arguments of the file.
        set_values: Of the file.
        port: 0 for any that is free.
        listen: The address; another one than this computer's own is refused.
        opens: Whether to open a browser, where there is a desktop.

    Raises:
        UsageError: The address is another one's, or the words fit no file.
        ComposerError: There is no such file, the port is taken, or the extra `page` is missing.
    """
    if listen not in _LOOPBACK:
        message = 'the page is served to this computer alone: it is not encrypted'
        advice = "ssh -L 8080:127.0.0.1:8080 HOST 'composer page --port 8080 --no-browser'"
        raise UsageError(message, help=f'tunnel it: {advice}')
    source: DrawnFiles | WatchedSystem
    source = DrawnFiles(paths, words, set_values) if paths else WatchedSystem(name)
    server = PageServer(source, port)
    click.echo(f'{server.address}\nCtrl-C ends it', err=True)
    if opens and (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
        with suppress(webbrowser.Error):
            webbrowser.open(server.address)
    server.run()
    return ExitCode.DONE
