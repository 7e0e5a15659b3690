"""Composer: one YAML file → a running ROS 2 system.

Attributes:
    Node: The node that a behaviour is called with.
    load: Loads a file as far as it can be read.
    check: Returns the errors and warnings of a file.
    up: Runs the system that a file declares; returns the exit code.
"""

from composer.api import check, load, up
from composer.errors import (
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
from composer.runtime.nodes.behaviour_node import Node

__all__ = [
    'ActionNotAvailableError',
    'CallError',
    'CallTimeoutError',
    'ComposerError',
    'GoalError',
    'GoalRejectedError',
    'GoalTimeoutError',
    'Node',
    'ParametersRefusedError',
    'ServiceFailedError',
    'ServiceNotAvailableError',
    'SystemStoppingError',
    'check',
    'load',
    'up',
]
