"""How far a clock is off is measured by the shortest of several round trips."""

import asyncio
import time

import pytest

from composer.network.clock_skew import describe_skew, measure_skew


class _Host:
    """Answers as a host whose clock is ahead, over a line that is slow one way now and then."""

    def __init__(self, ahead_sec, delays_sec):
        self._ahead_ns = int(ahead_sec * 1e9)
        self._delays = iter(delays_sec)

    async def call(self, operation):
        assert operation == 'clock'
        await asyncio.sleep(next(self._delays))
        return time.time_ns() + self._ahead_ns


@pytest.mark.parametrize('ahead_sec', [-3.0, 0.0, 0.2])
def test_what_is_slow_one_way_does_not_count(ahead_sec):
    host = _Host(ahead_sec, [0.2, 0.3, 0.0, 0.25, 0.2, 0.2, 0.3, 0.2])
    skew, error = asyncio.run(measure_skew(lambda: host.call('clock')))
    assert abs(skew - ahead_sec) <= error + 0.001


@pytest.mark.parametrize(
    ('skew', 'error', 'warning'),
    [
        (0.049, 0.0, None),
        (0.06, 0.02, None),
        (
            0.2,
            0.01,
            'the clock of host base is 200 ms ahead of the one here: let both follow the same NTP server, as chrony and systemd-timesyncd do',
        ),
        (
            -2.0,
            0.01,
            'the clock of host base is 2000 ms behind the one here: let both follow the same NTP server, as chrony and systemd-timesyncd do',
        ),
    ],
)
def test_only_what_is_certain_is_told(skew, error, warning):
    assert describe_skew('base', skew, error) == warning
