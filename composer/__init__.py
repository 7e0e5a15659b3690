"""Composer: one YAML file → a running ROS 2 system.

Attributes:
    Node: What a behaviour sees of its node.
    load: Reads a file as far as it can be read.
    check: Returns all that is wrong with a file.
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
