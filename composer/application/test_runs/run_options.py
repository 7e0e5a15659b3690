"""The options of `composer test`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from pathlib import Path

DEFAULT_PATTERN = 'tests/**/*.scenario.yaml'
"""Of the files that run without a word."""


@record
class RunOptions:
    """The options of `composer test`.

    Attributes:
        expression: Of the names of cases to run; `None` for all.
        ends_early: Whether the first failure is the end.
        jobs: How many cases run at a time.
        seed: In place of those of the cases.
        shuffles: How many other orders to try.
        limit_sec: In place of the cases' limits of real time.
        trace: The file for the events of all cases.
        timeline: The file for a timeline of all cases.
        junit: The file for the report in the format of JUnit.
        format: `text`, `json` or `github`.
        shows_output: Whether output of behaviours is shown at once.
    """

    expression: str | None = None
    ends_early: bool = False
    jobs: int = 1
    seed: int | None = None
    shuffles: int = 0
    limit_sec: float | None = None
    trace: Path | None = None
    timeline: Path | None = None
    junit: Path | None = None
    format: str = 'text'
    shows_output: bool = False
    is_verbose: bool = False
    is_quiet: bool = False
