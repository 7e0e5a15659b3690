"""All rules, by family: what they mean and why; `composer/examples/<rule>/` shows each.

To add a rule: a row in its family's file, and such a folder with `bad.yaml`, `bad.txt` (what is
said of it) and `good.yaml`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.rules.behaviours import BEHAVIOURS
from composer.rules.comments import COMMENTS
from composer.rules.deadlock import DEADLOCK
from composer.rules.definitions import DEFINITIONS
from composer.rules.expressions import EXPRESSIONS
from composer.rules.fields import FIELDS
from composer.rules.includes import INCLUDES
from composer.rules.names import NAMES
from composer.rules.parameters import PARAMETERS
from composer.rules.processes import PROCESSES
from composer.rules.references import REFERENCES
from composer.rules.structure import STRUCTURE
from composer.rules.wiring import WIRING

if TYPE_CHECKING:
    from composer.rules.record import Family, Rule

FAMILIES: tuple[Family, ...] = (
    STRUCTURE,
    EXPRESSIONS,
    INCLUDES,
    NAMES,
    REFERENCES,
    BEHAVIOURS,
    FIELDS,
    PARAMETERS,
    WIRING,
    DEADLOCK,
    PROCESSES,
    DEFINITIONS,
    COMMENTS,
)

RULES: dict[str, Rule] = {rule.name: rule for family in FAMILIES for rule in family.rules}
FAMILY_OF: dict[str, Family] = {rule.name: family for family in FAMILIES for rule in family.rules}
