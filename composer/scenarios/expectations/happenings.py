"""What happened in a case, by what expectations ask for."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from typing import Any

    from composer.scenarios.outcomes import Outcome
    from composer.scenarios.specs import ValuesByNode, WindowSpec
    from composer.simulation.events import Event


@record
class PublishedMessage:
    """A message on a topic.

    Attributes:
        index: Its place among all events.
    """

    index: int
    time_ns: int
    message: Any


@dataclass(slots=True)
class Happenings:
    """The events of a case, sorted.

    Attributes:
        events: In their order.
        outcomes: Of the steps.
        end_ns: When the case ended: as it says, or earlier if the system ended by itself.
        parameters: The values that parameters started with, by full names of nodes.
        messages: The places of messages among the events, by topics.
        others: All other events, by their kinds.
    """

    events: Sequence[Event]
    outcomes: Sequence[Outcome]
    end_ns: int
    parameters: ValuesByNode
    messages: Mapping[str, list[int]] = field(default_factory=dict)
    others: Mapping[str, list[Event]] = field(default_factory=dict)

    def of_topic(self, topic: str, window: WindowSpec) -> Iterator[PublishedMessage]:
        """Yield the messages of a topic in a window."""
        for index in self.messages.get(topic, ()):
            event = self.events[index]
            if window.has(event.time_ns):
                yield PublishedMessage(index, event.time_ns, event.value)

    def of_kind(self, kind: str, window: WindowSpec | None = None) -> list[Event]:
        """Return the events of a kind in a window, or in the whole case."""
        found = self.others.get(kind, [])
        return [each for each in found if window is None or window.has(each.time_ns)]


def sort_events(
    events: Sequence[Event],
    outcomes: Sequence[Outcome],
    until_ns: int,
    parameters: ValuesByNode | None,
) -> Happenings:
    """Return events by what expectations ask for."""
    messages: dict[str, list[int]] = {}
    others: dict[str, list[Event]] = {}
    for index, event in enumerate(events):
        if event.kind == 'message':
            messages.setdefault(event.name, []).append(index)
        elif event.kind != 'callback':
            others.setdefault(event.kind, []).append(event)
    exits = [event.time_ns for event in others.get('exit', ())]
    end_ns = min([until_ns, *exits])
    return Happenings(events, outcomes, end_ns, parameters or {}, messages, others)
