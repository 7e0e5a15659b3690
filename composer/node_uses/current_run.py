"""The reading of one behaviour under way: what is noted, and on which conditions."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from composer.node_uses.names import Texts
from composer.node_uses.reading import (
    CREATING_METHODS,
    SENDING_METHODS,
    Awaited,
    CreatedEntity,
    NodeUse,
    Problem,
    Reading,
)

if TYPE_CHECKING:
    import ast
    from collections.abc import Iterator

    from composer.diagnostics import Span
    from composer.node_uses.names import Chain, Made, Names, Scope, Value
    from composer.node_uses.reading import Waited
    from composer.python_source.modules import ModuleSource


class Run:
    """What all parts of a reading share.

    Attributes:
        doubts: The number of conditions around the place on which the file decides.
        state_doubts: Likewise, on which what is kept in the state does.
        held_states: The names of the state of which one of the latter is that they hold.
        fixed: Those of the first that hang on a constant, a type or the node's name.
        guards: The number of statements around it that catch what a wrong name raises.
        broad_guards: The number of statements around it that catch everything.
        held_locks: The locks that are held, and the lines where they were taken.
        calls: Where the functions under way are called.
    """

    def __init__(self, names: Names) -> None:
        self.names = names
        self.reading = Reading()
        self.doubts = 0
        self.state_doubts = 0
        self.fixed = 0
        self.held_states: tuple[str, ...] = ()
        self.guards = 0
        self.broad_guards = 0
        self.held_locks: list[tuple[Made, int]] = []
        self.calls: list[Span] = []

    @property
    def is_certain(self) -> bool:
        """Whether what is used at the place has to be there."""
        return not (self.doubts or self.state_doubts or self.broad_guards)

    @property
    def standing(self) -> tuple[int, int, int, tuple[str, ...]]:
        """The conditions that a function may leave behind."""
        return self.doubts, self.state_doubts, self.fixed, self.held_states

    @standing.setter
    def standing(self, conditions: tuple[int, int, int, tuple[str, ...]]) -> None:
        self.doubts, self.state_doubts, self.fixed, self.held_states = conditions

    @contextmanager
    def condition(self, chosen: str, held: str = '') -> Iterator[None]:
        """Note what is read meanwhile as read on a condition of the file, or the state.

        What hangs on a constant, a type or the name of the node may be for another case.
        """
        before = self.standing
        self.doubt(chosen, held)
        try:
            with self.guard(is_guard=chosen == 'fixed'):
                yield
        finally:
            self.standing = before

    def doubt(self, chosen: str, held: str = '') -> None:
        """Note a condition from here on."""
        self.held_states += (held,) if held else ()
        self.doubts += chosen in ('file', 'fixed')
        self.state_doubts += chosen == 'state'
        self.fixed += chosen == 'fixed'

    @contextmanager
    def guard(self, *, is_guard: bool, is_broad: bool = False) -> Iterator[None]:
        """Note what is read meanwhile as guarded, if it is."""
        self.guards += is_guard
        self.broad_guards += is_broad
        try:
            yield
        finally:
            self.guards -= is_guard
            self.broad_guards -= is_broad

    def report(
        self, rule: str, module: ModuleSource, node: ast.AST, message: str, help_text: str | None
    ) -> None:
        """Note a problem, unless the behaviour is ready for it.

        Where only the file decides whether the place is reached, it has to look like a typo: then
        the help begins with what may have been meant.
        """
        is_typo = (help_text or '').startswith('did you mean')
        is_doubtful = bool(self.doubts) and not is_typo
        if not (self.guards or self.broad_guards or is_doubtful):
            problem = Problem(rule, message, module.span_of(node), help_text)
            self.reading.problems.append(problem)

    def use(
        self,
        kind: str,
        value: Value | None,
        *,
        waits: Waited = '',
        is_optional: bool = False,
        has_default: bool = False,
        is_change: bool = False,
    ) -> None:
        """Note the use of an entity by its name; of one that is not known, any may be used."""
        if not isinstance(value, Texts):
            self.reading.open_kinds.add(kind)
            return
        is_one = len(value.options) == 1
        for name, node, module in value.options:
            use = NodeUse(
                kind,
                name,
                module.span_of(node, name),
                is_optional,
                has_default,
                self.is_certain and is_one,
                bool(self.guards),
                waits if is_one else '',
                is_change,
            )
            self.reading.uses.append(use)

    def ask(
        self, kind: str, value: Value | None, *, has_default: bool = True, is_change: bool = False
    ) -> None:
        """Note the use of something without which the behaviour works as well."""
        self.use(kind, value, is_optional=True, has_default=has_default, is_change=is_change)

    def use_state(self, name: str, module: ModuleSource, node: ast.expr) -> None:
        """Note that a name of `node.state` is read."""
        is_guarded = bool(self.guards or self.doubts or self.state_doubts)
        use = NodeUse('state', name, module.span_of(node, name), is_guarded=is_guarded)
        self.reading.state_read.append(use)

    def set_state(self, name: str, scope: Scope, node: ast.expr) -> None:
        """Note that a name of `node.state` is set."""
        self.reading.state_set.setdefault(name, scope.module.span_of(node, name))
        self.fill(Awaited('', 'state', name), scope)

    def fill(self, what: Awaited, scope: Scope) -> None:
        """Note that something is brought about, by the behaviour or beside it."""
        self.reading.fills.setdefault(what, set()).add(scope.waits)

    def escape(self, chain: Chain) -> None:
        """Note that the node, or a part of it, is given to something unknown."""
        reading = self.reading
        match chain.path:
            case ('node',):
                reading.open_all()
            case ('node', 'parameters') | ('changes',):
                reading.open_kinds.add('parameter')
            case ('node', 'publishers', *_):
                reading.open_kinds.add('publisher')
            case ('node', 'state'):
                reading.is_state_open = True
            case ('node', 'own_state'):
                reading.is_own_state_open = True
            case ('node', 'get_parameters'):
                reading.reads_others = True
            case ('node', method) if method in SENDING_METHODS:
                reading.open_kinds.add(SENDING_METHODS[method])
            case ('node', method) if method in CREATING_METHODS:
                created = CreatedEntity(CREATING_METHODS[method], None, None, None, None)
                reading.created.append(created)
