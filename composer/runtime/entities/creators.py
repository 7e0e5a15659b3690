"""The kinds of entity, in the order of their creation; to add a kind, add a file and a row."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.errors import ComposerError, StartError
from composer.runtime.entities.action_clients import create_action_clients
from composer.runtime.entities.actions import create_actions
from composer.runtime.entities.parameters import create_parameters
from composer.runtime.entities.publishers import create_publishers
from composer.runtime.entities.service_clients import create_service_clients
from composer.runtime.entities.services import create_services
from composer.runtime.entities.subscriptions import create_subscriptions
from composer.runtime.entities.timers import create_timers

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.runtime.nodes.live_node import LiveNode

# First come those that behaviours use, then those that call behaviours.
ENTITY_KINDS: tuple[Callable[[LiveNode], None], ...] = (
    create_parameters,
    create_publishers,
    create_service_clients,
    create_action_clients,
    create_services,
    create_actions,
    create_subscriptions,
    create_timers,
)


def create_entities(node: LiveNode) -> None:
    """Create all that a node declares.

    Raises:
        StartError: One of them cannot be created.
    """
    for create in ENTITY_KINDS:
        try:
            create(node)
        except ComposerError as error:
            message = f"node '{node.spec.key}': {error}"
            raise StartError(message, help=error.help) from error
        except Exception as error:
            # rclpy and the middleware raise many kinds; none of them may leave half a system.
            message = f"node '{node.spec.key}': {type(error).__name__}: {error}"
            raise StartError(message) from error
