"""The entities of nodes are created, those that behaviours use before those that call behaviours.

A new kind of entity is a file here and a row in `CREATORS`.
"""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError, StartError
from composer.runtime.entities.parameters import NodeParameters
from composer.runtime.entities.publishers import Publisher
from composer.runtime.entities.service_clients import ServiceClient
from composer.runtime.entities.services import Service
from composer.runtime.entities.sources import Source
from composer.runtime.entities.subscriptions import Subscription
from composer.runtime.entities.timers import Timer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from composer.language.specs import PublisherSpec, SubscriptionSpec
    from composer.runtime.nodes.live_entity import LiveEntity
    from composer.runtime.nodes.live_node import LiveNode


def _create_end(create: Callable[[LiveNode, Any], LiveEntity]) -> Callable[..., LiveEntity]:
    """Return what creates a publisher or subscription if it is there from the start."""
    return lambda node, spec: (
        create(node, spec) if spec.active and not spec.made_by else AbsentEnd(node, spec)
    )


# These import `rclpy.action`, and with it NumPy: only for who has actions.
def _create_action_client(node: LiveNode, spec: Any) -> LiveEntity:
    from composer.runtime.entities.action_clients import ActionClient

    return ActionClient(node, spec)


def _create_action_server(node: LiveNode, spec: Any) -> LiveEntity:
    from composer.runtime.entities.actions import ActionServer

    return ActionServer(node, spec)


# By section, in the order of creation: each takes the node and the record of one entity, and
# is what is kept of it in `LiveNode.entities`.
CREATORS: dict[str, Callable[[LiveNode, Any], LiveEntity]] = {
    'publishers': _create_end(Publisher),
    'service_clients': ServiceClient,
    'action_clients': _create_action_client,
    'services': Service,
    'actions': _create_action_server,
    'subscriptions': _create_end(Subscription),
    'timers': Timer,
    'sources': Source,
}


# Instances of classes of behaviours are made before these, and find all that they may use.
_FIRST_WITH_BEHAVIOURS = 'action_clients'


def create_entities(nodes: Sequence[LiveNode]) -> None:
    """Create all that nodes declare, one kind of entity after the other.

    The publishers of all nodes come first: a subscription whose QoS is `best_available` takes what
    the publishers that are there offer, and never matches one that comes later and offers less.

    Raises:
        StartError: One of them cannot be created.
    """
    for node in nodes:
        with _failing_for(node):
            node.parameters = NodeParameters(node)
    for section, create in CREATORS.items():
        for node in nodes if section == _FIRST_WITH_BEHAVIOURS else ():
            with _failing_for(node):
                node.make_instances()
        for node in nodes:
            with _failing_for(node):
                for spec in getattr(node.spec, section).values():
                    node.entities[section][spec.name] = create(node, spec)
    for node in nodes:
        with _failing_for(node):
            # Last, for its class to find all that it may use.
            if node.parameters is not None:
                node.parameters.ask(node.spec)
            for publisher in list(node.entities['publishers'].values()):
                if isinstance(publisher, Publisher):
                    publisher.bind_events()


def create_entity(node: LiveNode, section: str, spec: Any) -> LiveEntity:
    """Create one entity more of a node that runs.

    Raises:
        StartError: It cannot be created.
    """
    with _failing_for(node):
        entity = CREATORS[section](node, spec)
        if isinstance(entity, Publisher):
            entity.bind_events()
        return entity


@contextmanager
def _failing_for(node: LiveNode) -> Iterator[None]:
    """Raise every error as a `StartError` that names the node."""
    try:
        yield
    except ComposerError as error:
        message = f"node '{node.spec.key}': {error}"
        raise StartError(message, help=error.help) from error
    except Exception as error:
        # rclpy and the middleware raise many kinds; none of them may leave half a system.
        message = f"node '{node.spec.key}': {type(error).__name__}: {error}"
        raise StartError(message) from error


class AbsentEnd:
    """A publisher or subscription that is not on the graph as far as Composer makes it.

    One that is not active comes when a behaviour wants it; others are made by a library.
    """

    def __init__(self, _node: object, spec: PublisherSpec | SubscriptionSpec) -> None:
        self._spec = spec

    def publish(self, _payload: Any, _unheld: int = 0) -> None:
        """Drop what is published.

        Raises:
            ComposerError: A library publishes there.
        """
        if self._spec.made_by:
            message = f"publisher '{self._spec.name}' is made by a library, which publishes on it"
            raise ComposerError(message)

    def delivery(self) -> tuple[str, str, int]:
        """Return that no messages go any way."""
        return '', '', 0

    def rest(self, *, rests: bool) -> None:
        """Do nothing: nothing is published."""

    def change(self, spec: PublisherSpec | SubscriptionSpec) -> None:
        """See `LiveEntity`."""
        self._spec = spec

    def destroy(self) -> None:
        """See `LiveEntity`."""
