"""A thread that checks the system periodically."""

import pytest

pytest.importorskip('rclpy')

from composer.runtime.health import watcher as watching
from composer.runtime.health.watcher import Watcher


def test_a_finding_is_logged_once_and_looking_goes_on(monkeypatch, wait_for):
    logged, looks = [], []
    monkeypatch.setattr(watching.system_logger, 'error', logged.append)

    def look():
        looks.append(1)
        raise ValueError

    watch = Watcher('watch', look, 0.001)
    watch.start()
    wait_for(lambda: len(looks) > 3, 'looks after the first finding')
    watch.stop()

    assert len(logged) == 1
    assert logged[0].endswith('\nValueError')
