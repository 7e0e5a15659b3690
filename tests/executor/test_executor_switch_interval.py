"""The interpreter's switch interval is short while an executor spins, and only then."""

import sys

import pytest

pytest.importorskip('rclpy')

from composer.executor.switch_interval import INTERVAL_SEC, ShortSwitchInterval

DEADLINE_SEC = 90.0


@pytest.fixture(autouse=True)
def interval_is_pythons_own():
    before = sys.getswitchinterval()
    sys.setswitchinterval(0.005)
    yield
    sys.setswitchinterval(before)


def test_the_interval_is_short_until_the_last_user_has_left():
    interval = ShortSwitchInterval()
    with interval:
        with interval:
            pass
        assert sys.getswitchinterval() == INTERVAL_SEC
    assert sys.getswitchinterval() == 0.005


def test_an_interval_that_was_set_meanwhile_is_not_changed():
    interval = ShortSwitchInterval()
    with interval:
        sys.setswitchinterval(0.02)
    assert sys.getswitchinterval() == 0.02
    with interval:
        pass
    assert sys.getswitchinterval() == 0.02


@pytest.mark.ros
def test_callbacks_run_with_the_short_interval_and_the_end_of_spin_restores_it(executor):
    task = executor.create_task(sys.getswitchinterval)
    executor.spin_until_future_complete(task, DEADLINE_SEC)
    assert task.result() == INTERVAL_SEC
    assert sys.getswitchinterval() == 0.005
