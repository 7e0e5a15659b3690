"""Tells actions from other entities without importing them.

`rclpy.action` imports NumPy, by the type of its goal identifiers: a fifth of what it takes to
start a process that has no actions. Whoever has one has imported it.
"""

import sys
from functools import cache
from typing import Any

_CLIENT, _SERVER = 'rclpy.action.client', 'rclpy.action.server'


def is_action_client(entity: Any) -> bool:
    """Return whether an entity is an action client of rclpy."""
    module = sys.modules.get(_CLIENT)
    return module is not None and isinstance(entity, module.ActionClient)


def is_action_server(entity: Any) -> bool:
    """Return whether an entity is an action server of rclpy."""
    module = sys.modules.get(_SERVER)
    return module is not None and isinstance(entity, module.ActionServer)


def is_half_made(entity: Any) -> bool:
    """Tell whether another thread is still making `entity`, an action client."""
    return is_action_client(entity) and not hasattr(entity, '_lock') and _is_locked_last()


@cache
def _is_locked_last() -> bool:
    """Tell whether rclpy adds an action client to its node first, and gives it a lock last.

    rclpy 9 does.
    """
    return '_lock' in sys.modules[_CLIENT].ActionClient.__init__.__code__.co_names
