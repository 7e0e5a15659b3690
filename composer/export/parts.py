"""What is exported: the parts of a system, and what they are run with."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.confidential import conceal, origin_of
from composer.errors import ComposerError
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence
    from pathlib import Path, PurePath

    from composer.language.specs import NodeSpec, ProcessSpec, SystemSpec

Scope: TypeAlias = Literal['user', 'system']

# What decides who is on one ROS graph.
_GRAPH_VARIABLES = (
    'ROS_DOMAIN_ID',
    'ROS_AUTOMATIC_DISCOVERY_RANGE',
    'ROS_STATIC_PEERS',
    'ROS_LOCALHOST_ONLY',
    'ROS_DISCOVERY_SERVER',
    'RMW_IMPLEMENTATION',
)
# What holds on this computer alone: where programs and settings are.
_COMPUTER_VARIABLES = (
    'FASTDDS_DEFAULT_PROFILES_FILE',
    'FASTRTPS_DEFAULT_PROFILES_FILE',
    'PATH',
    'PYTHONPATH',
    'ROS_LOG_DIR',
)
# What a ROS 2 sets that is sourced. Its wheels set the last one, too, whenever Python starts.
_SOURCED = 'AMENT_PREFIX_PATH'
_SOURCED_VARIABLES = (
    _SOURCED,
    'ROS_DISTRO',
    'ROS_PYTHON_VERSION',
    'ROS_VERSION',
    'LD_LIBRARY_PATH',
)
# What every service has, and every container but for the name of the user.
_ALWAYS_SET = frozenset(('HOME', 'LOGNAME', 'USER', 'SHELL', 'HOSTNAME', 'TMPDIR'))
# How much longer than its timeouts a stop may take until the guardian ends it, and some more.
_STOP_MARGIN_SEC = 20.0
# A value of fewer characters may stand in a longer one by chance.
_FEWEST_CHARACTERS = 8


@record
class HostPart:
    """What one host runs of a system; all of it if the system has no hosts.

    Attributes:
        host: Empty for the whole system.
        stop_sec: The longest time that its stop may take.
        lowest_nice: The lowest nice value of its workers, or 0.
        scope: Whose service manager runs it.
        user: Who runs it, if that is the one of the system; empty for who exports it.
    """

    system: str
    host: str
    scope: Scope
    user: str
    stop_sec: float
    lowest_nice: int

    @property
    def name(self) -> str:
        """Its name, where systems that run are listed."""
        return f'{self.system}@{self.host}' if self.host else self.system


@record
class Export:
    """A system, and how it is to be run elsewhere.

    Attributes:
        form: The name of the form, as on the command line.
        root: The folder that all files of the project are in.
        source: The same, as the written files name it: relative to their folder if they are in it.
        folder: The working directory, in `root`.
        given: The file and its layers, absolute.
        words: The arguments, and options, that follow these on the command line.
        files: All files of the project that the system is known to need, absolute.
        variables: Variables of ROS to set, for programs on this computer or on any.
        read: Names of variables that the system reads when it starts, and whether they are set
            here: then it may not start without.
        image: The container image to run; empty to build one.
    """

    form: str
    name: str
    description: str
    parts: tuple[HostPart, ...]
    root: Path
    source: str
    folder: Path
    given: tuple[Path, ...]
    words: tuple[str, ...]
    files: tuple[Path, ...]
    variables: Mapping[str, str]
    read: Mapping[str, bool]
    has_interfaces: bool
    image: str

    def arguments(self, part: HostPart, root: PurePath | None = None) -> list[str]:
        """Return the arguments of `composer` that run a part.

        Args:
            root: Where the project lies there; `None` if it lies where it does here.
        """
        files = [root / each.relative_to(self.root) if root else each for each in self.given]
        host = ['--host', part.host] if part.host else []
        return ['up', *map(str, files), *host, *self.words]


def list_hosts(spec: SystemSpec) -> list[str]:
    """Return the names of the hosts that nodes and processes of a system run on."""
    entries: list[NodeSpec | ProcessSpec] = [*spec.nodes.values(), *spec.processes.values()]
    return sorted({each.host for each in entries} - {''})


def list_parts(spec: SystemSpec, scope: Scope | None = None) -> list[HostPart]:
    """Return the parts of a system, by the names of their hosts.

    Args:
        scope: Whose service managers run them; `None` for what their hosts say.
    """
    hosts = list_hosts(spec)
    if not hosts:
        return [_part(spec, '', scope)]
    return [_part(spec.on_host(host), host, scope) for host in hosts]


def _part(spec: SystemSpec, name: str, scope: Scope | None) -> HostPart:
    host = spec.hosts.get(name)
    return HostPart(
        system=spec.name,
        host=name,
        scope=scope or (host.systemd if host else 'user'),
        user=host.user if host else '',
        stop_sec=spec.longest_stop_sec + _STOP_MARGIN_SEC,
        lowest_nice=min([0, *(each.nice or 0 for each in spec.workers.values())]),
    )


def find_variables(spec: SystemSpec, *, stays_here: bool) -> dict[str, str]:
    """Return the variables of ROS that a system runs with.

    Those of the file win. Values that it has from variables itself are left out: the system
    reads them again where it runs.

    Args:
        stays_here: Whether it will run on this computer, with the ROS that is sourced.
    """
    names = [*_GRAPH_VARIABLES, *(_COMPUTER_VARIABLES if stays_here else ())]
    names += _SOURCED_VARIABLES if stays_here and _SOURCED in os.environ else ()
    found = {name: os.environ[name] for name in names if name in os.environ}
    written = {name: spec.environment[name] for name in names if name in spec.environment}
    if spec.network and spec.network.domain_id is not None:
        written['ROS_DOMAIN_ID'] = str(spec.network.domain_id)
    known = {name: value for name, value in written.items() if origin_of(value) is None}
    return {name: value for name, value in found.items() if name not in written} | known


def choose_read(names: Collection[str]) -> dict[str, bool]:
    """Return which variables must be brought to where a system runs, and which may be."""
    own = {*_ALWAYS_SET, *_GRAPH_VARIABLES, *_COMPUTER_VARIABLES, *_SOURCED_VARIABLES}
    return {name: name in os.environ for name in sorted({*names} - own)}


def check_words(words: Sequence[str], read: Mapping[str, bool]) -> None:
    """Refuse words of a command line in which the value of a variable stands.

    Raises:
        ComposerError: The value of a variable that the system reads would be in the files.
    """
    for name, value in _values(read):
        for word in words:
            is_whole = f'={word}'.endswith(f'={value}')
            if value and (is_whole or (len(value) >= _FEWEST_CHARACTERS and value in word)):
                message = f'an argument has the value of the variable {name}, which anybody '
                message += 'could read in the files'
                advice = f"leave it out: the system reads it itself, with env('{name}')"
                raise ComposerError(message, help=advice)


def describe(spec: SystemSpec) -> str:
    """Return the first line of what a system says of itself."""
    lines = conceal(spec.description).strip().splitlines()
    return lines[0] if lines else f'ROS 2 system {spec.name}'


def _values(read: Mapping[str, bool]) -> Iterator[tuple[str, str]]:
    return ((name, os.environ[name]) for name, is_set in read.items() if is_set)
