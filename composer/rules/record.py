"""What is known of a rule beside the code that applies it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from composer.diagnostics import Severity

Need: TypeAlias = Literal['interfaces', 'import']


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule.

    Attributes:
        name: Its stable name, as findings show it.
        meaning: What it finds.
        why: What ROS or Composer would do otherwise.
        source: Where ROS (or YAML, or Python) says so.
        severity: The severity of its findings.
        needs: What it can tell nothing without: interface packages, or the import of behaviours.
        is_ignorable: Whether a comment may silence it; without what other rules look at, nothing
            can be started.
    """

    name: str
    meaning: str
    why: str
    source: str | None = None
    severity: Severity = Severity.ERROR
    needs: Need | None = None
    is_ignorable: bool = False


@dataclass(frozen=True, slots=True)
class Family:
    """Rules that look at the same things.

    Attributes:
        name: One word.
        title: What its rules look at.
        rules: In the order in which they are shown.
    """

    name: str
    title: str
    rules: tuple[Rule, ...]
