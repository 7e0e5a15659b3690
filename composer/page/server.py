"""`composer page`: an HTTP server for this computer only, with a secret, read-only by default."""

from __future__ import annotations

import asyncio
import hmac
import json
import math
import os
import secrets
import signal
import socket
import sys
import threading
import webbrowser
from contextlib import suppress
from functools import partial
from pathlib import Path
from time import monotonic, time
from typing import TYPE_CHECKING, Any

import click

from composer.errors import ComposerError, ExitCode, UsageError
from composer.page.drawn_parts import draw_files
from composer.page.looks import (
    Recording,
    act,
    list_parameters,
    look_at_message,
    show_template,
)
from composer.page.watched_system import WatchedSystem
from composer.records import record

try:
    import uvicorn
    from starlette.applications import Starlette
    from starlette.datastructures import MutableHeaders
    from starlette.requests import Request
    from starlette.responses import (
        FileResponse,
        PlainTextResponse,
        RedirectResponse,
        Response,
        StreamingResponse,
    )
    from starlette.routing import Route
except ImportError as error:
    message = f'the page needs {error.name}, which is not installed'
    raise ComposerError(message, help="pip install 'rclpy-composer[page]'") from error

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Sequence

    from starlette.types import Message, Receive, Scope, Send

    from composer.application.running_systems.client import Client

