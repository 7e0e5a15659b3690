"""A bridge to Foxglove: the ROS graph, by its protocol over a WebSocket."""

from __future__ import annotations

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
