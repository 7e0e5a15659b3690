"""`composer page`: choose what is shown, and serve it."""

from __future__ import annotations

import os
import signal
import sys
import threading
import webbrowser
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from composer.errors import ComposerError, ExitCode, UsageError
from composer.page.watched_system import DrawnFiles, WatchedSystem
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_LOOPBACK = ('127.0.0.1', 'localhost', '::1')


@record
class PageOptions:
    """The options of a command line.

    Attributes:
        port: 0 for any that is free.
        listen: The address; another one than this computer's own is refused.
        opens: Whether to open a browser, where there is a desktop.
        allows_changes: Whether the page may change the system.
        editor: The address of a line in an editor, with `{file}` and `{line}`; empty for none.
        ends_with_input: Whether the end of standard input ends it, too.
    """

    port: int = 0
    listen: str = '127.0.0.1'
    opens: bool = False
    allows_changes: bool = False
    editor: str = ''
    ends_with_input: bool = False


def serve(
    name: str | None,
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    options: PageOptions,
) -> int:
    """Serve a page until a signal comes; return the exit code.

    Args:
        name: Of a running system, if there are no files; `None` for the only one.
        paths: A file and its layers.
        words: The arguments of the file.
        set_values: Of the file.

    Raises:
        UsageError: The address is another one's, or the words fit no file.
        ComposerError: There is no such file, the port is taken, or the extra `page` is missing.
    """
    if options.listen not in _LOOPBACK:
        message = 'the page is served to this computer alone: it is not encrypted'
        advice = "ssh -L 8080:127.0.0.1:8080 HOST 'composer page --port 8080 --no-browser'"
        raise UsageError(message, help=f'tunnel it: {advice}')
    try:
        from composer.page.server import PageServer
    except ImportError as error:
        message = f'the page needs {error.name}, which is not installed'
        raise ComposerError(message, help="pip install 'rclpy-composer[page]'") from error
    source = DrawnFiles(paths, words, set_values) if paths else WatchedSystem(name)
    server = PageServer(
        source, options.port, options.editor, allows_changes=options.allows_changes
    )
    click.echo(
        server.address if options.ends_with_input else f'{server.address}\nCtrl-C ends it',
        err=True,
    )
    if options.ends_with_input:
        threading.Thread(target=_end_with_input, name='composer-input', daemon=True).start()
    if options.opens and (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
        with suppress(webbrowser.Error):
            webbrowser.open(server.address)
    server.run()
    return ExitCode.DONE


def _end_with_input() -> None:
    # Its writer keeps it open, and ends somehow.
    sys.stdin.buffer.read()
    os.kill(os.getpid(), signal.SIGINT)
