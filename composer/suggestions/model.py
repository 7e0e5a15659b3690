"""What a split costs: how busy its busiest process is, and how much it can do.

The figures of a message that crosses between processes are the processor time of a plain rclpy
node for a `sensor_msgs/msg/Image`, Fast DDS with shared memory, on an AMD EPYC of 2021. What has
them measured is `python -m benchmarks.crossing_cost sending 1000000` (bytes), and `taking` for
the other side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from composer.suggestions.loads import Flow, SystemLoad

# The worker of each node, by full names; `''` for the process of the system.
Split: TypeAlias = 'Mapping[str, str]'

# Seconds for a message, and for each byte of it, on each side.
SEND_SEC, SEND_SEC_PER_BYTE = 0.00025, 0.85e-9
TAKE_SEC, TAKE_SEC_PER_BYTE = 0.00045, 2.9e-9
# A process does not run before the others let it: nobody gets all of a core.
_MOST_OF_A_CORE = 0.95


@record
class Cost:
    """What a split needs to do what was done while the system was measured.

    Attributes:
        busiest: How much of a core the busiest process uses, or the share of all cores that is
            used, whichever is more. More than 1 cannot be.
        cpu: How many processors all of it uses.
        crossing: How many of these go into messages between processes.
        by_worker: How much of a core the callbacks of each process use.
    """

    busiest: float
    cpu: float
    crossing: float
    by_worker: Mapping[str, float]


def cost_of(load: SystemLoad, split: Split) -> Cost:
    """Return what a split costs."""
    used = dict.fromkeys(sorted(set(split.values())), 0.0)
    for node in load.nodes:
        used[split[node.name]] += min(1.0, node.cpu)
    crossing = 0.0
    for worker, seconds in _crossings(load, split):
        used[worker] += seconds
        crossing += seconds
    cpu = max(0.0, sum(node.cpu for node in load.nodes) + crossing)
    # A node's own callbacks mostly exclude each other.
    longest = max((node.cpu for node in load.nodes), default=0.0)
    busiest = max(*used.values(), cpu / load.free_cores, min(longest, 1.0)) if used else 0.0
    return Cost(busiest, cpu, crossing, used)


def _crossings(load: SystemLoad, split: Split) -> Iterable[tuple[str, float]]:
    """Yield what messages cost that cross, less those that crossed while it was measured."""
    present = load.present
    for sign, workers in ((1.0, split), (-1.0, present)):
        sent: set[tuple[str, str]] = set()
        for flow in load.flows:
            if not _crosses(flow, workers):
                continue
            yield split[flow.sink], sign * flow.rate_hz * take_sec(flow.size)
            # It is sent once, however many processes get it.
            if (flow.source, flow.topic) not in sent:
                sent.add((flow.source, flow.topic))
                yield split[flow.source], sign * flow.rate_hz * send_sec(flow.size)


def _crosses(flow: Flow, workers: Split) -> bool:
    # What is never handed over costs the same everywhere.
    return flow.is_local and workers[flow.source] != workers[flow.sink]


def send_sec(size: float) -> float:
    """Return the processor time of sending a message to another process.

    Args:
        size: In bytes.
    """
    return SEND_SEC + SEND_SEC_PER_BYTE * size


def take_sec(size: float) -> float:
    """Return the processor time of taking a message from another process."""
    return TAKE_SEC + TAKE_SEC_PER_BYTE * size


def throughput(load: SystemLoad, cost: Cost) -> float:
    """Return how many times as much can be done as was done, but no more than there is to do."""
    capacity = _MOST_OF_A_CORE / cost.busiest if cost.busiest else float('inf')
    return max(1.0, min(capacity, load.demand))


def gain_of(load: SystemLoad, split: Split) -> float:
    """Return the throughput with a split, in times of that without it."""
    before = throughput(load, cost_of(load, load.present))
    after = throughput(load, cost_of(load, split))
    return 1.0 if after == before else after / before
