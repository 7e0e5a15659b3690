"""`composer foxglove`: a running system, shown to Foxglove."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from composer.application.recording_options import create_bridge
from composer.application.running_systems.client import Client
from composer.application.running_systems.discovery import Discovery
from composer.errors import ExitCode
from composer.signals import asked_to_stop

if TYPE_CHECKING:
    from composer.foxglove import BridgeOptions

_POLL_SEC = 0.1


def serve(name: str | None, options: BridgeOptions) -> int:
    """Serve Foxglove until a signal comes; return the exit code.

    Args:
        name: Of the system; `None` for the only one.

    Raises:
        ComposerError: There is no such system, or the port cannot be served.
        UsageError: There are several systems.
    """
    with asked_to_stop() as is_asked, Client() as client:
        bridge = create_bridge(options, Discovery(client).find(name).name)
        try:
            bridge.start(client.node.context)
            while not is_asked():
                time.sleep(_POLL_SEC)
        finally:
            bridge.stop()
    return ExitCode.DONE
