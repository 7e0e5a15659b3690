"""One reading under way: what all its parts share."""

from __future__ import annotations

import ast
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Span
from composer.inference.reading import NodeUse, Problem, Reading, StateUse
from composer.inference.values import (
    ANY,
    BY_RUN,
    BY_STATE,
    Constant,
    Place,
    Scalar,
    alternatives,
    is_chosen,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.inference.message_types import MessageTypes
    from composer.inference.module_names import ProjectModules
    from composer.inference.node_facts import NodeFacts
    from composer.inference.reading import Awaited
    from composer.inference.values import Argument, Primitive, Value

# What one behaviour may take: statements and expressions, helpers included.
_MOST_STEPS = 60_000


class TooLongError(Exception):
    """A behaviour is too long, or branches too often, to be followed."""


class Run:
    """A reading of one behaviour.

    Args:
        most_steps: How many steps it may take.

    Attributes:
        doubts: The number of conditions around the place that only the file decides.
        state_doubts: Those of them that hang on the state only.
        decided: The number of conditions around it of the file, whatever it says.
        guards: The number of statements around it that catch what a wrong name raises.
        broad_guards: The number of statements around it that catch everything.
        conditions: The number of conditions around it.
        dead_branches: The number of branches around it that the file never takes.
        tried: How often something was read that is right or wrong by what the file says.
        waits: Whether who calls the behaviour waits for the function under way.
        held_locks: The locks that are held, and where they were taken.
        probed: The names that a condition hangs on, while one is looked at.
        moves: How often something was read that changes by itself.
        changes: How often something that others hold, too, was changed.
        is_silent: Whether the place is read once more later.
        is_at_top: Whether what is made at the place lasts as long as its module.
        steps: How many steps it has taken.
    """

    def __init__(
        self, facts: NodeFacts, modules: ProjectModules, types: MessageTypes, most_steps: int
    ) -> None:
        self.facts = facts
        self.modules = modules
        self.types = types
        self.reading = Reading()
        self.doubts = 0
        self.state_doubts = 0
        self.decided = 0
        self.guards = 0
        self.broad_guards = 0
        self.payload_guards = 0
        self.conditions = 0
        self.dead_branches = 0
        self.tried = 0
        self.waits = True
        self.held_locks: list[tuple[Primitive, Place]] = []
        self.probed: set[Awaited] | None = None
        self.moves = 0
        self.changes = 0
        self.is_silent = False
        self.is_at_top = False
        self.steps = 0
        self._other_types = 0
        self._most_steps = min(most_steps, _MOST_STEPS)

    def decide(self, value: Value) -> None:
        """Note that a value decides on what is done, or with what."""
        if any(not isinstance(each, Constant) for each in alternatives(value)):
            chosen = is_chosen(value)
            self.reading.needs_values |= chosen > BY_RUN
            self.reading.needs_state |= chosen == BY_STATE

    def step(self) -> None:
        """Count a step.

        Raises:
            TooLongError: There were too many.
        """
        self.steps += 1
        if self.steps > self._most_steps:
            raise TooLongError

    @property
    def is_sure(self) -> bool:
        """Whether the place is reached, if not always, whatever the file says."""
        return self.doubts == self.state_doubts

    @property
    def is_certain(self) -> bool:
        """Whether what is used at the place has to be there."""
        return not (self.doubts or self.broad_guards)

    @property
    def standing(self) -> tuple[int, int, int]:
        """The counts that a statement may raise for those that follow it."""
        return self.doubts, self.state_doubts, self.decided

    @standing.setter
    def standing(self, counts: tuple[int, int, int]) -> None:
        self.doubts, self.state_doubts, self.decided = counts

    @contextmanager
    def condition(
        self, *, is_doubt: bool = False, chosen: int = 0, decided: bool = False
    ) -> Iterator[None]:
        """Note what is read meanwhile as read on a condition.

        Args:
            is_doubt: Whether the file decides on it; `chosen` says how.
            decided: Whether it is the file's.
        """
        self.conditions += 1
        self.doubt(chosen, int(is_doubt))
        self.decided += decided
        try:
            yield
        finally:
            self.conditions -= 1
            self.doubt(chosen, -int(is_doubt))
            self.decided -= decided

    def doubt(self, chosen: int, count: int = 1) -> None:
        """Note conditions, by how the file decides on them."""
        if chosen != BY_RUN:
            self.doubts += count
            self.state_doubts += count if chosen == BY_STATE else 0

    @contextmanager
    def guard(
        self, *, is_guard: bool, is_broad: bool = False, is_of_payloads: bool = False
    ) -> Iterator[None]:
        """Note what is read meanwhile as guarded, if it is."""
        self.guards += is_guard
        self.broad_guards += is_broad
        self.payload_guards += is_of_payloads
        try:
            yield
        finally:
            self.guards -= is_guard
            self.broad_guards -= is_broad
            self.payload_guards -= is_of_payloads

    @contextmanager
    def of_other_types(self, *, is_other: bool) -> Iterator[None]:
        """Leave alone which fields are read meanwhile, if they may be those of other types."""
        self._other_types += is_other
        try:
            yield
        finally:
            self._other_types -= is_other

    @contextmanager
    def afresh(self, *, is_guard: bool) -> Iterator[None]:
        """Read the top of a module meanwhile, on no condition of the place that needs it."""
        before = self.standing, self.guards, self.conditions
        flags = self.is_silent, self.is_at_top
        self.standing, self.guards = (0, 0, 0), int(is_guard)
        self.conditions, self.is_silent, self.is_at_top = 0, False, True
        try:
            yield
        finally:
            self.standing, self.guards, self.conditions = before
            self.is_silent, self.is_at_top = flags

    @contextmanager
    def dead_branch(self) -> Iterator[None]:
        """Report nothing meanwhile, and take what is used as nothing that is needed."""
        self.dead_branches += 1
        with self.silence():
            yield
        self.dead_branches -= 1

    @contextmanager
    def silence(self) -> Iterator[None]:
        """Report nothing meanwhile."""
        before, self.is_silent = self.is_silent, True
        try:
            yield
        finally:
            self.is_silent = before

    def report(
        self,
        rule: str,
        place: Place,
        message: str,
        help_text: str | None = None,
        *,
        used_at: Place | None = None,
        is_harm: bool = False,
        is_of_payload: bool = False,
    ) -> None:
        """Note a problem, unless the behaviour is ready for it.

        Where only the file decides whether the place is reached, it has to look like a typo: then
        `help_text` begins with what may have been meant.

        Args:
            used_at: Where the value is used that `place` wrote.
            is_harm: Whether it harms wherever it may be reached: nothing is raised.
            is_of_payload: Whether it is a field that a payload can never have: only who expects
                that is ready for it.
        """
        guards = self.payload_guards if is_of_payload else self.guards or self.broad_guards
        if self.is_silent or (guards and not is_harm):
            self.tried += 1
            return
        if self._other_types and rule == 'unknown-field':
            return
        if self.doubts and not is_harm and not (help_text or '').startswith('did you mean'):
            return
        span, used = span_of(place), span_of(used_at) if used_at else None
        if used and (used.source, used.line) == (span.source, span.line):
            used = None
        self.reading.problems.append(Problem(rule, message, span, help_text, used))

    def use(self, kind: str, name: str, place: Place, **details: Any) -> None:
        """Note the use of an entity by its name, with further attributes of `NodeUse`."""
        self.tried += 1
        self.reading.uses.append(
            NodeUse(
                kind,
                name,
                span_of(place, name),
                is_certain=self.is_certain,
                is_guarded=bool(self.guards or self.dead_branches),
                **details,
            )
        )

    def use_any(self, kind: str, name: Value, place: Place) -> None:
        """Note the use of an entity by a name of which at most a part is known."""
        self.reading.open_kinds.add(kind)
        if isinstance(name, Scalar) and name.pattern.strip(ANY):
            self.use(kind, name.pattern, place)

    def use_own_state(self, name: str, place: Place) -> None:
        """Note that a key of `node.own_state` is read."""
        use = StateUse(name, span_of(place, name), bool(self.guards or self.doubts))
        self.reading.own_state_read.append(use)

    def use_state(self, name: str, place: Place, *, is_guarded: bool = False) -> None:
        """Note that a name of `node.state` is read."""
        guarded = is_guarded or bool(self.guards or self.doubts or self.dead_branches)
        self.reading.state_read.append(StateUse(name, span_of(place, name), guarded))


def name_place(argument: Argument, value: Value) -> Place:
    """Return where a name is written: the constant itself, or where it is used."""
    origin = getattr(value, 'origin', None)
    return argument.place if origin is None or is_chosen(value) else origin


def span_of(place: Place, name: str = '') -> Span:
    """Return the characters of an expression on its last line; of a text, those of its content.

    Args:
        name: What to mark in it: the text, or the last name of a chain of attributes.
    """
    node, module = place.node, place.module
    first_line: int = getattr(node, 'lineno', 1)
    line: int = getattr(node, 'end_lineno', first_line)
    source = module.source
    text = source.line(line)
    start = getattr(node, 'col_offset', 0) if getattr(node, 'lineno', line) == line else 0
    end = getattr(node, 'end_col_offset', None) or start + 1
    first, last = _characters(text, start), _characters(text, end)
    if isinstance(node, ast.Attribute):
        name = node.attr
    elif isinstance(node, ast.keyword):
        first, last = _characters(text, node.col_offset), _characters(text, node.col_offset)
        last += len(node.arg or '')
        line = node.lineno
        return Span(source, line, first + 1, max(last - first, 1))
    elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        line, name = first_line, node.name
        text = source.line(line)
        first, last = 0, len(text)
    found = text[first:last].rfind(name) if name else -1
    if found >= 0:
        first += found
        last = first + len(name)
    return Span(source, line, first + 1, max(last - first, 1))


def _characters(line: str, offset: int) -> int:
    """Return the number of characters in the first `offset` bytes of a line."""
    return offset if line.isascii() else len(line.encode()[:offset].decode(errors='ignore'))
