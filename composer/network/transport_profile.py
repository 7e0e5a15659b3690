"""A larger segment of shared memory for Fast DDS, for large messages between workers.

A participant of Fast DDS puts what it sends into a segment of its own, of 512 KiB by default. What
does not fit goes over UDP, in pieces: if one is lost, so is the message, unless it is reliable.
https://fast-dds.docs.eprosima.com/en/v2.14.1/fastdds/transport/shared_memory/shared_memory.html
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.specs import SystemSpec

# A file and not a text, as each process reads it at its start, also one that is started again.
PROFILE = str(Path(__file__).with_suffix('.xml'))
# What names such a file: that of Fast DDS 2, and that of Fast DDS 3.
PROFILE_VARIABLES = ('FASTRTPS_DEFAULT_PROFILES_FILE', 'FASTDDS_DEFAULT_PROFILES_FILE')
# With any of these, or such a file in the working directory, users choose their own transports.
_CHOICES = (*PROFILE_VARIABLES, 'FASTDDS_BUILTIN_TRANSPORTS')
_FILES = ('DEFAULT_FASTRTPS_PROFILES.xml', 'DEFAULT_FASTDDS_PROFILES.xml')
_MIDDLEWARES = ('', 'rmw_fastrtps_cpp', 'rmw_fastrtps_dynamic_cpp')
_FOLDER = '/dev/shm'  # noqa: S108 - where Linux has shared memory
_MEBIBYTE = 1024 * 1024
# Fast DDS takes all of it at the start. Twice the largest message has been enough.
SEGMENT_BYTES = 16 * _MEBIBYTE


def shared_memory_variables(spec: SystemSpec, variables: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that give the processes of a system large segments.

    Without workers there are none; neither are there where users choose transports themselves.

    Args:
        variables: Those that the system starts with, of the shell and its own.

    Raises:
        ComposerError: There is too little shared memory.
    """
    workers = {each.worker for each in spec.nodes.values()} - {''}
    if not workers or not is_default_transport(variables):
        return {}
    own = [each for each in spec.processes.values() if not each.external]
    _check_room(1 + len(workers) + len(own))
    return dict.fromkeys(PROFILE_VARIABLES, PROFILE)


def is_default_transport(variables: Mapping[str, str]) -> bool:
    """Return whether nobody has said how Fast DDS sends, nor has it replaced."""
    return (
        variables.get('RMW_IMPLEMENTATION', '') in _MIDDLEWARES
        and not any(map(variables.get, _CHOICES))
        and not any(map(os.path.exists, _FILES))
    )


def _check_room(count: int) -> None:
    # Without room for a segment, a participant uses no shared memory at all.
    room, needed = _find_room(), count * SEGMENT_BYTES
    if room < needed:
        message = (
            f'{_FOLDER} has room for {room // _MEBIBYTE} MB, and {count} processes with large '
            f'segments need {needed // _MEBIBYTE} MB: messages of more than 512 KB between '
            'workers go over UDP, where they may be lost'
        )
        advice = 'give it more room; in Docker: --ipc=host, or --shm-size=1g'
        raise ComposerError(message, help=advice)


def _find_room() -> int:
    """Return how many bytes of shared memory are free."""
    try:
        status = os.statvfs(_FOLDER)
    except OSError:
        return 0
    return status.f_bavail * status.f_frsize
