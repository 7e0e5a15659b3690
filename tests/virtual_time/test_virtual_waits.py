"""What Python programs wait with takes virtual time, and no more real time than it must."""

import _thread
import asyncio
import os
import queue
import select
import selectors
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait as wait_for_futures
from time import sleep

import pytest

from tests.virtual_time.virtual_runs import virtual_time


def _after(seconds, function, *arguments):
    def run():
        sleep(seconds)
        function(*arguments)

    thread = threading.Thread(target=run)
    thread.start()
    return thread


def _sleep():
    sleep(3)


def _sleep_by_default_argument(pause=time.sleep):
    pause(3)


def _lock():
    lock = threading.Lock()
    lock.acquire()
    _after(3, lock.release)
    with lock:
        assert lock.locked()


def _lock_in_vain():
    lock = threading.Lock()
    lock.acquire()
    assert not lock.acquire(timeout=3)
    assert not lock.acquire(False)
    assert not lock.acquire(timeout=0)


def _reentrant_lock():
    lock = threading.RLock()
    has_it = threading.Event()

    def hold():
        with lock, lock:
            has_it.set()
            sleep(3)

    threading.Thread(target=hold).start()
    has_it.wait()
    assert not lock.acquire(blocking=False)
    with lock, lock:
        assert lock.acquire(timeout=1)
        lock.release()


def _condition():
    condition = threading.Condition()
    found = []

    def give():
        with condition:
            found.append(1)
            condition.notify_all()

    _after(3, give)
    with condition:
        assert condition.wait_for(lambda: found, timeout=10)


def _condition_held_twice():
    condition = threading.Condition(threading.RLock())

    def give():
        with condition:
            condition.notify()

    _after(3, give)
    with condition, condition:
        assert condition.wait(10)


def _event():
    event = threading.Event()
    _after(3, event.set)
    assert event.wait()


def _semaphore():
    semaphore = threading.Semaphore(0)
    _after(3, semaphore.release)
    assert semaphore.acquire(timeout=10)


def _barrier():
    barrier = threading.Barrier(3)
    _after(1, barrier.wait)
    _after(3, barrier.wait)
    barrier.wait()


def _queue():
    items = queue.Queue(1)
    _after(3, items.put, 'a')
    assert items.get() == 'a'


def _full_queue():
    items = queue.Queue(1)
    items.put(1)
    _after(1, items.get)
    items.put(2, timeout=5)
    with pytest.raises(queue.Full):
        items.put(3, timeout=2)


def _joined_queue():
    items = queue.Queue()

    def work():
        while True:
            sleep(items.get())
            items.task_done()

    threading.Thread(target=work, daemon=True).start()
    items.put(1)
    items.put(2)
    items.join()


def _simple_queue():
    items = queue.SimpleQueue()
    _after(1, items.put, 'a')
    assert items.get() == 'a'
    with pytest.raises(queue.Empty):
        items.get(timeout=2)
    with pytest.raises(queue.Empty):
        items.get(block=False)


def _canceled_timer():
    timer = threading.Timer(3, pytest.fail)
    timer.start()
    sleep(1)
    timer.cancel()
    timer.join()
    sleep(2)


def _pool_time_out():
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(sleep, 3)
        with pytest.raises(TimeoutError):
            future.result(timeout=1)
        done, _ = wait_for_futures([future], timeout=1)
        assert not done


def _asyncio_sleeps():
    async def main():
        await asyncio.gather(asyncio.sleep(3), asyncio.sleep(2))
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.Event().wait(), 0)

    asyncio.run(main())


def _asyncio_to_thread():
    async def main():
        await asyncio.gather(asyncio.to_thread(sleep, 3), asyncio.to_thread(sleep, 1))

    asyncio.run(main())


def _asyncio_from_a_thread():
    async def main():
        event = asyncio.Event()
        _after(3, asyncio.get_running_loop().call_soon_threadsafe, event.set)
        await event.wait()

    asyncio.run(main())


def _pipes(wait):
    source, sink = os.pipe()
    try:
        _after(3, os.write, sink, b'a')
        wait(source)
        assert os.read(source, 1) == b'a'
    finally:
        os.close(source)
        os.close(sink)


def _select():
    def wait(source):
        assert select.select([source], [], [], 1) == ([], [], [])
        assert select.select([source], [], []) == ([source], [], [])

    _pipes(wait)


def _poll():
    def wait(source):
        poll = select.poll()
        poll.register(source, select.POLLIN)
        assert poll.poll(1000) == []
        assert poll.poll() == [(source, select.POLLIN)]

    _pipes(wait)


def _epoll():
    def wait(source):
        with select.epoll() as epoll:
            epoll.register(source, select.EPOLLIN)
            assert epoll.poll(timeout=1, maxevents=2) == []
            assert epoll.poll(-1) == [(source, select.EPOLLIN)]

    _pipes(wait)


def _read_of_a_buffered_pipe():
    source, sink = os.pipe()
    _after(3, os.close, sink)
    with os.fdopen(source, 'rb') as file:
        assert file.read() == b''


def _sockets(receive):
    here, there = socket.socketpair()
    with here, there:
        _after(3, there.send, b'a\n')
        receive(here)


def _socket():
    def receive(here):
        here.settimeout(1)
        with pytest.raises(TimeoutError, match='timed out'):
            here.recv(1)
        here.settimeout(5)
        assert here.recvmsg(9)[0] == b'a\n'

    _sockets(receive)


def _server():
    def connect():
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(f'\0{__name__}{os.getpid()}')

    with socket.socket(socket.AF_UNIX) as server:
        server.bind(f'\0{__name__}{os.getpid()}')
        server.listen()
        client = _after(3, connect)
        server.accept()[0].close()
        client.join()


def _selector():
    def wait(source):
        with selectors.SelectSelector() as selector:
            selector.register(source, selectors.EVENT_READ)
            assert selector.select(1) == []

    _pipes(wait)


def _thread_join():
    thread = threading.Thread(target=sleep, args=(3,))
    thread.start()
    thread.join(1)
    assert thread.is_alive()
    thread.join()
    assert not thread.is_alive()
    thread.join()


def _low_level_thread():
    ended = threading.Event()

    def run(seconds, *, then):
        sleep(seconds)
        then()

    _thread.start_new_thread(run, (3,), {'then': ended.set})
    ended.wait()


_WAITS = [
    each
    for name, each in list(globals().items())
    if name.startswith('_')
    and name not in {'_after', '_pipes', '_sockets'}
    and callable(each)
    and getattr(each, '__module__', '') == __name__
]


@pytest.mark.parametrize('wait', _WAITS, ids=lambda each: each.__name__[1:])
def test_a_wait_takes_virtual_time(wait):
    """Each of the functions above takes three seconds of it."""
    with virtual_time() as threads:
        wait()
        assert threads.now_ns == 3_000_000_000


@pytest.mark.parametrize('wait', _WAITS, ids=lambda each: each.__name__[1:])
def test_a_shuffled_wait_takes_as_long(wait):
    for seed in range(2):
        with virtual_time(seed) as threads:
            wait()
            assert threads.now_ns == 3_000_000_000


def test_a_process_takes_no_virtual_time():
    command = [sys.executable, '-c', 'import sys; print(sys.stdin.read())']
    with virtual_time() as threads:
        # A wait for what it prints, and one for its end alone.
        ended = subprocess.run(
            command, input='heard', capture_output=True, text=True, check=True, timeout=60
        )
        with subprocess.Popen(command, stdin=subprocess.DEVNULL) as process:
            assert process.wait(60) == 0
        assert threads.now_ns == 0
    assert ended.stdout == 'heard\n'
