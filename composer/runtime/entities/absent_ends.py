"""Declared publishers and subscriptions that are not on the graph as far as Composer makes them.

Those that are not active come when a behaviour wants them; others are made by a library.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError

if TYPE_CHECKING:
    from composer.language.specs import PublisherSpec, SubscriptionSpec


class AbsentEnd:
    """A publisher or subscription that is not there."""

    def __init__(self, _node: object, spec: PublisherSpec | SubscriptionSpec) -> None:
        self._spec = spec

    def publish(self, _payload: Any, _unheld: int = 0) -> None:
        """Drop what is published.

        Raises:
            ComposerError: A library publishes there.
        """
        if self._spec.made_by:
            message = f"publisher '{self._spec.name}' is made by a library, which publishes on it"
            raise ComposerError(message)

    def delivery(self) -> tuple[str, str, int]:
        """Return that no messages go any way."""
        return '', '', 0

    def rest(self, *, rests: bool) -> None:
        """Do nothing: nothing is published."""

    def change(self, spec: PublisherSpec | SubscriptionSpec) -> None:
        """See `LiveEntity`."""
        self._spec = spec

    def destroy(self) -> None:
        """See `LiveEntity`."""
