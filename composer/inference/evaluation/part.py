"""What the parts of an evaluator have in common."""

from __future__ import annotations

from typing import Any


class Part:
    """A part of an evaluator, which reaches the other parts through it.

    Args:
        evaluator: The `Evaluator`; by no closer type, as it imports all of its parts.
    """

    def __init__(self, evaluator: Any) -> None:
        self._evaluator = evaluator
