"""What did not come as expected, as data."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from composer.yaml_text.positions import DataPath


@record
class Failure:
    """An expectation that does not hold, a step with another outcome, or an unexpected error.

    Attributes:
        path: Where it stands in the scenario file; that of the case for an unexpected error.
        message: What was expected, and what happened, in one line.
        diff: Lines: `-` before what was expected, `+` before what was there; or a traceback.
        time_ns: The moment around which the events matter; `None` if no moment does.
        names: The topics, services, actions and nodes that matter.
    """

    path: DataPath
    message: str
    diff: str = ''
    time_ns: int | None = None
    names: tuple[str, ...] = field(default=())
