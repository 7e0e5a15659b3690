"""What is left of a document when its expressions have been evaluated."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.yaml_text.positions import DataPath

# The sections whose entries may be repeated, and how many they may have unless a file says more.
SECTIONS = ('nodes', 'include', 'processes')
MAX_ENTRIES = 10_000


@dataclass(slots=True)
class FilledDocument:
    """A document with the values of its expressions in place.

    Attributes:
        failed: The paths of the scalars that could not be evaluated.
        sampled: The paths of the scalars whose values hang on samples, and are not the real ones.
        sampled_spans: Where these and such keys are written.
        left_out: The paths of entries whose `when` does not hold.
        notes: Where the values that the expressions of a scalar use come from, by its path.
    """

    data: dict[str, Any]
    faults: list[Diagnostic] = field(default_factory=list)
    failed: list[DataPath] = field(default_factory=list)
    sampled: list[DataPath] = field(default_factory=list)
    sampled_spans: list[Span] = field(default_factory=list)
    left_out: set[DataPath] = field(default_factory=set)
    notes: dict[DataPath, str] = field(default_factory=dict)
