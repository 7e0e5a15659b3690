"""Results → a table for people and a file for programs."""

import os
import platform
import statistics
from dataclasses import asdict, dataclass, field
from importlib import metadata
from typing import Any

from benchmarks.rows import Job, Row

_RCLPY_PACKAGES = ('ros-rclpy', 'rclpy')


@dataclass(slots=True)
class Rounds:
    """What the rounds of a job came to: figures, or None for a round that failed."""

    figures: list[dict[str, float] | None] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Result:
    """A row and what was measured for it.

    Attributes:
        ours: The median of the rounds, as `other`.
        figure: The median of the figures of each round, whose sides were measured in turn.
        rounds: Ours and the other's of each round.
        error: Why there is no figure.
    """

    row: Row
    ours: float | None
    other: float | None
    figure: float | None
    rounds: list[tuple[float, float | None]]
    error: str = ''

    @property
    def reached(self) -> bool:
        """Whether the promise is kept."""
        if self.figure is None:
            return False
        target = self.row.target
        return self.figure >= target if self.row.sense == '>=' else self.figure <= target


def evaluate(row: Row, measured: dict[Job, Rounds]) -> Result:
    """Return the result of a row; rounds of which a side failed do not count."""
    sides = [row.ours] + ([row.other] if row.other else [])
    columns = [
        [
            None if figures is None else figures.get(side.key)
            for figures in measured[side.job].figures
        ]
        for side in sides
    ]
    complete = [values for values in zip(*columns, strict=False) if None not in values]
    if not complete:
        errors = [error for side in sides for error in measured[side.job].errors]
        return Result(row, None, None, None, [], errors[0] if errors else 'no such figure')
    rounds = [(values[0], values[1] if row.other else None) for values in complete]
    figure = statistics.median(row.figure(ours, other or 0.0) for ours, other in rounds)
    ours = statistics.median(ours for ours, _ in rounds)
    other = statistics.median(other for _, other in rounds) if row.other else None
    return Result(row, ours, other, figure, rounds)


def render_table(results: list[Result]) -> str:
    """Return a line for each result."""
    width = max(len('what'), *(len(result.row.what) for result in results))
    lines = [f'{"what":<{width}} {"ours":>9} {"other":>9} {"figure":>9}  target']
    for result in results:
        row = result.row
        numbers = ' '.join(_number(n) for n in (result.ours, result.other, result.figure))
        verdict = 'ok' if result.reached else 'MISSED'
        if result.error:
            verdict = f'FAILED: {result.error}'
        lines.append(f'{row.what:<{width}} {numbers}  {row.sense} {row.target:g} {verdict}')
    return '\n'.join(lines)


def to_json(results: list[Result], settings: dict[str, Any]) -> dict[str, Any]:
    """Return all of it as data: the machine, the settings, and a record for each row."""
    return {
        'machine': describe_machine(),
        'settings': settings,
        'rows': [_record(result) for result in results],
    }


def describe_machine() -> dict[str, Any]:
    """Return what figures depend on."""
    from rclpy.utilities import get_rmw_implementation_identifier

    return {
        'cpus': os.cpu_count(),
        'load_average': os.getloadavg(),
        'platform': platform.platform(),
        'python': platform.python_version(),
        'rclpy': _rclpy_version(),
        'rmw': get_rmw_implementation_identifier(),
    }


def _rclpy_version() -> str | None:
    for name in _RCLPY_PACKAGES:
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return None


def _record(result: Result) -> dict[str, Any]:
    row = result.row
    return {
        'what': row.what,
        'jobs': [asdict(job) for job in row.jobs],
        'ours': result.ours,
        'other': result.other,
        'figure': result.figure,
        'sense': row.sense,
        'target': row.target,
        'reached': result.reached,
        'error': result.error or None,
        'rounds': result.rounds,
    }


def _number(value: float | None) -> str:
    if value is None:
        return f'{"":>9}'
    return f'{value:>9,.0f}' if abs(value) >= 1000 else f'{value:>9.2f}'
