"""Calls between two processes of one system, over a socket.

Either end calls functions of the other by name; each call has a thread of its own there, so a slow
one keeps no other waiting. Arguments and results are pickled: both ends are the same program, and
nobody else has the socket.
"""

from __future__ import annotations

import copyreg
import itertools
import os
import pickle
import queue
import threading
from contextlib import suppress
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

# The functions that the other end may call, by their names.
Functions: TypeAlias = 'Mapping[str, Callable[..., Any]]'

_RESULT, _ERROR, _LOST = 'result', 'error', 'lost'


class ChannelLostError(ComposerError):
    """The process at the other end has gone, or does not answer in time."""


def _reduce_mapping(mapping: MappingProxyType[Any, Any]) -> tuple[Any, ...]:
    return _freeze, (dict(mapping),)


def _freeze(data: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(data)


# Records have mappings that nobody can change, which Python does not pickle by itself.
copyreg.pickle(MappingProxyType, _reduce_mapping)


class Channel:
    """One end of the connection of two processes.

    Args:
        descriptor: A socket, which belongs to the channel from now on.
        other: What is at the other end, in words.
        functions: What the other end may call.
        on_lost: Called when the other end has gone, in a thread of the channel, or cannot be
            reached any more.
    """

    def __init__(
        self,
        descriptor: int,
        other: str,
        functions: Functions,
        on_lost: Callable[[], object] = lambda: None,
    ) -> None:
        # A pickle says where it ends, so messages need no frames.
        self._socket = os.fdopen(descriptor, 'rb')
        self._inode = os.fstat(descriptor).st_ino
        self._other = other
        self._functions = functions
        self._on_lost = on_lost
        self._numbers = itertools.count(1)
        self._answers: dict[int, queue.SimpleQueue[tuple[str, Any]]] = {}
        self._is_lost = False
        self._sending = threading.Lock()
        self._thread = threading.Thread(target=self._listen, name=f'calls of {other}', daemon=True)

    def listen(self) -> None:
        """Take the calls and answers of the other end from now on."""
        self._thread.start()

    def call(self, name: str, *arguments: Any, timeout_sec: float | None = None) -> Any:
        """Call a function of the other end; return what it returns.

        Raises:
            ChannelLostError: There is nobody any more to answer, or not in time.
            ComposerError: The function raised this, or something else.
        """
        number = next(self._numbers)
        answer: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._answers[number] = answer
        try:
            self._send((number, name, arguments))
            if self._is_lost:
                raise self._lost_error()
            kind, value = answer.get(timeout=timeout_sec)
        except queue.Empty as error:
            message = f'{self._other} has not answered within {timeout_sec:g} s'
            raise ChannelLostError(message) from error
        finally:
            del self._answers[number]
        if kind == _LOST:
            raise self._lost_error()
        if kind == _ERROR:
            raise value
        return value

    def tell(self, name: str, *arguments: Any) -> None:
        """Call a function of the other end; nobody waits for it."""
        self._send((0, name, arguments))

    @property
    def is_intact(self) -> bool:
        """Whether its descriptor is still its own: a behaviour may have closed it."""
        try:
            return os.fstat(self._socket.fileno()).st_ino == self._inode
        except (OSError, ValueError):
            return False

    def _send(self, message: tuple[Any, ...]) -> None:
        data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
        # If the other end has gone, `_listen` notices.
        with self._sending, suppress(OSError):
            if self.is_intact:
                rest = memoryview(data)
                while rest:
                    rest = rest[os.write(self._socket.fileno(), rest) :]
                return
        self._is_lost = True
        self._on_lost()

    def _listen(self) -> None:
        with suppress(OSError, EOFError, pickle.UnpicklingError):
            while True:
                number, name, value = pickle.load(self._socket)  # noqa: S301 - our own process
                if name in (_RESULT, _ERROR):
                    if answer := self._answers.get(number):
                        answer.put((name, value))
                    continue
                thread = threading.Thread(
                    target=self._serve, args=(number, name, value), name=name, daemon=True
                )
                try:
                    thread.start()
                except RuntimeError as error:
                    # There may be no more threads: whoever asks must not wait for ever.
                    self._answer(number, _ERROR, ComposerError(f'{name}: {error}'))
        self._is_lost = True
        for answer in list(self._answers.values()):
            answer.put((_LOST, None))
        self._on_lost()
        with self._sending:
            if self.is_intact:
                self._socket.close()

    def _serve(self, number: int, name: str, arguments: tuple[Any, ...]) -> None:
        try:
            kind, value = _RESULT, self._functions[name](*arguments)
        except ComposerError as error:
            kind, value = _ERROR, _portable(error)
        except BaseException as error:  # noqa: BLE001 - the other end waits for an answer
            kind, value = _ERROR, ComposerError(f'{name}: {error!r}')
        self._answer(number, kind, value)

    def _answer(self, number: int, kind: str, value: Any) -> None:
        if number:
            self._send((number, kind, value))

    def _lost_error(self) -> ChannelLostError:
        return ChannelLostError(f'{self._other} has gone')


def _portable(error: ComposerError) -> ComposerError:
    """Return an error as another process can have it: without what it came from."""
    made = type(error)(str(error), help=error.help)
    made.__cause__ = made.__context__ = None
    return made
