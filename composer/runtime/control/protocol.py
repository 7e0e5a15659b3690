"""What a running system and the commands that ask it agree on; ROS is not needed here."""

from __future__ import annotations

import re
from typing import Final

# Of the JSON documents in the answers; another number means another form.
VERSION: Final = 1

# ROS allows 255 (rmw/validate_node_name.h).
_LONGEST_NAME = 255
_PREFIX = '_composer_'

# The services of the control node, below its name. All are `std_srvs/srv/Trigger`, but `restart`,
# which needs the name of a node: it is a `rcl_interfaces/srv/SetParametersAtomically` with the
# parameter `node`, and may have another one, `action`: `stop`, or `start` for a node that was
# stopped. None takes a path or code.
STATUS: Final = 'status'
RELOAD: Final = 'reload'
RELOAD_NOW: Final = 'reload_now'
PLAN: Final = 'plan'
RESTART: Final = 'restart'
DOWN: Final = 'down'
SNAPSHOT: Final = 'snapshot'
TOP: Final = 'top'
TRACE: Final = 'trace'
TRACE_READ: Final = 'trace_read'

_STATUS_SERVICE = re.compile(rf'(/.*)?/{_PREFIX}[^/]+/{STATUS}')


def node_name(system: str) -> str:
    """Return the name of the control node of a system.

    The files do not declare this node, so its name begins with an underscore, which hides it from
    `ros2 node list`; `ros2 node list --all` shows it.
    """
    return f'{_PREFIX}{re.sub("[^A-Za-z0-9_]+", "_", system)}'[:_LONGEST_NAME]


def container_name(system: str) -> str:
    """Return the name of the node of a system that answers as a container does."""
    return node_name(system).lstrip('_')


def find_control_node(service: str) -> str | None:
    """Return the full name of the control node whose status service this is; `None` if none's."""
    if _STATUS_SERVICE.fullmatch(service) is None:
        return None
    return service.removesuffix(f'/{STATUS}')
