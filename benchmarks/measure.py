"""One measurement in this process; prints a JSON object with its figures.

python -m benchmarks.measure SUBJECT SIDE SIZE [SECONDS]
python -m benchmarks.measure round_trips composer 200
"""

import importlib
import json
import os
import sys
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Subject:
    """Something that can be measured.

    Attributes:
        module: Has a function `measure(side, size, seconds)`, which returns figures by name.
        seconds: How long it measures, if nobody says otherwise; starting and settling are extra.
        most_rounds: More would only take long.
    """

    module: str
    seconds: float = 0.0
    most_rounds: int = 99


SUBJECTS = {
    'round_trips': Subject('benchmarks.round_trips', 2.0),
    'calls': Subject('benchmarks.calls', 2.0),
    'large_messages': Subject('benchmarks.large_messages', 3.0),
    'nobody': Subject('benchmarks.nobody', 1.0),
    'recording': Subject('benchmarks.recording', 4.0),
    'foxglove_bridge': Subject('benchmarks.foxglove_bridge', 6.0),
    # A page that is closed asks each 10 s.
    'page': Subject('benchmarks.page', 10.0),
    'simulated': Subject('benchmarks.simulated', 5.0),
    'overhead': Subject('benchmarks.message_overhead'),
    'forty': Subject('benchmarks.forty'),
    'further_node': Subject('benchmarks.further_node'),
    # rclpy takes minutes to make so many nodes.
    'start_stop': Subject('benchmarks.start_stop', 60.0, most_rounds=1),
    'thousand': Subject('benchmarks.thousand', 3.0),
    'workers': Subject('benchmarks.workers', 8.0),
    'worker_hops': Subject('benchmarks.worker_hops', 4.0),
    'jitter': Subject('benchmarks.jitter', 6.0),
    'idle_cpu': Subject('benchmarks.idle_cpu', 5.0),
    'check': Subject('benchmarks.checking', most_rounds=2),
    'save_to_callback': Subject('benchmarks.save_to_callback', 10.0, most_rounds=2),
    'reloads': Subject('benchmarks.reloads', 100.0, most_rounds=1),
    'soak': Subject('benchmarks.soak', 60.0, most_rounds=1),
}


def measure(subject: str, side: str, size: int, seconds: float | None = None) -> dict[str, float]:
    """Return the figures of one side of a subject."""
    chosen = SUBJECTS[subject]
    module = importlib.import_module(chosen.module)
    figures: dict[str, float] = module.measure(
        side, size, chosen.seconds if seconds is None else seconds
    )
    return figures


if __name__ == '__main__':
    subject_name, side_name, size_text, *rest = sys.argv[1:]
    figures = measure(subject_name, side_name, int(size_text), float(rest[0]) if rest else None)
    print(json.dumps(figures), flush=True)
    os._exit(0)  # Executors still spin in threads.
