"""What a system is read into before it runs, and again after each edit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.language.specs import SystemSpec
    from composer.planning.snapshot import Snapshot
    from composer.yaml_text.positions import SourceMap


@record
class Reading:
    """A system without errors, with its behaviours imported.

    Attributes:
        positions: Where the parts of `spec` were written.
        functions: The behaviours, by their names.
        snapshot: What it is compared by.
    """

    spec: SystemSpec
    positions: SourceMap
    functions: Mapping[str, Callable[..., Any]]
    snapshot: Snapshot
