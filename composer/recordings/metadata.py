"""What rosbag2 says about a recording, in `metadata.yaml` and in the file itself.

Version 9, as rosbag2 of Jazzy writes it (`rosbag2_storage/yaml.hpp` and `qos.cpp`).
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Final

import yaml

from composer.diagnostics import SourceFile
from composer.yaml_text.plain_data import construct_data
from composer.yaml_text.positions import SourceMap
from composer.yaml_text.tree import CompositionError, compose_tree

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from composer.recordings.mcap_writer import Channel, McapWriter

FILE_NAME: Final = 'metadata.yaml'
RECORD_NAME: Final = 'rosbag2'
# Of a channel's metadata.
QOS_KEY: Final = 'offered_qos_profiles'
HASH_KEY: Final = 'topic_type_hash'
ROOT: Final = 'rosbag2_bagfile_information'
_VERSION: Final = 9
_NANOSECONDS: Final = 10**9
# One of a publisher takes 500 characters.
_LONGEST_QOS: Final = 100_000
# rmw's RMW_DURATION_INFINITE.
INFINITE_NS: Final = 2**63 - 1
_POLICIES: Final = ('history', 'depth', 'reliability', 'durability')
# In this order; before version 9, policies were the numbers of rmw.
_NUMBERS: Final[Mapping[str, Sequence[str]]] = {
    'history': ('system_default', 'keep_last', 'keep_all', 'unknown'),
    'reliability': ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available'),
    'durability': ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available'),
    'liveliness': (
        'system_default',
        'automatic',
        'manual_by_node',
        'manual_by_topic',
        'unknown',
        'best_available',
    ),
}
_DURATIONS: Final = ('deadline', 'lifespan', 'liveliness_lease_duration')
# Infinite durations of middlewares before Galactic (`qos.cpp`).
_OLD_INFINITE: Final = ((0x7FFFFFFF, 0xFFFFFFFF), (0x7FFFFFFF, 0x7FFFFFFF))


def write_qos(policies: Mapping[str, Any]) -> dict[str, Any]:
    """Return the QoS of a publisher as rosbag2 writes it.

    Args:
        policies: The policies by their names, in small letters; durations in ns.
    """
    durations = {
        name: {'sec': policies[name] // _NANOSECONDS, 'nsec': policies[name] % _NANOSECONDS}
        for name in _DURATIONS
    }
    return {
        **{name: policies[name] for name in _POLICIES},
        'deadline': durations['deadline'],
        'lifespan': durations['lifespan'],
        'liveliness': policies['liveliness'],
        'liveliness_lease_duration': durations['liveliness_lease_duration'],
        'avoid_ros_namespace_conventions': False,
    }


def parse_text(text: str) -> Any:
    """Return the data of a YAML text, with no more than a system may have.

    Raises:
        ValueError: It is not YAML, or has more.
    """
    source = SourceFile('', tuple(text.splitlines()))
    try:
        data, _ = construct_data(compose_tree(text, source), SourceMap(source))
    except CompositionError as error:
        raise ValueError(error.diagnostic.message) from error
    return data


def read_qos(profiles: str) -> list[dict[str, Any]]:
    """Return the QoS of publishers from what rosbag2 of any version wrote, as for `write_qos`.

    What is no such text is of no publisher.
    """
    try:
        found = parse_text(profiles if len(profiles) <= _LONGEST_QOS else '') or []
        return [_read_profile(each) for each in found]
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        return []


def _read_profile(written: Mapping[str, Any]) -> dict[str, Any]:
    policies: dict[str, Any] = {'depth': int(written['depth'])}
    for name, words in _NUMBERS.items():
        value = written[name]
        policies[name] = words[value] if isinstance(value, int) else str(value)
    for name in _DURATIONS:
        sec, nsec = int(written[name]['sec']), int(written[name]['nsec'])
        is_infinite = (sec, nsec) in _OLD_INFINITE
        policies[name] = (
            INFINITE_NS if is_infinite else min(sec * _NANOSECONDS + nsec, INFINITE_NS)
        )
    return policies


def render_qos(profiles: Iterable[Mapping[str, Any]]) -> str:
    """Return the text for the `offered_qos_profiles` of a channel."""
    text: str = yaml.safe_dump([write_qos(each) for each in profiles], sort_keys=False)
    return text


def describe_recording(writer: McapWriter, file_name: str) -> dict[str, Any]:
    """Return what rosbag2 says about a file that is all of a recording.

    Args:
        file_name: Relative to the folder of `metadata.yaml`.
    """
    start_ns, end_ns = writer.time_range
    times = {
        'duration': {'nanoseconds': end_ns - start_ns},
        'starting_time': {'nanoseconds_since_epoch': start_ns},
        'message_count': writer.message_count,
    }
    return {
        'version': _VERSION,
        'storage_identifier': 'mcap',
        **times,
        'topics_with_message_count': [
            {'topic_metadata': _describe_topic(each), 'message_count': each.count}
            for each in writer.channels
        ],
        'compression_format': '',
        'compression_mode': '',
        'relative_file_paths': [file_name],
        'files': [{'path': file_name, **times}],
        'custom_data': None,
        'ros_distro': os.environ.get('ROS_DISTRO', 'jazzy'),
    }


def _describe_topic(channel: Channel) -> dict[str, Any]:
    return {
        'name': channel.topic,
        'type': channel.type_name,
        'serialization_format': 'cdr',
        'offered_qos_profiles': yaml.safe_load(channel.about.get(QOS_KEY, '')) or [],
        'type_description_hash': channel.about.get(HASH_KEY, ''),
    }


def render_metadata(described: Mapping[str, Any], *, is_file: bool) -> str:
    """Return the text of `metadata.yaml`, or that of the record in the file itself."""
    data = {ROOT: described} if is_file else described
    text: str = yaml.dump(data, Dumper=_Dumper, sort_keys=False)
    return text


class _Dumper(yaml.SafeDumper):
    """Without anchors: the same times stand in two places."""

    def ignore_aliases(self, data: object) -> bool:  # noqa: ARG002 - as that of the base class
        return True
