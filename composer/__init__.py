"""Composer: one YAML file → a running ROS 2 system.

Attributes:
    Node: The node that a behaviour is called with.
    Process: The process that a behaviour of an `on_exit` is called with.
    load: Loads a file as far as it can be read.
    check: Returns the errors and warnings of a file.
    up: Runs the system that a file declares; returns the exit code.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from composer.api import check, load, up
    from composer.errors import (
        AbortedError,
        ActionNotAvailableError,
        CallError,
        CallTimeoutError,
        ComposerError,
        GoalError,
        GoalRejectedError,
        GoalTimeoutError,
        ParametersRefusedError,
        ServiceFailedError,
        ServiceNotAvailableError,
        SystemStoppingError,
    )
    from composer.runtime.external.exit_actions import Process
    from composer.runtime.messages.payloads import PayloadError
    from composer.runtime.nodes.behaviour_node import Node

__all__ = [
    'AbortedError',
    'ActionNotAvailableError',
    'CallError',
    'CallTimeoutError',
    'ComposerError',
    'GoalError',
    'GoalRejectedError',
    'GoalTimeoutError',
    'Node',
    'ParametersRefusedError',
    'PayloadError',
    'Process',
    'ServiceFailedError',
    'ServiceNotAvailableError',
    'SystemStoppingError',
    'check',
    'load',
    'up',
]

_MODULES = {
    'Node': 'composer.runtime.nodes.behaviour_node',
    'PayloadError': 'composer.runtime.messages.payloads',
    'Process': 'composer.runtime.external.exit_actions',
    **dict.fromkeys(('check', 'load', 'up'), 'composer.api'),
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: `composer.signals` must be there at once."""
    if name not in __all__:
        message = f'module {__name__!r} has no attribute {name!r}'
        raise AttributeError(message)
    value = getattr(import_module(_MODULES.get(name, 'composer.errors')), name)
    globals()[name] = value
    return value
