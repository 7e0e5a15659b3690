"""What is exported: the parts of a system, and what they are run with."""

from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING, Literal, TypeAlias

from composer.confidential import conceal
from composer.errors import ComposerError
from composer.network.servers import with_servers
from composer.network.variables import PEERS, clear_others, ros_variables
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
    PEERS,
    'ROS_LOCALHOST_ONLY',
    'ROS_DISCOVERY_SERVER',
    'ROS_SUPER_CLIENT',
    'RMW_IMPLEMENTATION',
    'ZENOH_CONFIG_OVERRIDE',
)
# Of these, what a file may say. ROS starts with no peer whose name is not known, as that of a host
# that is off: Composer looks for them when it starts, and what asks it needs none.
_WRITTEN_VARIABLES = tuple(each for each in _GRAPH_VARIABLES if each != PEERS)
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
_DIGEST_CHARACTERS = 6


@record
class HostPart:
    """What one host runs of a system; all of it if the system has no hosts.

    Attributes:
        host: Empty for the whole system.
        stop_sec: The longest time that its stop may take.
        lowest_nice: The lowest nice value of its workers, or 0.
        scope: Whose service manager runs it.
        user: Who runs it, if that is the one of the system; empty for who exports it.
        variables: Those of ROS to set, for programs on this computer or on any.
        answers_alone: Whether it can be asked whatever becomes of other hosts.
    """

    system: str
    host: str
    scope: Scope
    user: str
    stop_sec: float
    lowest_nice: int
    variables: Mapping[str, str]
    answers_alone: bool

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
    """Return the names of the hosts that run something: nodes, processes, or a server."""
    entries: list[NodeSpec | ProcessSpec] = [*spec.nodes.values(), *spec.processes.values()]
    hosts = {each.host for each in entries} - {''}
    return sorted(hosts | ({spec.network.server} - {''} if hosts and spec.network else set()))


def list_parts(
    spec: SystemSpec, *, stays_here: bool, scope: Scope | None = None
) -> list[HostPart]:
    """Return the parts of a system, by the names of their hosts.

    Args:
        stays_here: Whether they will run on this computer, with the ROS that is sourced.
        scope: Whose service managers run them; `None` for what their hosts say.
    """
    hosts = list_hosts(spec)
    parts = [with_servers(spec.on_host(host)) for host in hosts] or [spec]
    return [_part(each, scope, stays_here=stays_here) for each in parts]


def _part(spec: SystemSpec, scope: Scope | None, *, stays_here: bool) -> HostPart:
    host = spec.hosts.get(spec.host)
    return HostPart(
        system=spec.name,
        host=spec.host,
        scope=scope or (host.systemd if host else 'user'),
        user=host.user if host else '',
        stop_sec=spec.longest_stop_sec + _STOP_MARGIN_SEC,
        lowest_nice=min([0, *(each.nice or 0 for each in spec.workers.values())]),
        variables=_find_variables(spec, stays_here=stays_here),
        answers_alone=not spec.network
        or spec.network.discovery in ('multicast', 'peers')
        or spec.network.server == spec.host,
    )


def _find_variables(spec: SystemSpec, *, stays_here: bool) -> dict[str, str]:
    """Return the variables of ROS that a part runs with, for itself and for what asks it.

    Those of the file win. Values that it has from variables itself are left out: the system
    reads them again where it runs.
    """
    names = [*_GRAPH_VARIABLES, *(_COMPUTER_VARIABLES if stays_here else ())]
    names += _SOURCED_VARIABLES if stays_here and _SOURCED in os.environ else ()
    shell = {name: os.environ[name] for name in names if name in os.environ}
    written = ros_variables(spec)
    if spec.host and spec.network:
        written = clear_others(written, shell)
    known = {
        name: value
        for name, value in written.items()
        if name in _WRITTEN_VARIABLES and value and conceal(value) == value
    }
    return {name: value for name, value in shell.items() if name not in written} | known


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


def keep_apart(text: str, name: str) -> str:
    """Return a name that was made of a text, with a digest of the text if it is another one.

    So `a@b` and `a:b` are not the same for who has names of fewer characters.
    """
    digest = hashlib.sha256(text.encode(errors='surrogateescape')).hexdigest()
    return name if name == text else f'{name}-{digest[:_DIGEST_CHARACTERS]}'


def describe(spec: SystemSpec) -> str:
    """Return the first line of what a system says of itself."""
    lines = conceal(spec.description).strip().splitlines()
    return lines[0] if lines else f'ROS 2 system {spec.name}'


def _values(read: Mapping[str, bool]) -> Iterator[tuple[str, str]]:
    return ((name, os.environ[name]) for name, is_set in read.items() if is_set)
