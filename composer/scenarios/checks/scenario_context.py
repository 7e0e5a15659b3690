"""What checks of scenario files are given: the file, its system, and how they report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.connections.topology import Channel
from composer.diagnostics import diagnostic_at
from composer.records import record
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Unpack

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Remarks
    from composer.entity_kinds import ChannelKind
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.interfaces.descriptions import InterfaceDescription
    from composer.language.specs import NodeSpec
    from composer.scenarios.scenario_files import LoadedScenarios
    from composer.scenarios.specs import ScenarioSpec
    from composer.yaml_text.positions import DataPath


@record
class ScenarioContext:
    """A scenario file, and the context of its system."""

    loaded: LoadedScenarios
    system: CheckContext
    spec: ScenarioSpec

    @property
    def catalogue(self) -> InterfaceCatalogue:
        """What describes the types of the system."""
        return self.system.catalogue

    def node(self, full_name: str) -> NodeSpec | None:
        """Return a node of the system."""
        nodes = self.system.spec.nodes.values()
        return next((node for node in nodes if node.full_name == full_name), None)

    def channel(self, kind: ChannelKind, name: str) -> Channel | None:
        """Return a topic, service or action of the system."""
        return self.system.topology.channels.get((kind, name))

    def has_own_end(self, kind: ChannelKind, name: str, *, provides: bool) -> bool:
        """Return whether a node has an end; what external processes have is left out."""
        channel = self.channel(kind, name)
        ends = (channel.providers if provides else channel.users) if channel else ()
        return any(not end.is_declared for end in ends) or self.may_have(
            kind, name, provides=provides
        )

    def may_have(self, kind: ChannelKind, name: str, *, provides: bool) -> bool:
        """Return whether a behaviour creates an end, or ends are not known for certain."""
        topology = self.system.topology
        if (kind, name, provides) in topology.created:
            return True
        return any(each[:2] == (kind, provides) for each in topology.possible)

    def is_of_ros(self, kind: ChannelKind, name: str) -> bool:
        """Return whether ROS itself publishes a topic, or serves a service."""
        return self.system.topology.type_of_ros(Channel(kind, name)) is not None

    def type_of(self, kind: ChannelKind, name: str) -> str | None:
        """Return the type of a topic, service or action; `None` if the system does not tell it."""
        channel = self.channel(kind, name)
        for end in channel.ends if channel else ():
            if self.system.has_real_type(end.entity):
                return end.entity.type
        return self.system.topology.type_of_ros(Channel(kind, name))

    def describe(self, type_name: str | None) -> InterfaceDescription | None:
        """Describe a type; `None` if it is not known."""
        return self.catalogue.describe(type_name) if type_name else None

    def suggest_channel(self, kind: ChannelKind, name: str) -> str | None:
        """Return the help for a name that the system does not have."""
        names = [channel.name for channel in self.system.topology.of_kind(kind)]
        return suggest_full_name(name, names, f'its {kind}s are')

    def at_value(
        self,
        path: DataPath,
        rule: str,
        message: str,
        *,
        part: str = '',
        **remarks: Unpack[Remarks],
    ) -> Diagnostic:
        """Return a finding at a value, or at the last `part` of its text."""
        span = self.loaded.positions.value(path).narrowed_to(part)
        return diagnostic_at(span, rule, message, **remarks)

    def at_key(
        self, path: DataPath, rule: str, message: str, **remarks: Unpack[Remarks]
    ) -> Diagnostic:
        """Return a finding at a key."""
        return diagnostic_at(self.loaded.positions.key(path), rule, message, **remarks)


def suggest_full_name(name: str, names: Sequence[str], listed: str) -> str | None:
    """Return the help for a wrong full name: the namespace may be wrong, or what follows it.

    Args:
        listed: See `suggest`.
    """
    near = find_nearest(name, names)
    if near is None:
        last = {each.rpartition('/')[2]: each for each in names}
        near = last.get(find_nearest(name.rpartition('/')[2], last) or '')
    return did_you_mean(near) or suggest(name, names, listed)
