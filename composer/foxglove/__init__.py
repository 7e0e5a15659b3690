"""A bridge to Foxglove: the ROS graph, by its protocol over a WebSocket."""

from __future__ import annotations

from importlib.util import find_spec

from composer.errors import ComposerError
from composer.records import record


@record
class BridgeOptions:
    """The options of a command line.

    Attributes:
        port: 0 for any that is free.
        address: Where to listen.
        allows_changes: Whether clients may publish, call services and set parameters.
    """

    port: int
    address: str
    allows_changes: bool


def require_foxglove() -> None:
    """Do nothing if the library for Foxglove is installed.

    Raises:
        ComposerError: It is not.
    """
    if find_spec('foxglove') is None:
        message = 'Foxglove needs the package foxglove-sdk, which is not installed'
        raise ComposerError(message, help="pip install 'rclpy-composer[foxglove]'")
