"""Servers of processes that were killed: DDS lists them for 20 s more, and they answer nobody."""

from __future__ import annotations

from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Any

from rclpy.node import NodeNameNonExistentError

from composer.names import split_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from rclpy.node import Node

# All ends of a participant have the first bytes of their GUIDs in common.
# Source: DDSI-RTPS 2.5, 9.3.1 (https://www.omg.org/spec/DDSI-RTPS/2.5)
_PREFIX_BYTES = 12
# Fast DDS lists an end, and then matches it with those of this process; it does not tell when.
_MATCH_SEC = 0.1
# Of a service: as rmw_fastrtps and rmw_cyclonedds name its topics.
_REQUESTS, _RESPONSES = 'rq{}Request', 'rr{}Reply'


class LostParticipants:
    """The participants of DDS that were killed with their processes."""

    def __init__(self) -> None:
        self._lost: frozenset[bytes] = frozenset()
        # Services of which it is known that none of them is listed.
        self._clean: dict[str, frozenset[bytes]] = {}
        # Since when the others have another server.
        self._listed: dict[str, float] = {}

    def add(self, participants: Iterable[bytes]) -> None:
        """Note that these were killed."""
        self._lost = self._lost.union(participants)

    def list_clients(self, ros: Node) -> frozenset[bytes]:
        """Return the GUIDs of what receives responses in processes that were not killed."""
        return frozenset(
            bytes(end.endpoint_gid)
            for service, _ in ros.get_service_names_and_types()
            for end in ros.get_subscriptions_info_by_topic(_RESPONSES.format(service), True)
            if _participant_of(end) not in self._lost
        )

    def have_all_servers(self, ros: Node, service: str) -> bool:
        """Return whether all servers of a service that are listed were killed.

        A new one is there when both of its ends are listed.
        """
        lost = self._lost
        if not lost or self._clean.get(service) is lost:
            return False
        topics = _REQUESTS.format(service), _RESPONSES.format(service)
        requests = ros.get_subscriptions_info_by_topic(topics[0], no_mangle=True)
        responses = ros.get_publishers_info_by_topic(topics[1], no_mangle=True)
        asked = {_participant_of(each) for each in requests}
        answering = {_participant_of(each) for each in responses}
        if lost.isdisjoint(asked | answering):
            self._clean[service] = lost
            return False
        if asked & answering <= lost:
            self._listed.pop(service, None)
            return True
        now = monotonic()
        return now - self._listed.setdefault(service, now) < _MATCH_SEC


def list_servers(ros: Node, service: str) -> frozenset[bytes]:
    """Return the GUIDs of what sends the responses of a service."""
    ends = ros.get_publishers_info_by_topic(_RESPONSES.format(service), no_mangle=True)
    return frozenset(bytes(end.endpoint_gid) for end in ends)


def find_participants(ros: Node, nodes: Collection[str]) -> frozenset[bytes]:
    """Return the participants that have nodes of these full names."""
    return frozenset(each for full_name in nodes for each in _find_participants(ros, full_name))


def _find_participants(ros: Node, full_name: str) -> Iterator[bytes]:
    namespace, name = split_name(full_name)
    with suppress(NodeNameNonExistentError):
        topics = ros.get_publisher_names_and_types_by_node(name, namespace)
        services = ros.get_service_names_and_types_by_node(name, namespace)
        names = [(topic, False) for topic, _ in topics]
        names += [(_RESPONSES.format(service), True) for service, _ in services]
        for topic, no_mangle in names:
            ends = ros.get_publishers_info_by_topic(topic, no_mangle)
            yield from (
                _participant_of(each)
                for each in ends
                if (each.node_namespace, each.node_name) == (namespace, name)
            )


def _participant_of(end: Any) -> bytes:
    return bytes(end.endpoint_gid[:_PREFIX_BYTES])
