"""Which behaviours a node has, and what each of them is called with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.language.specs import BehaviourSpec, NodeSpec


@dataclass(frozen=True, slots=True)
class Binding:
    """A behaviour and the place that it is bound to.

    Attributes:
        owner: The place in words, as in `timer 'tick'`.
        parameters: The names of the positional arguments that it is called with.
        may_yield: Whether it may be a generator.
    """

    behaviour: BehaviourSpec
    owner: str
    parameters: tuple[str, ...]
    may_yield: bool = False

    @property
    def call(self) -> str:
        """Return how it is called, as in `reply(node, message)`."""
        arguments = [*self.parameters, *(f'{name}=' for name in self.behaviour.arguments)]
        return f'{self.behaviour.function}({", ".join(arguments)})'


def node_bindings(node: NodeSpec) -> Iterator[Binding]:
    """Yield all behaviours of a node."""
    for timer in node.timers.values():
        if timer.behaviour:
            yield Binding(timer.behaviour, f"timer '{timer.name}'", ('node',), may_yield=True)
    for subscription in node.subscriptions.values():
        if subscription.behaviour:
            owner = f"subscription '{subscription.name}'"
            yield Binding(subscription.behaviour, owner, ('node', 'message'))
    yield from _serving_bindings(node)
    yield from _hook_bindings(node)


def _serving_bindings(node: NodeSpec) -> Iterator[Binding]:
    for service in node.services.values():
        yield Binding(service.behaviour, f"service '{service.name}'", ('node', 'request'))
    for action in node.actions.values():
        owner = f"action '{action.name}'"
        yield Binding(action.behaviour, owner, ('node', 'goal'), may_yield=True)
        if action.accept:
            yield Binding(action.accept, f'{owner} (accept)', ('node', 'goal'))
    for client in node.action_clients.values():
        owner = f"action client '{client.name}'"
        if client.feedback:
            yield Binding(client.feedback, f'{owner} (feedback)', ('node', 'feedback'))
        if client.result:
            yield Binding(client.result, f'{owner} (result)', ('node', 'result'))


def _hook_bindings(node: NodeSpec) -> Iterator[Binding]:
    hooks = (
        ('on_start', node.on_start, ('node',)),
        ('on_stop', node.on_stop, ('node',)),
        ('on_parameters', node.on_parameters, ('node', 'changes')),
    )
    for key, behaviour, parameters in hooks:
        if behaviour:
            yield Binding(behaviour, key, parameters)
