"""Answers what is asked over a connection; if that is lost, what is under way is taken back.

Each request is a line of JSON, `{"id": 1, "do": "stage", ...}`, and as many bytes as its `bytes`
says. Each answer is a line with the same `id`, and `result`, or `error` and `help`. Requests are
done one after the other, but `ping` at once.
"""

from __future__ import annotations

import json
import os
import queue
import select
import signal
import sys
import threading
from typing import TYPE_CHECKING, Any

from composer.hosts.agent.changeover import Transaction
from composer.hosts.agent.facts import collect_facts
from composer.hosts.agent.host_errors import explain, run
from composer.hosts.agent.host_unit import Service
from composer.hosts.agent.store import Store

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

# Whoever asks says something every few seconds.
_SILENCE_SEC = 20.0
_CHUNK = 1 << 20


def main(options: Mapping[str, Any]) -> None:
    """Answer until the connection ends.

    Args:
        options: `folder`, `system`, `unit`, `scope` and `environment_file`: of the system that it
            is about.
    """
    # The end of the connection is seen by its end alone: then there is work to do.
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGPIPE):
        signal.signal(number, signal.SIG_IGN)
    store = Store(options['folder'], options['system'])
    service = Service(options['unit'], options['scope'], options['environment_file'])
    Conversation(store, service, Transaction(store, service)).run()


class Conversation:
    """What is asked, and the answers."""

    def __init__(self, store: Store, service: Service, transaction: Transaction) -> None:
        self._store, self._service, self._transaction = store, service, transaction
        self._requests: queue.SimpleQueue[tuple[dict[str, Any], bytes] | None] = (
            queue.SimpleQueue()
        )
        self._writes = threading.Lock()
        self._is_lost = False
        self._operations: dict[str, Callable[..., Any]] = {
            'look': lambda: collect_facts(store, service, transaction),
            'lock': store.lock,
            'receive_part': store.receive_part,
            'receive': store.receive,
            'receive_wheel': store.receive_wheel,
            'unpack_composer': store.unpack_composer,
            'provide_venv': store.provide_venv,
            'stage': transaction.stage,
            'run_release': self._run_release,
            'begin': transaction.begin,
            'switch': transaction.switch,
            'wait_until_held': transaction.wait_until_held,
            'let_go': transaction.let_go,
            'wait_until_up': transaction.wait_until_up,
            'reload': transaction.reload,
            'confirm': transaction.confirm,
            'leave': transaction.leave,
            'commit': transaction.commit,
            'roll_back': self._roll_back,
            'remove': transaction.remove,
        }

    def run(self) -> None:
        """Answer until the connection ends; then take back what is under way."""
        worker = threading.Thread(target=self._work)
        worker.start()
        self._read(_Input())
        self._is_lost = True
        self._service.abandoned.set()
        self._requests.put(None)
        worker.join()

    def _read(self, stream: _Input) -> None:
        while line := stream.read_line():
            request = json.loads(line)
            data = stream.read(request.pop('bytes', 0))
            if request['do'] == 'ping':
                self._answer({'id': request['id'], 'result': None})
                continue
            if request['do'] == 'roll_back':
                # What is under way is not waited for.
                self._service.abandoned.set()
            self._requests.put((request, data))

    def _work(self) -> None:
        while (item := self._requests.get()) is not None:
            if not self._is_lost:
                self._do(*item)
        if self._store.is_locked:
            self._roll_back()

    def _roll_back(self) -> str:
        self._service.abandoned.clear()
        return self._transaction.roll_back()

    def _do(self, request: dict[str, Any], data: bytes) -> None:
        number, name = request.pop('id'), request.pop('do')
        if data:
            request['data'] = data
        try:
            result = self._operations[name](**request)
        except Exception as error:  # noqa: BLE001 - all of it is for who has asked
            message, advice = explain(error)
            self._answer({'id': number, 'error': message, 'help': advice})
        else:
            self._answer({'id': number, 'result': result})

    def _answer(self, answer: dict[str, Any]) -> None:
        with self._writes:
            try:
                sys.stdout.buffer.write(json.dumps(answer).encode() + b'\n')
                sys.stdout.buffer.flush()
            except OSError:
                self._is_lost = True

    def _run_release(self, release: str, words: list[str]) -> str:
        """Run Composer as a release has it."""
        program = str(self._store.root / release / 'composer')
        return run([program, *words], variables=self._service.variables())


class _Input:
    """What comes over the connection, as far as it has come in time."""

    def __init__(self) -> None:
        self._data = bytearray()

    def read_line(self) -> bytes:
        """Return the next line; empty at the end, or after a silence."""
        while (end := self._data.find(b'\n')) < 0:
            if not self._receive():
                return b''
        return self._take(end + 1)

    def read(self, count: int) -> bytes:
        """Return as many bytes, fewer at the end."""
        while len(self._data) < count and self._receive():
            pass
        return self._take(count)

    def _take(self, count: int) -> bytes:
        taken = bytes(self._data[:count])
        del self._data[:count]
        return taken

    def _receive(self) -> bool:
        has_some = bool(select.select([0], [], [], _SILENCE_SEC)[0])
        data = os.read(0, _CHUNK) if has_some else b''
        self._data += data
        return bool(data)
