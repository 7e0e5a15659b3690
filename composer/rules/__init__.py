"""The rules: what each finds, why it matters, and an example.

To add a rule, add a folder with its name:

- `rule.yaml`: its data, see `Rule`
- `bad.yaml`, `bad.txt`: a file that breaks this rule alone, and what Composer reports
- `good.yaml`: a file with nothing to report

`families.yaml` lists the families.
"""

from __future__ import annotations

from composer.records import record
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeAlias

RULES_FOLDER = Path(__file__).parent

Need: TypeAlias = Literal['interfaces', 'import', 'types']


class Severity(Enum):
    """The weight of a finding: an error stops `composer up`, a warning does not."""

    ERROR = 'error'
    WARNING = 'warning'


@record
class Rule:
    """A rule, as its `rule.yaml` describes it.

    Attributes:
        name: Its stable name, as findings show it; the name of its folder.
        family: The name of its family.
        severity: The severity of its findings.
        ignorable: Whether a comment may silence it. Without what the other rules check, nothing
            can start.
        meaning: What it finds.
        why: What ROS or Composer would do otherwise.
        needs: What it cannot check without: interface packages, or the import of behaviours.
        source: Where ROS (or YAML, or Python) says so.
    """

    name: str
    family: str
    severity: Severity
    ignorable: bool
    meaning: str
    why: str
    needs: Need | None = None
    source: str | None = None


@record
class Family:
    """Rules that check the same things.

    Attributes:
        name: One word.
        title: What its rules check.
        rules: By name.
    """

    name: str
    title: str
    rules: tuple[Rule, ...]


@cache
def list_rule_names() -> frozenset[str]:
    """Return the names of all rules; no data file is read."""
    return frozenset(path.parent.name for path in RULES_FOLDER.glob('*/rule.yaml'))


@cache
def load_rule(name: str) -> Rule:
    """Return a rule; only its own data file is read.

    Raises:
        FileNotFoundError: There is no rule of this name.
    """
    data = _read(RULES_FOLDER / name / 'rule.yaml')
    return Rule(name, **data | {'severity': Severity(data['severity'])})


@cache
def load_families() -> tuple[Family, ...]:
    """Return all families, with all rules."""
    rules = [load_rule(name) for name in sorted(list_rule_names())]
    return tuple(
        Family(**data, rules=tuple(rule for rule in rules if rule.family == data['name']))
        for data in _read(RULES_FOLDER / 'families.yaml')
    )


def _read(path: Path) -> Any:
    # Most commands have nothing to report, and some no other use for YAML.
    import yaml

    loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
    return yaml.load(path.read_bytes(), loader)  # noqa: S506 - a safe loader
