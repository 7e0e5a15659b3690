"""The output of external processes: shown line by line, each after the name of its process."""

from __future__ import annotations

import codecs
import os
import select
import sys
import threading
from contextlib import suppress

from composer.terminal import escape, escape_output

_CHUNK = 1 << 16
# Together as much as the largest pipe holds.
_LAST_CHUNKS = 16
# Longer lines are shown in parts.
_LONGEST_LINE = 1 << 16
# A pipe that is ready takes 4096 bytes (PIPE_BUF); a character has at most four.
_PIECE = 1000
_POLL_MS = 200


class _Output:
    """The output of one process that has not been shown yet."""

    def __init__(self, name: str) -> None:
        self.ended = threading.Event()
        self._prefix = f'[{escape(name)}] '
        self._decoder = codecs.getincrementaldecoder('utf-8')('backslashreplace')
        self._rest = ''

    def take(self, data: bytes) -> str:
        """Return the lines that are complete; empty data marks the end of the output."""
        text = self._rest + self._decoder.decode(data, final=not data)
        # A line feed may follow the last one.
        text, returned = (text[:-1], '\r') if data and text.endswith('\r') else (text, '')
        text = text.replace('\r\n', '\n').replace('\r', '\n')
        lines, separator, rest = text.rpartition('\n')
        self._rest = rest + returned
        if self._rest and (not data or len(self._rest) > _LONGEST_LINE):
            lines, separator, self._rest = f'{lines}{separator}{self._rest}', '\n', ''
        if not separator:
            return ''
        return self._prefix + escape_output(lines).replace('\n', f'\n{self._prefix}') + '\n'


class ProcessOutputs:
    """Shows the output of processes on standard output, with one thread for all of them.

    It keeps at most one line of each process. If standard output is blocked, the processes wait.
    """

    def __init__(self) -> None:
        self._outputs: dict[int, _Output] = {}
        self._poll = select.poll()
        self._wake_up, self._wake_up_end = os.pipe()
        self._poll.register(self._wake_up, select.POLLIN)
        self._is_closing = False
        self._thread = threading.Thread(target=self._show_all, name='output', daemon=True)
        self._thread.start()

    def add(self, name: str, descriptor: int) -> threading.Event:
        """Show what comes from a pipe and close it at its end; return an event to be set then."""
        os.set_blocking(descriptor, False)
        output = self._outputs[descriptor] = _Output(name)
        self._poll.register(descriptor, select.POLLIN)
        # A poll that has begun does not include it.
        os.write(self._wake_up_end, b'.')
        return output.ended

    def close(self) -> None:
        """Show what the pipes hold now, and stop; a forked child may keep a pipe open."""
        self._is_closing = True
        os.write(self._wake_up_end, b'.')
        self._thread.join()
        os.close(self._wake_up)
        os.close(self._wake_up_end)

    def _show_all(self) -> None:
        while not self._is_closing:
            for descriptor, _ in self._poll.poll():
                if descriptor == self._wake_up:
                    os.read(descriptor, _CHUNK)
                else:
                    self._show_some(descriptor)
        for descriptor in list(self._outputs):
            for _ in range(_LAST_CHUNKS):
                if not self._show_some(descriptor):
                    break
            if descriptor in self._outputs:
                self._end(descriptor)

    def _show_some(self, descriptor: int) -> bool:
        """Show some output of a process; return whether there may be more."""
        try:
            data = os.read(descriptor, _CHUNK)
        except BlockingIOError:
            return False
        self._show(self._outputs[descriptor].take(data))
        if not data:
            self._end(descriptor)
        return bool(data)

    def _end(self, descriptor: int) -> None:
        output = self._outputs.pop(descriptor)
        self._show(output.take(b''))
        self._poll.unregister(descriptor)
        os.close(descriptor)
        output.ended.set()

    def _show(self, text: str) -> None:
        # The reader of standard output may have gone; the system goes on.
        with suppress(OSError, ValueError):
            start = 0
            while start < len(text) and self._may_write():
                # Whole lines where possible: others write to the terminal, too.
                end = text.rfind('\n', start, start + _PIECE) + 1 or start + _PIECE
                sys.stdout.write(text[start:end])
                sys.stdout.flush()
                start = end

    def _may_write(self) -> bool:
        """Wait until standard output is ready; return `False` if the output is being closed."""
        try:
            descriptor = sys.stdout.fileno()
        except (OSError, ValueError):
            return True  # a stream in memory
        ready = select.poll()
        ready.register(descriptor, select.POLLOUT)
        while not ready.poll(_POLL_MS):
            if self._is_closing:
                return False
        return True
