"""Waits of behaviours beside a stop of the system."""

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


def test_a_wait_of_a_coroutine_does_not_begin_when_the_system_stops(waits):
    waits.stop.make()
    with pytest.raises(SystemStoppingError):
        waits.until_done_async(Future(), None).send(None)


def test_a_stop_ends_waits_that_begin_at_any_moment_before_it(waits):
    """A stop between the look at it and the wait was lost."""
    waits.stop.add_callback = partial(stop_first, waits.stop, waits.stop.add_callback)
    with pytest.raises(SystemStoppingError):
        waits.until_done(Future(), None)


def stop_first(stop, add_callback, wake):
    stop.make()
    return add_callback(wake)
