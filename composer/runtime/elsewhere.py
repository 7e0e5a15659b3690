"""What nodes wait for that is not in the nodes of their own process."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from composer.language.specs import ProcessState


class AwaitedProcess(Protocol):
    """An external process, as far as somebody waits for it; see `ExternalProcess`."""

    @property
    def is_done(self) -> bool:
        """Whether it has ended for good."""

    @property
    def state(self) -> str:
        """Its state in words."""

    def has_come_to(self, state: ProcessState | None) -> bool:
        """Return whether it is in a state."""


class Elsewhere(Protocol):
    """What nodes wait for that is not in the nodes of their process."""

    def find_process(self, name: str) -> AwaitedProcess:
        """Return an external process of the system."""

    def find_hidden(self) -> frozenset[str]:
        """Return the full names of the nodes of other processes that have not started."""
