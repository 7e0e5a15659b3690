"""The behaviours of nodes and processes, and what each of them is called with."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.entity_kinds import EXIT_BEHAVIOUR, NODE_BEHAVIOURS
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.entity_kinds import BehaviourKey, EntityKind
    from composer.language.specs import (
        BehaviourSpec,
        EntitySpec,
        NodeSpec,
        ProcessSpec,
        SystemSpec,
    )


@record
class Binding:
    """A behaviour and the place that it is bound to.

    Attributes:
        owner: The place in words, as in `timer 'tick'`.
        key: The key that names it there, with what it is called with.
        kind: The kind of its entity; `None` for a behaviour of a node itself or of a process.
        entity: Its entity; `None` in the same cases.
    """

    behaviour: BehaviourSpec
    owner: str
    key: BehaviourKey
    kind: EntityKind | None = None
    entity: EntitySpec | None = None

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the positional arguments that it is called with."""
        return self.key.arguments

    @property
    def own_state_of(self) -> object:
        """What it shares its `own_state` with: the behaviours of one entity have the same."""
        return self.entity.path if self.entity is not None else self.key.key

    @property
    def may_yield(self) -> bool:
        """Whether it may be a generator."""
        return self.key.may_yield

    @property
    def call(self) -> str:
        """Return how it is called, as in `reply(node, message)`."""
        arguments = [*self.parameters, *(f'{name}=' for name in self.behaviour.arguments)]
        return f'{self.behaviour.function}({", ".join(arguments)})'


def node_bindings(node: NodeSpec) -> Iterator[Binding]:
    """Yield all behaviours of a node."""
    for kind, entity in node.entities():
        for key in kind.behaviours:
            behaviour: BehaviourSpec | None = getattr(entity, key.key)
            if behaviour:
                part = '' if key.key == 'behaviour' else f' ({key.key})'
                yield Binding(behaviour, f"{kind.noun} '{entity.name}'{part}", key, kind, entity)
    for key in NODE_BEHAVIOURS:
        behaviour = getattr(node, key.key)
        if behaviour:
            yield Binding(behaviour, key.key, key)


def exit_bindings(process: ProcessSpec) -> Iterator[Binding]:
    """Yield the behaviours of a process."""
    for action in process.on_exit:
        if action.behaviour:
            yield Binding(action.behaviour, EXIT_BEHAVIOUR.key, EXIT_BEHAVIOUR)


def system_bindings(system: SystemSpec) -> Iterator[Binding]:
    """Yield all behaviours of a system."""
    for node in system.nodes.values():
        yield from node_bindings(node)
    for process in system.processes.values():
        yield from exit_bindings(process)
