"""Which services of this system failed lately, so that a caller that timed out can be told why."""

from __future__ import annotations

import threading
from time import monotonic


class ServiceFailures:
    """When the behaviour of a service last raised, by the service's full name."""

    def __init__(self) -> None:
        self._times: dict[str, float] = {}
        self._lock = threading.Lock()

    def note(self, service: str) -> None:
        """Note that a request got no response because the behaviour raised."""
        with self._lock:
            self._times[service] = monotonic()

    def since(self, service: str, begun: float) -> bool:
        """Return whether the service failed after `begun`, a time of `time.monotonic`."""
        with self._lock:
            return self._times.get(service, float('-inf')) >= begun
