"""Creates the parameter services of nodes that declare no parameters, in the background.

Nobody waits for them, so they do not delay the start of a system. To create those of one node
takes some milliseconds, and the more the more nodes there are (Fast DDS compares each new end with
all others), so a pause after each leaves the processor to the behaviours.
"""

from __future__ import annotations

import threading
from time import monotonic
from typing import TYPE_CHECKING

from rclpy.exceptions import InvalidHandle

from composer.interfaces.classes import import_interface
from composer.runtime.logs import system_logger

if TYPE_CHECKING:
    from collections.abc import Mapping
    from contextlib import AbstractContextManager

    from composer.runtime.nodes.live_node import LiveNode

_TYPES = (
    'DescribeParameters',
    'GetParameterTypes',
    'GetParameters',
    'ListParameters',
    'SetParameters',
    'SetParametersAtomically',
)
# If the system is not ready by then: an `on_start` or a `wait_for` may wait for these services.
_LATEST_SEC = 1.0
# How much longer than the work each pause is.
_PAUSE_FACTOR = 4


class ParameterServiceStarter:
    """A thread that creates parameter services, one node at a time, from `start` to `stop`.

    Args:
        nodes: The nodes of the system, by their full names.
        lock: Held while a node is replaced or stopped.
    """

    def __init__(
        self, nodes: Mapping[str, LiveNode], lock: AbstractContextManager[object]
    ) -> None:
        self._nodes = nodes
        self._lock = lock
        self._system_is_ready = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(
            target=self._run, name='composer-parameter-services', daemon=True
        )

    def start(self) -> None:
        """Start to create services soon."""
        # While a thread loads a type, rclpy takes it for loaded in all others.
        for name in _TYPES:
            import_interface(f'rcl_interfaces/srv/{name}')
        self._thread.start()

    def begin(self) -> None:
        """Create services from now on, as the system is ready."""
        self._system_is_ready.set()

    def stop(self) -> None:
        """Create no more services."""
        self._ended.set()
        self._system_is_ready.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        self._system_is_ready.wait(_LATEST_SEC)
        for name in list(self._nodes):
            with self._lock:
                if self._ended.is_set():
                    return
                begun = monotonic()
                if node := self._nodes.get(name):
                    _start_services(node)
                took_sec = monotonic() - begun
            self._ended.wait(_PAUSE_FACTOR * took_sec)


def _start_services(node: LiveNode) -> None:
    try:
        node.ros.start_parameter_services()
    except InvalidHandle:
        # A behaviour has destroyed the node, or the context is gone.
        return
    except Exception as error:  # noqa: BLE001 - rclpy and the middleware raise many kinds
        system_logger.error(
            f"the parameter services of node '{node.spec.key}' cannot be created: {error}"
        )
