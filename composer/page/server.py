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
from contextlib import suppress
from importlib import resources
from time import monotonic, time
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.page.looks import act, list_parameters, look_at_message, show_template
from composer.page.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, MutableMapping
    from typing import TypeAlias

    from starlette.requests import Request
    from starlette.responses import Response

    from composer.application.running_systems.client import Client
    from composer.page.watched_system import DrawnFiles, WatchedSystem

    Scope: TypeAlias = MutableMapping[str, Any]
    Receive: TypeAlias = Callable[[], Awaitable[Scope]]
    Send: TypeAlias = Callable[[Scope], Awaitable[None]]
    Application: TypeAlias = Callable[[Scope, Receive, Send], Awaitable[None]]

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
        ComposerError: The port is taken, or the extra `page` is missing.

    Attributes:
        address: With the secret, which is good for one browser after the other.
    """

    def __init__(
        self,
        source: DrawnFiles | WatchedSystem,
        port: int,
        editor: str = '',
        *,
        allows_changes: bool = False,
    ) -> None:
        try:
            import starlette  # noqa: F401 - asked for at once
            import uvicorn
        except ImportError as error:
            message = f'the page needs {error.name}, which is not installed'
            raise ComposerError(message, help="pip install 'rclpy-composer[page]'") from error
        self._uvicorn = uvicorn
        self._source = source
        self._secret = secrets.token_urlsafe(32)
        self._settings = {'allows_changes': allows_changes, 'editor': editor}
        self._recording = Recording()
        self._streams, self._asked = 0, monotonic()
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
        config = self._uvicorn.Config(
            self._guarded(self._routes()),
            log_config=None,
            access_log=False,
            server_header=False,
            date_header=False,
            timeout_graceful_shutdown=1,
            limit_concurrency=4 * _MOST_STREAMS,
            lifespan='off',
        )
        server = self._uvicorn.Server(config)
        self._source.start()
        try:
            asyncio.run(self._serve(server))
        finally:
            if self._recording.target:
                self._recording.end()
            self._source.stop()

    async def _serve(self, server: Any) -> None:
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
        return self._streams > 0 or monotonic() < self._asked + _LOOK_SEC

    def _routes(self) -> Application:
        from starlette.applications import Starlette
        from starlette.routing import Route

        return Starlette(
            routes=[
                Route('/', self._page),
                Route('/api/state', self._state),
                Route('/api/drawing', self._drawing),
                Route('/api/log', self._log),
                Route('/api/parameters', self._parameters),
                Route('/api/message', self._message),
                Route('/api/template', self._template),
                Route('/api/act', self._act, methods=['POST']),
                Route('/{name}', self._asset),
            ]
        )

    def _guarded(self, routes: Application) -> Application:
        """Return the application behind the checks of host, origin and secret."""
        from starlette.requests import Request
        from starlette.responses import PlainTextResponse

        async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
            if scope['type'] != 'http':
                return
            request = Request(scope)
            self._asked = monotonic()

            async def send_guarded(message: Scope) -> None:
                if message['type'] == 'http.response.start':
                    added = [(key.encode(), value.encode()) for key, value in _HEADERS.items()]
                    message = {**message, 'headers': [*message['headers'], *added]}
                await send(message)

            if refusal := self._refuse(request):
                answer = PlainTextResponse(refusal, status_code=403)
                await answer(scope, receive, send_guarded)
            elif scope['path'] == '/api/events':
                await self._stream(receive, send_guarded)
            else:
                await routes(scope, receive, send_guarded)

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
        from starlette.responses import HTMLResponse, RedirectResponse

        if self._brings_secret(request):
            answer = RedirectResponse('/', status_code=303)
            answer.set_cookie(self._cookie, self._secret, httponly=True, samesite='strict')
            return answer
        return HTMLResponse(_read_asset('page.html'))

    async def _asset(self, request: Request) -> Response:
        from starlette.responses import Response

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
        number = int(after) if after.isdecimal() else 0
        return _json([each for each in list(self._source.log) if each['number'] > number])

    async def _parameters(self, request: Request) -> Response:
        node = request.query_params.get('node', '')
        known = self._source.state.get('status', {}).get('nodes', [])
        if node not in known:
            return _json({'problem': 'there is no such node'}, 404)
        return await self._ask(lambda client: list_parameters(client, node))

    async def _message(self, request: Request) -> Response:
        topic = request.query_params.get('topic', '')
        return await self._ask(lambda client: look_at_message(client, topic))

    async def _template(self, request: Request) -> Response:
        kind, name = (request.query_params.get(each, '') for each in ('kind', 'name'))
        return await self._ask(lambda client: show_template(client, kind, name))

    async def _act(self, request: Request) -> Response:
        body = b''
        async for chunk in request.stream():
            body += chunk
            if len(body) > _LONGEST_WISH:
                return _json({'problem': 'that is too long'}, 413)
        try:
            wish = json.loads(body)
        except ValueError:
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
        except (ComposerError, TimeoutError) as error:
            more = getattr(error, 'help', None)
            text = str(error) or 'no answer'
            return _json({'problem': f'{text} ({more})' if more else text}, 504)

    async def _stream(self, receive: Receive, send: Send) -> None:
        """Send the newest state after each change, until the browser leaves or does not read."""
        from starlette.responses import PlainTextResponse

        if self._streams >= _MOST_STREAMS:
            message = f'{_MOST_STREAMS} windows have it open'
            await PlainTextResponse(message, status_code=503)({'type': 'http'}, receive, send)
            return
        waker = asyncio.Event()
        self._wakers.add(waker)
        self._streams += 1
        left = asyncio.ensure_future(_wait_until_left(receive))
        try:
            headers = [(b'content-type', b'text/event-stream')]
            await send({'type': 'http.response.start', 'status': 200, 'headers': headers})
            while not left.done():
                waker.clear()
                text = f'data: {_dump(self._shown(), _LONGEST_WORDS)}\n\n'
                body = {'type': 'http.response.body', 'body': text.encode(), 'more_body': True}
                await asyncio.wait_for(send(body), _SEND_SEC)
                await asyncio.wait([left], timeout=_SHORTEST_PAUSE_SEC)
                changed = asyncio.ensure_future(waker.wait())
                await asyncio.wait(
                    [changed, left], timeout=_KEEP_ALIVE_SEC, return_when=asyncio.FIRST_COMPLETED
                )
                changed.cancel()
        except TimeoutError:
            pass
        finally:
            left.cancel()
            self._streams -= 1
            self._wakers.discard(waker)


async def _wait_until_left(receive: Receive) -> None:
    while (await receive())['type'] != 'http.disconnect':
        pass


def _read_asset(name: str) -> str:
    return resources.files('composer.page').joinpath(name).read_text(encoding='utf-8')


def _json(data: Any, code: int = 200, longest: int = _LONGEST_TEXT) -> Response:
    from starlette.responses import Response

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
