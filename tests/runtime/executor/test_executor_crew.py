"""The executor's threads and their end."""

import _thread
import threading
import time

import pytest

pytest.importorskip('rclpy')

from spinning import DEADLINE_SEC, wait_for

from composer.runtime.executor.crew import Crew

pytestmark = pytest.mark.ros


def test_a_crew_is_manned_by_threads_that_are_yet_to_begin(monkeypatch):
    begin = _thread.start_new_thread
    late = []
    monkeypatch.setattr(_thread, 'start_new_thread', lambda work, _: late.append(work))
    crew = Crew(lambda worker: crew.leads(worker, lambda: False))
    crew.muster()
    monkeypatch.undo()
    crew.dismiss(0.0)
    assert crew.is_manned()
    for work in late:
        begin(work, ())
    wait_for(lambda: not crew.is_manned())
    crew.muster()
    assert not crew.is_manned()


def test_shutdown_leaves_a_waiting_spin_once_what_it_waits_with(node, executor):
    board = executor._engine.polling.board
    wait, waiting, errors = board.wait, threading.Event(), []

    def wait_twice(timeout_sec):
        waiting.set()
        wait(timeout_sec)
        time.sleep(0.01)
        return wait(0)

    def spin():
        try:
            executor.spin_once()
        except BaseException as error:  # noqa: BLE001
            errors.append(error)

    board.wait = wait_twice
    thread = threading.Thread(target=spin)
    thread.start()
    assert waiting.wait(DEADLINE_SEC)
    assert executor.shutdown()
    thread.join(DEADLINE_SEC)
    assert not thread.is_alive()
    assert errors == []
