"""Run the executor's benchmarks: both sides in one run, a table, and a JSON file.

python -m benchmarks.run [--rounds 3] [--soak-sec 60] [--json build/bench.json]
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

_IDLE = (0, 10, 50, 200)
_TIMEOUT_SEC = 60.0


def measure(what: str, name: str, idle: int, *, soak_sec: float, rounds: int) -> dict[str, float]:
    """Return the median of each figure over `rounds` processes."""
    environment = {
        **os.environ,
        'COMPOSER_SOAK_SEC': str(soak_sec),
        'ROS_DOMAIN_ID': str(120 + os.getpid() % 80),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    }
    results = []
    for _ in range(rounds):
        done = subprocess.run(  # noqa: S603 (this very program)
            [sys.executable, '-m', 'benchmarks.measure', what, name, str(idle)],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
            timeout=_TIMEOUT_SEC + soak_sec + idle * 0.1,
        )
        results.append(json.loads(done.stdout.splitlines()[-1]))
    return {key: statistics.median(result[key] for result in results) for key in results[0]}


def row(
    what: str, ours: float, theirs: float | None, target: float, *, most: bool
) -> dict[str, Any]:
    """Return one row; `target` is for the ratio if there is another side, else for `ours`."""
    figure = ours if theirs is None else ours / theirs if theirs else float('inf')
    reached = figure <= target if most else figure >= target
    return {
        'what': what,
        'ours': ours,
        'theirs': theirs,
        'figure': figure,
        'target': target,
        'most': most,
        'reached': reached,
    }


def collect(rounds: int, soak_sec: float) -> list[dict[str, Any]]:
    """Measure everything."""

    def take(what: str, name: str, idle: int = 0) -> dict[str, float]:
        times = 1 if what == 'soak' else rounds
        return measure(what, name, idle, soak_sec=soak_sec, rounds=times)

    rates = {
        (name, idle): take('round_trips', name, idle)['rate']
        for idle in _IDLE
        for name in ('composer', 'multi', 'single', 'events')
    }
    rows = []
    for idle in _IDLE:
        ours = rates['composer', idle]
        beside = f'round trips/s, {idle} idle nodes, against'
        rows += [
            row(
                f'{beside} MultiThreadedExecutor',
                ours,
                rates['multi', idle],
                300 if idle == 200 else 3,
                most=False,
            ),
            row(f'{beside} SingleThreadedExecutor', ours, rates['single', idle], 3, most=False),
            row(f'{beside} EventsExecutor', ours, rates['events', idle], 0.5, most=False),
        ]
    ours = rates['composer', 0]
    rows.append(
        row(
            'round trips/s, 200 idle nodes against 0',
            rates['composer', 200],
            ours,
            0.9,
            most=False,
        )
    )
    rows.append(
        row(
            'round trips/s, 1,000 plain nodes against 0',
            take('many_nodes', 'composer', 1000)['rate'],
            ours,
            0.85,
            most=False,
        )
    )
    rows.append(
        row(
            'idle CPU of 200 nodes, % of a core',
            take('idle_cpu', 'composer', 200)['percent'],
            None,
            2,
            most=True,
        )
    )
    late = take('jitter', 'composer')
    rows.append(
        row(
            '100 Hz timer beside full load, p99 ms, against bare threads',
            late['p99_ms'],
            take('jitter', 'threads')['p99_ms'],
            1.2,
            most=True,
        )
    )
    rows.append(row('100 Hz timer beside full load, p99 ms', late['p99_ms'], None, 6, most=True))
    rows.append(row('100 Hz timer beside full load, ticks lost', late['lost'], None, 0, most=True))
    soak = take('soak', 'composer')
    rows.append(
        row(
            f'{soak_sec:.0f} s at 1,000 messages/s, MB grown', soak['grown_mb'], None, 2, most=True
        )
    )
    rows.append(
        row(f'{soak_sec:.0f} s at 1,000 messages/s, lost', soak['lost'], None, 0, most=True)
    )
    return rows


def render(rows: list[dict[str, Any]]) -> str:
    """Return the table."""
    lines = [f'{"what":<66} {"ours":>10} {"other":>10} {"figure":>9} target']
    for one in rows:
        theirs = '' if one['theirs'] is None else f'{one["theirs"]:.0f}'
        sign = '<=' if one['most'] else '>='
        mark = 'ok' if one['reached'] else 'MISSED'
        lines.append(
            f'{one["what"]:<66} {one["ours"]:>10.1f} {theirs:>10} {one["figure"]:>9.2f} '
            f'{sign} {one["target"]:g} {mark}'
        )
    return '\n'.join(lines)


def main() -> int:
    """Run it all; returns 1 if a target is missed."""
    parser = argparse.ArgumentParser()
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--soak-sec', type=float, default=60.0)
    parser.add_argument('--json', type=Path, default=Path('build/bench.json'))
    options = parser.parse_args()
    rows = collect(options.rounds, options.soak_sec)
    print(render(rows))
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(rows, indent=2) + '\n')
    return 0 if all(one['reached'] for one in rows) else 1


if __name__ == '__main__':
    sys.exit(main())
