"""Waits of behaviours beside a stop of the system."""

import queue
from contextlib import nullcontext
from functools import partial
from types import SimpleNamespace

import pytest

pytest.importorskip('rclpy')

from rclpy.task import Future

from composer.errors import SystemStoppingError
from composer.runtime.behaviours.waits import Waits
from composer.runtime.stop_request import StopRequest

pytestmark = pytest.mark.ros


@pytest.fixture
def waits():
    return Waits(SimpleNamespace(waiting=nullcontext), StopRequest())


def test_a_wait_without_an_end_does_not_begin_when_the_system_stops(waits):
    waits.stop.make()
    with pytest.raises(SystemStoppingError):
        waits.until_done(Future(), None)


def test_nor_does_one_of_a_coroutine(waits):
    waits.stop.make()
    with pytest.raises(SystemStoppingError):
        waits.until_done_async(Future(), None).send(None)


def test_nor_does_one_for_the_next_item_of_a_queue(waits):
    items = queue.SimpleQueue()
    items.put('feedback')
    assert waits.until_next(items) == 'feedback'
    waits.stop.make()
    with pytest.raises(SystemStoppingError):
        waits.until_next(items)


def test_a_stop_ends_waits_that_begin_at_any_moment_before_it(waits):
    """A stop between the look at it and the wait was lost."""
    waits.stop.add_callback = partial(stop_first, waits.stop, waits.stop.add_callback)
    with pytest.raises(SystemStoppingError):
        waits.until_done(Future(), None)


def stop_first(stop, add_callback, wake):
    stop.make()
    return add_callback(wake)


def test_one_with_an_end_does_for_what_must_be_switched_off(waits):
    waits.stop.make()
    assert not waits.until_done(Future(), 0.01)


def test_what_is_done_is_returned_all_the_same(waits):
    waits.stop.make()
    future = Future()
    future.set_result(1)
    assert waits.until_done(future, None)
