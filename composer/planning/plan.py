"""A plan as data: the operations that turn one system into another."""

from __future__ import annotations

from collections import Counter
from enum import Enum
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.names import count_of
from composer.records import record

if TYPE_CHECKING:
    from composer.diagnostics import Span

# What a plan is about: the full name of a node (empty for processes and the system itself), the
# section, and the name in it.
Target: TypeAlias = tuple[str, str, str]


class Action(Enum):
    """What is done to a part of a system; the value is the sign that stands for it."""

    ADD = '+'
    CHANGE = '~'
    RECREATE = '±'
    REMOVE = '-'


# After these there is no more of what was there, and after those there is something new.
GOING = (Action.RECREATE, Action.REMOVE)
COMING = (Action.RECREATE, Action.ADD)
_MOST_REBUILT = 8
_NAMED = ('nodes', 'components', 'processes', 'workers')


@record
class Change:
    """One value that differs.

    Attributes:
        key: As in the file, with dots for what is nested: `qos.depth`.
        old: What it was, as data; `None` if it was not there.
        new: What it becomes; `None` if it goes.
        old_span: Where the old value was written, `None` if it was not in a file.
        new_span: Where the new one is written.
        is_code: Whether the source of this behaviour differs, not what the file says of it.
    """

    key: str
    old: Any = None
    new: Any = None
    old_span: Span | None = None
    new_span: Span | None = None
    is_code: bool = False

    @property
    def top_key(self) -> str:
        """The first part of its key."""
        return self.key.partition('.')[0]


@record
class Operation:
    """What is done to one part of a system.

    Attributes:
        noun: What it is: `node`, `timer`, `process`, `system`, …
        target: Which one it is.
        name: Its key in the file.
        span: Where it is written: in the new files, unless it is removed.
        changes: The values that differ.
        reason: Why it must be recreated; empty if it need not be.
        lost: What does not survive.
        notes: What else its reader should know.
    """

    action: Action
    noun: str
    target: Target
    name: str
    span: Span
    changes: tuple[Change, ...] = ()
    reason: str = ''
    lost: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


@record
class Plan:
    """All operations: on the system, its processes, and its nodes with their entities."""

    name: str
    operations: tuple[Operation, ...]

    def __bool__(self) -> bool:
        """Tell whether there is anything to do."""
        return bool(self.operations)

    def summarize(self) -> str:
        """Return `~1 timer, +2 subscriptions`."""
        counts = Counter((each.action, each.noun) for each in self.operations)
        return ', '.join(
            f'{action.value}{count_of(count, noun)}' for (action, noun), count in counts.items()
        )

    def describe_rebuilt(self) -> str:
        """Return `; rebuilt: node 'arm' (lost: its state)`; entities are only counted."""
        rebuilt = [
            each
            for each in self.operations
            if each.action is Action.RECREATE and each.target[1] in _NAMED
        ]
        texts = [
            f"{each.noun} '{each.name}'"
            + (f' (lost: {", ".join(each.lost)})' if each.lost else '')
            for each in rebuilt[:_MOST_REBUILT]
        ]
        more = len(rebuilt) - len(texts)
        texts += [f'and {more} more'] * (more > 0)
        return f'; rebuilt: {", ".join(texts)}' if texts else ''

    def counts(self) -> dict[Action, int]:
        """Return how many operations there are of each kind, in the order of `Action`."""
        counter = Counter(each.action for each in self.operations)
        return {action: counter[action] for action in Action}