_LOOPBACK = ('127.0.0.1', 'localhost', '::1')
_HEADERS = {
    'cache-control': 'no-store',
    'content-security-policy': (
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    'cross-origin-opener-policy': 'same-origin',
    'cross-origin-resource-policy': 'same-origin',
    'referrer-policy': 'no-referrer',
    'x-content-type-options': 'nosniff',
}
# Each window has one that stays open.
_MOST_CONNECTIONS = 64
# A browser that does not read so long is dropped.
_SEND_SEC = 10.0
_KEEP_ALIVE_SEC = 15.0
# States come no faster than they can be looked at.
_PAUSE_SEC = 0.25
_ANSWER_SEC = 12.0
_ACT_SEC = 70.0
_LONGEST_WISH = 100_000
_MOST_DIGITS = 20
# Of a message, and of each text in the state: 1 MB would come with each period.
_LONGEST_TEXT, _LONGEST_WORDS = 100_000, 10_000
_FILES = Path(__file__).parent
_ASSETS = ('page.css', 'page.js')


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
    drawing = draw_files(paths, words, set_values) if paths else None
    server = PageServer(WatchedSystem(name, drawing), options)
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


class PageServer:
    """Serves what a source knows.

    Raises:
        ComposerError: The port is taken.

    Attributes:
        address: With the secret, which is good for one browser after the other.
    """

    def __init__(self, source: WatchedSystem, options: PageOptions) -> None:
        self._source = source
        self._secret = secrets.token_urlsafe(32)
        self._settings = {
            'allows_changes': options.allows_changes,
            'editor': options.editor,
            'folder': str(Path.cwd()),
        }
        self._recording = Recording()
        self._routes = Starlette(
            routes=[
                Route('/', self._page),
                Route('/api/state', self._state),
                Route('/api/events', self._events),
                Route('/api/drawing', self._drawing),
                Route('/api/log', self._log),
                Route('/api/parameters', partial(self._question, list_parameters)),
                Route('/api/message', partial(self._question, look_at_message)),
                Route('/api/template', partial(self._question, show_template)),
                Route('/api/act', self._act, methods=['POST']),
                Route('/{name}', self._asset),
            ]
        )
        try:
            # Who opens the address at once is served once all is ready.
            address = ('127.0.0.1', options.port)
            self._socket = socket.create_server(address, backlog=_MOST_CONNECTIONS)
        except OSError as error:
            message = f'port {options.port} cannot be used: {os.strerror(error.errno or 0)}'
            raise ComposerError(message, help='choose another one with --port') from error
        port = self._socket.getsockname()[1]
        # Cookies do not tell ports apart.
        self._cookie = f'composer_page_{port}'
        self._hosts = {f'{name}:{port}' for name in ('127.0.0.1', 'localhost')}
        self.address = f'http://127.0.0.1:{port}/?token={self._secret}'

    def run(self) -> None:
        """Serve until a signal comes."""
        config = uvicorn.Config(
            self._guarded,
            interface='asgi3',
            log_config=None,
            access_log=False,
            server_header=False,
            date_header=False,
            timeout_graceful_shutdown=1,
            limit_concurrency=_MOST_CONNECTIONS,
            lifespan='off',
        )
        self._source.start()
        try:
            uvicorn.Server(config).run(sockets=[self._socket])
        finally:
            if self._recording.target:
                self._recording.end()
            self._source.stop()

    async def _guarded(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, if host, origin and secret are right."""
        if scope['type'] != 'http':
            return
        self._source.looked_at = monotonic()

        async def send_guarded(message: Message) -> None:
            if message['type'] == 'http.response.start':
                MutableHeaders(scope=message).update(_HEADERS)
            await asyncio.wait_for(send(message), _SEND_SEC)

        refusal = self._refuse(Request(scope))
        answer = PlainTextResponse(refusal, status_code=403) if refusal else self._routes
        with suppress(TimeoutError):
            await answer(scope, receive, send_guarded)

    def _refuse(self, request: Request) -> str:
        """Return why a request is not served; nothing if it is."""
        # A name that somebody else has made point here is none of ours.
        if request.headers.get('host') not in self._hosts:
            return 'this page has another address'
        origin = request.headers.get('origin')
        if origin and origin.removeprefix('http://') not in self._hosts:
            return 'another page may not read this one'
        if request.method != 'GET':
            # Browsers name the origin of each request that may change something.
            if request.method != 'POST' or not (self._settings['allows_changes'] and origin):
                return "this page only shows: 'composer page --allow-changes' lets it change"
            if request.headers.get('content-type') != 'application/json':
                return 'a wish is JSON'
        if self._brings_secret(request) or self._is_secret(request.cookies.get(self._cookie, '')):
            return ''
        return "open the address that 'composer page' prints"

    def _brings_secret(self, request: Request) -> bool:
        return request.url.path == '/' and self._is_secret(request.query_params.get('token', ''))

    def _is_secret(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(), self._secret.encode())

    async def _page(self, request: Request) -> Response:
        if self._brings_secret(request):
            answer = RedirectResponse('/', status_code=303)
            answer.set_cookie(self._cookie, self._secret, httponly=True, samesite='strict')
            return answer
        return FileResponse(_FILES / 'page.html')

    async def _asset(self, request: Request) -> Response:
        name = request.path_params['name']
        return FileResponse(_FILES / name) if name in _ASSETS else Response(status_code=404)

    async def _state(self, _request: Request) -> Response:
        return _json(self._shown())

    def _shown(self) -> Any:
        recording = {'target': self._recording.target, 'told': self._recording.told}
        state = {**self._source.state, **self._settings, 'recording': recording, 'time': time()}
        return _finite(state, _LONGEST_WORDS)

    async def _drawing(self, request: Request) -> Response:
        drawing = self._source.drawing
        folded = request.query_params.getlist('folded') or None
        # Graphviz takes a while.
        return _json(await asyncio.to_thread(drawing.fold, folded) if drawing else {})

    async def _log(self, request: Request) -> Response:
        after = request.query_params.get('after', '0')
        number = int(after) if after.isdecimal() and len(after) < _MOST_DIGITS else 0
        return _json([line for line in list(self._source.log) if line['number'] > number])

    async def _question(self, question: Callable[..., Any], request: Request) -> Response:
        """Ask the graph, with values of the address."""
        return await self._ask(partial(question, **request.query_params))

    async def _act(self, request: Request) -> Response:
        body = b''
        async for chunk in request.stream():
            body += chunk
            if len(body) > _LONGEST_WISH:
                return _json({'problem': 'that is too long'}, 413)
        try:
            wish = json.loads(body)
        except (ValueError, RecursionError):
            wish = None
        if not isinstance(wish, dict) or not all(isinstance(each, str) for each in wish.values()):
            return _json({'problem': 'a wish is a mapping of texts'}, 400)
        system = self._source.system
        if system is None:
            return _json({'problem': 'the system does not run'}, 504)
        return await self._ask(lambda client: act(client, system, wish, self._recording), _ACT_SEC)

    async def _ask(
        self, question: Callable[[Client], Any], timeout_sec: float = _ANSWER_SEC
    ) -> Response:
        """Return what the graph answers to a question."""
        try:
            future = asyncio.wrap_future(self._source.ask(question))
            answer, code = await asyncio.wait_for(future, timeout_sec), 200
        except Exception as error:  # noqa: BLE001 - rclpy raises many kinds
            more = getattr(error, 'help', None)
            text = str(error) or 'no answer'
            answer, code = {'problem': f'{text} ({more})' if more else text}, 504
        return _json(_finite(answer, _LONGEST_TEXT), code)

    async def _events(self, _request: Request) -> Response:
        return StreamingResponse(self._list_states(), media_type='text/event-stream')

    async def _list_states(self) -> AsyncIterator[str]:
        """Yield the newest state after each change."""
        told, told_sec = None, 0.0
        while True:
            self._source.looked_at = now = monotonic()
            if told is not self._source.state or now > told_sec + _KEEP_ALIVE_SEC:
                told, told_sec = self._source.state, now
                yield f'data: {json.dumps(self._shown())}\n\n'
            await asyncio.sleep(_PAUSE_SEC)


def _json(data: Any, code: int = 200) -> Response:
    return Response(json.dumps(data), code, media_type='application/json')


def _finite(data: Any, longest: int) -> Any:
    """Return data in which no number is infinite, and no text is longer."""
    if isinstance(data, str) and len(data) > longest:
        return f'{data[:longest]}…'
    if isinstance(data, float) and not math.isfinite(data):
        return str(data)
    if isinstance(data, dict):
        return {key[:longest]: _finite(value, longest) for key, value in data.items()}
    return [_finite(each, longest) for each in data] if isinstance(data, list | tuple) else data
