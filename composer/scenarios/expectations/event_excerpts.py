"""The events around the moment of a failure, a short line each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.scenarios.expectations.diffs import shorten
from composer.simulation.trace import render_event

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.scenarios.expectations.failures import Failure
    from composer.simulation.events import Event

_LONGEST_LINE = 110
# What matters to any failure, whatever it is about.
_ALWAYS = ('error', 'exit')
# These say which node an event is about; a callback says nothing that the rest does not.
_OF_NODES = ('log', 'parameter', 'state')


def render_excerpt(events: Sequence[Event], failure: Failure, most: int = 8) -> list[str]:
    """Return the events that matter to a failure, those nearest to its moment, in their order.

    Args:
        most: How many at most.
    """
    if failure.time_ns is None:
        return []
    related = [index for index, event in enumerate(events) if _is_related(event, failure)]
    moment = failure.time_ns
    nearest = sorted(related, key=lambda index: (abs(events[index].time_ns - moment), index))
    return [
        shorten(render_event(events[index]), _LONGEST_LINE) for index in sorted(nearest[:most])
    ]


def _is_related(event: Event, failure: Failure) -> bool:
    if event.kind in _ALWAYS or event.name in failure.names:
        return event.kind != 'callback'
    return event.kind in _OF_NODES and event.node in failure.names
