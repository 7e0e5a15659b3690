"""The connection to the reaper, the process that starts all external processes of a system."""

from __future__ import annotations

import json
import os
import select
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.processes import reaper

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

_CHUNK = 1 << 16
# How long the reaper may take to kill all that is left, and to end.
_END_SEC = 10.0


class ReaperConnection:
    """Starts the reaper and sends it requests; `reaper` describes the protocol.

    Args:
        take_answer: Takes each answer, in a thread of the connection.
        on_lost: Called in that thread if the reaper has ended by itself.
        folder: A folder of files that the reaper removes when it ends.

    Attributes:
        mark: An environment variable of all processes that were started.
    """

    def __init__(
        self,
        take_answer: Callable[[dict[str, Any]], None],
        on_lost: Callable[[], None],
        folder: str,
    ) -> None:
        self.mark = f'COMPOSER_SYSTEM_{os.urandom(16).hex()}'
        self._take_answer = take_answer
        self._on_lost = on_lost
        self._lock = threading.Lock()
        self._is_closing = False
        self._socket, other_end = socket.socketpair()
        with other_end:
            self._process = subprocess.Popen(  # noqa: S603 - our own script
                [
                    *(sys.executable, '-I', '-S', reaper.__file__),
                    *(str(other_end.fileno()), str(os.getpid()), self.mark, folder),
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=(other_end.fileno(),),
                # A signal of the terminal goes to Composer alone, which decides what to do.
                start_new_session=True,
            )
        self._thread = threading.Thread(target=self._listen, name='processes', daemon=True)
        self._thread.start()

    def start(
        self,
        number: int,
        command: Sequence[str],
        env: Mapping[str, str],
        cwd: str | None,
        descriptors: Sequence[int],
    ) -> None:
        """Ask for a process to be started.

        Args:
            number: Identifies the process in the answers.
            descriptors: For its output; for standard error, if that is another one; and for its
                connection to Composer, if it has one. They remain the caller's.
        """
        request = {'do': 'start', 'command': command, 'env': {**env, self.mark: '1'}, 'cwd': cwd}
        self._send(request | {'number': number, 'descriptors': len(descriptors)}, descriptors)

    def stop(
        self, number: int, signal_number: int, timeout_sec: float, *, alone: bool = False
    ) -> None:
        """Ask for a process to be signalled, and killed if it does not end in time.

        Args:
            alone: Whether it tells its own processes to end, which are not signalled.
        """
        request = {'do': 'stop', 'signal': signal_number, 'timeout': timeout_sec, 'alone': alone}
        self._send(request | {'number': number})

    def close(self) -> None:
        """Let the reaper kill all that is left; return when it has."""
        self.kill_all()
        if self._thread is not threading.current_thread():
            self._thread.join(_END_SEC)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(0)
        self._socket.close()

    def kill_all(self) -> None:
        """Do the same, without locks: a signal handler may call it."""
        self._is_closing = True
        # A child that a behaviour forked may hold the socket, too: closing it is not enough.
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
        self._wait_for_end()

    def _wait_for_end(self) -> None:
        """Wait until both reapers have ended; if they hang, they end after Composer."""
        with suppress(OSError):
            ended = select.poll()
            descriptor = os.pidfd_open(self._process.pid)
            ended.register(descriptor, select.POLLIN)
            ended.poll(_END_SEC * 1000)
            os.close(descriptor)

    def _send(self, request: dict[str, Any], descriptors: Sequence[int] = ()) -> None:
        line = json.dumps(request).encode() + b'\n'
        # If the reaper is gone, `on_lost` is called.
        with self._lock, suppress(ConnectionError):
            sent = socket.send_fds(self._socket, [line], descriptors)
            self._socket.sendall(line[sent:])

    def _listen(self) -> None:
        rest = b''
        while data := self._receive():
            *lines, rest = (rest + data).split(b'\n')
            for line in lines:
                self._take_answer(json.loads(line))
        if not self._is_closing:
            # The second reaper kills what the first one leaves, unless it was killed, too.
            self._wait_for_end()
            reaper.kill_marked(self.mark)
            self._on_lost()

    def _receive(self) -> bytes:
        with suppress(ConnectionError):
            return self._socket.recv(_CHUNK)
        return b''
