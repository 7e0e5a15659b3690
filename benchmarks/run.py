"""Measure all rows: both sides in one run, a table, and a JSON file.

python -m benchmarks.run [--only REGEX] [--rounds 3] [--quick] [--soak-sec 60] [--json FILE]

The soak takes 60 s by default; 300 is for a release, 3600 for the hour that is promised.
"""

import argparse
import json
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from benchmarks.measure import SUBJECTS
from benchmarks.processes import MeasurementError, run_job
from benchmarks.report import Result, Rounds, evaluate, render_table, to_json
from benchmarks.rows import ROWS, Job, Row

_QUICK_SHARE = 0.25
_QUICK_SOAK_SEC = 5.0


def measure_all(rows: Iterable[Row], rounds: int, seconds: dict[str, float]) -> list[Result]:
    """Measure what `rows` need, each job once a round, and evaluate them.

    Args:
        seconds: How long to measure, by subject.
    """
    rows = list(rows)
    subjects: dict[str, dict[Job, Rounds]] = {}
    for job in (job for row in rows for job in row.jobs):
        subjects.setdefault(job.subject, {}).setdefault(job, Rounds())
    for subject, jobs in subjects.items():
        for number in range(min(rounds, SUBJECTS[subject].most_rounds)):
            for job, outcome in jobs.items():
                _measure_once(job, outcome, seconds[subject], number)
    measured = {job: outcome for jobs in subjects.values() for job, outcome in jobs.items()}
    return [evaluate(row, measured) for row in rows]


def _measure_once(job: Job, outcome: Rounds, seconds: float, number: int) -> None:
    name = f'{job.subject} {job.side} {job.size}'
    if outcome.errors:
        outcome.figures.append(None)  # It would fail again, and a timeout takes long.
        return
    try:
        figures = run_job(job, seconds)
    except MeasurementError as error:
        outcome.figures.append(None)
        outcome.errors.append(f'{name}: {error}')
        print(f'  {name}: {error}', file=sys.stderr, flush=True)
        return
    outcome.figures.append(figures)
    values = ', '.join(f'{key} {value:.4g}' for key, value in figures.items())
    print(f'  {name}, round {number + 1}: {values}', file=sys.stderr, flush=True)


def main(words: list[str] | None = None) -> int:
    """Run it; returns 1 if a target is missed or a measurement failed."""
    options = _parse(words)
    pattern = re.compile(options.only)
    rows = [
        row for row in ROWS if pattern.search(row.what) or pattern.search(row.ours.job.subject)
    ]
    if not rows:
        print(f"no row and no subject matches '{options.only}'", file=sys.stderr)
        return 2
    share = _QUICK_SHARE if options.quick else 1.0
    seconds = {name: subject.seconds * share for name, subject in SUBJECTS.items()}
    seconds['soak'] = options.soak_sec or (_QUICK_SOAK_SEC if options.quick else 60.0)
    rounds = options.rounds or (1 if options.quick else 3)
    results = measure_all(rows, rounds, seconds)
    print(render_table(results))
    report = to_json(results, {'rounds': rounds, 'seconds': seconds})
    options.json.parent.mkdir(parents=True, exist_ok=True)
    options.json.write_text(json.dumps(report, indent=2) + '\n')
    return 0 if all(result.reached for result in results) else 1


def _parse(words: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog='python -m benchmarks.run', description=__doc__)
    parser.add_argument('--only', metavar='REGEX', default='', help='rows or subjects')
    parser.add_argument('--rounds', type=int, help='3, or 1 if quick')
    parser.add_argument('--quick', action='store_true', help='short and rough')
    parser.add_argument('--soak-sec', type=float, help='60, or 5 if quick')
    parser.add_argument('--json', type=Path, default=Path('build/bench.json'), metavar='FILE')
    return parser.parse_args(words)


if __name__ == '__main__':
    sys.exit(main())
