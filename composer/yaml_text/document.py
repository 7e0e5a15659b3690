"""A YAML document on its way to a system: its data, and what is known of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, Span
    from composer.yaml_text.positions import DataPath, SourceMap


@dataclass(slots=True)
class Document:
    """What has been read so far; every step works on the same record.

    Attributes:
        data: Mappings, lists and scalars of the core schema; `None` if nothing could be read.
        diagnostics: The findings so far.
        dropped: The paths of data that were left out because of an error.
        left_out: The paths of entries whose `when` does not hold; they are still in the data.
        sampled: Where values depend on samples of arguments: a finding there need not hold for
            the real values.
        sampled_paths: The paths of these values; keys are not in it.
        notes: Where the values that the expressions of a scalar use come from, by its path.
    """

    data: dict[str, Any] | None
    positions: SourceMap
    diagnostics: list[Diagnostic] = field(default_factory=list)
    dropped: set[DataPath] = field(default_factory=set)
    left_out: set[DataPath] = field(default_factory=set)
    sampled: list[Span] = field(default_factory=list)
    sampled_paths: set[DataPath] = field(default_factory=set)
    notes: dict[DataPath, str] = field(default_factory=dict)


def count_values(data: Any) -> int:
    """Return how many keys and values there are in data, itself included."""
    if isinstance(data, dict):
        return 1 + len(data) + sum(map(count_values, data.values()))
    return 1 + sum(map(count_values, data)) if isinstance(data, list) else 1


def copy_data(data: Any) -> Any:
    """Return a copy in which nothing is shared: aliases and a file included twice share data."""
    if isinstance(data, dict):
        return {key: copy_data(value) for key, value in data.items()}
    return [copy_data(item) for item in data] if isinstance(data, list) else data
