"""A recording as input: what the system hears and does not publish itself, at its times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.checks.checker import create_context
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.scenarios.times import NANOSECONDS

if TYPE_CHECKING:
    from composer.language.loaded_system import LoadedSystem
    from composer.recordings.reading import Recording
    from composer.simulation.simulated_system import SimulatedSystem


class RecordingInput:
    """Publishes what a recording has, one message after the other, each decoded in its turn.

    Args:
        recording: Its first message is published at the start of the system.
    """

    def __init__(
        self, simulated: SimulatedSystem, recording: Recording, system: LoadedSystem
    ) -> None:
        self._simulated = simulated
        self._start_ns = recording.start_ns
        self._types = {topic.name: topic.type for topic in recording.topics}
        self._messages = recording.messages(list_external_topics(system))

    def schedule(self) -> None:
        """Ask for the next message at its time."""
        message = next(self._messages, None)
        if message is not None:
            seconds = (message[0] - self._start_ns) / NANOSECONDS
            self._simulated.at(seconds, lambda: self._publish(*message[1:]))

    def _publish(self, topic: str, message: Any) -> None:
        self.schedule()
        self._simulated.publish(topic, message, self._types[topic])


def list_external_topics(system: LoadedSystem) -> set[str]:
    """Return the full names of the topics that nodes hear and none of them publishes.

    What external processes publish counts as external: they do not run.
    """
    context = create_context(system, InterfaceCatalogue())
    if context is None:
        return set()
    topology = context.topology
    created = {name for kind, name, provides in topology.created if kind == 'topic' and provides}
    return {
        channel.name
        for channel in topology.of_kind('topic')
        if any(not end.is_declared for end in channel.users)
        and all(end.is_declared for end in channel.providers)
    } - created
