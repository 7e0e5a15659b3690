"""What tests of virtual time share: functions that run in it, without ROS."""

from contextlib import contextmanager
from random import Random

from composer.virtual_time.replacements import replaced
from composer.virtual_time.simulated_threads import SimulatedThreads

# 2020-01-01 00:00 UTC.
START_NS = 1_577_836_800_000_000_000


@contextmanager
def virtual_time(seed=None, limit_sec=20.0):
    """Let the calling thread take turns with those that it starts, meanwhile."""
    threads = SimulatedThreads(None if seed is None else Random(seed), limit_sec)
    with replaced(threads, START_NS, seed or 0), threads.entered():
        try:
            yield threads
        finally:
            threads.close()
