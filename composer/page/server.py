"""The HTTP server of the page: loopback only, with a secret, and read-only by default."""

from __future__ import annotations

import asyncio
import hmac
import json
import math
import secrets
import socket
import sys
from concurrent.futures import Future
from contextlib import aclosing, suppress
from importlib import resources
from time import monotonic, time
from typing import TYPE_CHECKING, Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import (
    HTMLResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Route

from composer.errors import ComposerError
from composer.page.looks import act, list_parameters, look_at_message, show_template
from composer.page.recording import Recording

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable

    from starlette.types import ASGIApp, Message, Receive, Scope, Send

    from composer.application.running_systems.client import Client
    from composer.page.watched_system import DrawnFiles

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
_MOST_STREAMS = 16
# A browser that does not read so long is dropped.
_SEND_SEC = 10.0
_KEEP_ALIVE_SEC = 15.0
# Who has asked so recently looks at the answer.
_LOOK_SEC = 5.0
# States come no faster than they can be looked at.
_SHORTEST_PAUSE_SEC = 0.25
_ANSWER_SEC = 12.0
_ACT_SEC = 70.0
_LONGEST_WISH = 100_000
_MOST_DIGITS = 20
# Of a message, and of each text in the state: 1 MB would come with each period.
_LONGEST_TEXT, _LONGEST_WORDS = 100_000, 10_000
_ASSETS = {'page.css': 'text/css', 'page.js': 'text/javascript'}


class PageServer:
    """Serves what a source knows.

    Args:
        source: Where the page is from.
        port: 0 for any that is free.
        editor: The address of a line in an editor, with `{file}` and `{line}`; empty for none.
        allows_changes: Whether the page may change the system.

    Raises:
        ComposerError: The port is taken.

    Attributes:
        address: With the secret, which is good for one browser after the other.
    """

    def __init__(
        self,
        source: DrawnFiles,
        port: int,
        editor: str = '',
        *,
        allows_changes: bool = False,
    ) -> None:
        self._source = source
        self._secret = secrets.token_urlsafe(32)
        self._settings = {'allows_changes': allows_changes, 'editor': editor}
        self._recording = Recording()
        self._asked = monotonic()
        # Each window that has it open has one.
        self._wakers: set[asyncio.Event] = set()
        self._socket = socket.socket()
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind(('127.0.0.1', port))
            # Who opens the address at once is served once all is ready.
            self._socket.listen(4 * _MOST_STREAMS)
        except OSError as error:
            message = f'port {port} cannot be used: {error.strerror}'
            raise ComposerError(message, help='choose another one with --port') from error
        self.port: int = self._socket.getsockname()[1]
        # Cookies do not tell ports apart.
        self._cookie = f'composer_page_{self.port}'
        self._hosts = {f'{name}:{self.port}' for name in ('127.0.0.1', 'localhost')}
        self.address = f'http://127.0.0.1:{self.port}/?token={self._secret}'

    def run(self) -> None:
        """Serve until a signal comes."""
        config = uvicorn.Config(
            self._guarded(self._routes()),
            log_config=None,
            access_log=False,
            server_header=False,
            date_header=False,
            timeout_graceful_shutdown=1,
            limit_concurrency=4 * _MOST_STREAMS,
            lifespan='off',
        )
        server = uvicorn.Server(config)
        self._source.start()
        try:
            asyncio.run(self._serve(server))
        finally:
            if self._recording.target:
                self._recording.end()
            self._source.stop()

    async def _serve(self, server: uvicorn.Server) -> None:
        loop = asyncio.get_running_loop()

        def wake() -> None:
            for each in self._wakers:
                each.set()

        def tell() -> None:
            with suppress(RuntimeError):  # The loop has ended.
                loop.call_soon_threadsafe(wake)

        self._source.changed, self._source.is_looked_at = tell, self._is_looked_at
        await server.serve(sockets=[self._socket])

    def _is_looked_at(self) -> bool:
        return bool(self._wakers) or monotonic() < self._asked + _LOOK_SEC

    def _routes(self) -> Starlette:
        return Starlette(
            routes=[
                Route('/', self._page),
                Route('/api/state', self._state),
                Route('/api/events', self._events),
                Route('/api/drawing', self._drawing),
                Route('/api/log', self._log),
                Route('/api/parameters', self._asking(list_parameters, 'node')),
                Route('/api/message', self._asking(look_at_message, 'topic')),
                Route('/api/template', self._asking(show_template, 'kind', 'name')),
                Route('/api/act', self._act, methods=['POST']),
                Route('/{name}', self._asset),
            ]
        )

    def _guarded(self, routes: Starlette) -> ASGIApp:
        """Return the application behind the checks of host, origin and secret."""

        async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
            if scope['type'] != 'http':
                return
            self._asked = monotonic()

            async def send_guarded(message: Message) -> None:
                if message['type'] == 'http.response.start':
                    added = [(key.encode(), value.encode()) for key, value in _HEADERS.items()]
                    message = {**message, 'headers': [*message['headers'], *added]}
                await asyncio.wait_for(send(message), _SEND_SEC)

            refusal = self._refuse(Request(scope))
            answer = PlainTextResponse(refusal, status_code=403) if refusal else routes
            with suppress(TimeoutError):
                await answer(scope, receive, send_guarded)

        return guarded

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
        return HTMLResponse(_read_asset('page.html'))

    async def _asset(self, request: Request) -> Response:
        name = request.path_params['name']
        if name not in _ASSETS:
            return Response(status_code=404)
        return Response(_read_asset(name), media_type=_ASSETS[name])

    async def _state(self, _request: Request) -> Response:
        return _json(self._shown(), longest=_LONGEST_WORDS)

    def _shown(self) -> dict[str, Any]:
        recording = {'target': self._recording.target, 'told': self._recording.told}
        return {**self._source.state, **self._settings, 'recording': recording, 'time': time()}

    async def _drawing(self, request: Request) -> Response:
        drawing = self._source.drawing
        if drawing is None:
            return _json({})
        folded = frozenset(request.query_params.getlist('folded'))
        # Graphviz takes a while.
        return _json(await asyncio.to_thread(drawing.fold, folded), longest=sys.maxsize)

    async def _log(self, request: Request) -> Response:
        after = request.query_params.get('after', '0')
        number = int(after) if after.isdecimal() and len(after) < _MOST_DIGITS else 0
        return _json([each for each in list(self._source.log) if each['number'] > number])

    def _asking(
        self, question: Callable[..., Any], *names: str
    ) -> Callable[[Request], Awaitable[Response]]:
        """Return what asks the graph, with values of the address."""

        async def asking(request: Request) -> Response:
            values = [request.query_params.get(name, '') for name in names]
            return await self._ask(lambda client: question(client, *values))

        return asking

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
        future: Future[Any] = Future()
        self._source.ask(question, future)
        try:
            return _json(await asyncio.wait_for(asyncio.wrap_future(future), timeout_sec))
        except Exception as error:  # noqa: BLE001 - rclpy raises many kinds
            more = getattr(error, 'help', None)
            text = str(error) or 'no answer'
            return _json({'problem': f'{text} ({more})' if more else text}, 504)

    async def _events(self, _request: Request) -> Response:
        if len(self._wakers) >= _MOST_STREAMS:
            return PlainTextResponse(f'{_MOST_STREAMS} windows have it open', status_code=503)
        return _Events(self._list_states(), media_type='text/event-stream')

    async def _list_states(self) -> AsyncIterator[str]:
        """Yield the newest state after each change."""
        waker = asyncio.Event()
        self._wakers.add(waker)
        try:
            while True:
                waker.clear()
                yield f'data: {_dump(self._shown(), _LONGEST_WORDS)}\n\n'
                await asyncio.sleep(_SHORTEST_PAUSE_SEC)
                with suppress(TimeoutError):
                    await asyncio.wait_for(waker.wait(), _KEEP_ALIVE_SEC)
        finally:
            self._wakers.discard(waker)


class _Events(StreamingResponse):
    """Ends its iterator, too, when the browser leaves or does not read."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        iterator: Any = self.body_iterator
        async with aclosing(iterator):
            await super().__call__(scope, receive, send)


def _read_asset(name: str) -> str:
    return resources.files('composer.page').joinpath(name).read_text(encoding='utf-8')


def _json(data: Any, code: int = 200, longest: int = _LONGEST_TEXT) -> Response:
    return Response(_dump(data, longest), status_code=code, media_type='application/json')


def _dump(data: Any, longest: int) -> str:
    """Return data as JSON, in which no number is infinite, and no text is longer."""
    return json.dumps(_finite(data, longest), separators=(',', ':'))


def _finite(data: Any, longest: int) -> Any:
    if isinstance(data, str) and len(data) > longest:
        return f'{data[:longest]}…'
    if isinstance(data, float) and not math.isfinite(data):
        return str(data)
    if isinstance(data, dict):
        return {key[:longest]: _finite(value, longest) for key, value in data.items()}
    return [_finite(each, longest) for each in data] if isinstance(data, list | tuple) else data
