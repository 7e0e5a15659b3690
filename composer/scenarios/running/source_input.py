"""What sources bring in a case: values at their times, or what a recording has of their topic."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from composer.recordings.reading import read_recording
from composer.scenarios.specs import find_sources
from composer.scenarios.times import NANOSECONDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.language.specs import SystemSpec
    from composer.recordings.reading import Recording
    from composer.scenarios.specs import GivenSpec
    from composer.simulation.simulated_system import SimulatedSystem


class SourceInput:
    """Lets sources bring what a case gives them.

    Attributes:
        played: The full names of the nodes, and the names of the sources.
        start_ns: When the first of the recordings begins; `None` without one.
    """

    def __init__(self, given: GivenSpec, system: SystemSpec | None) -> None:
        nodes = system.nodes.values() if system else ()
        self._inputs = [
            (source, node.full_name, name)
            for source in given.sources
            for node, name in find_sources(nodes, source.name)[:1]
        ]
        self.played = frozenset((node, name) for _, node, name in self._inputs)
        self._recordings = {
            source.path: read_recording(source.recording)
            for source, *_ in self._inputs
            if source.recording is not None
        }
        starts = [each.start_ns for each in self._recordings.values()]
        self.start_ns = min(starts, default=None)

    def schedule(self, simulated: SimulatedSystem, until_ns: int) -> None:
        """Ask for each value at its time."""
        for source, node, name in self._inputs:
            if recording := self._recordings.get(source.path):
                simulated.at(0, partial(self._play, simulated, recording, node, name))
            for value in source.values:
                for time_ns in value.schedule.list_times(until_ns):
                    bring = partial(simulated.bring, node, name, value.value)
                    simulated.at(time_ns / NANOSECONDS, bring)

    def _play(
        self, simulated: SimulatedSystem, recording: Recording, node: str, name: str
    ) -> None:
        topic = simulated.topic_of_source(node, name)
        self._play_next(simulated, recording.messages({topic}), node, name)

    def _play_next(
        self, simulated: SimulatedSystem, messages: Iterator[Any], node: str, name: str
    ) -> None:
        message = next(messages, None)
        if message is None or self.start_ns is None:
            return

        def bring() -> None:
            self._play_next(simulated, messages, node, name)
            simulated.bring(node, name, message[2])

        simulated.at((message[0] - self.start_ns) / NANOSECONDS, bring)
