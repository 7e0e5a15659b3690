"""Runs the discovery server of Fast DDS: `python -m composer.network.discovery_server PORT`.

A server that is killed, and started again at once, is never told of the participants that it had:
they take the new one for the old one, which knows them. So it then starts only when they have
missed the old one, and look for it. Its own backup (`-b`) is no help: participants that come later
find nobody (as of Fast DDS 2.14).

https://fast-dds.docs.eprosima.com/en/v2.14.1/fastddscli/cli/cli.html#discovery
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path
from typing import TYPE_CHECKING

from composer.ament import ament_prefixes, find_path

if TYPE_CHECKING:
    from collections.abc import Mapping

_PROGRAM = 'bin/fast-discovery-server'
_LIBRARIES = 'LD_LIBRARY_PATH'
# Fast DDS announces a participant every 3 s, and takes it for gone after 20 s without.
_MISSED_SEC = 22.0


def main(port: str) -> str | int:
    """Run the server to its end; return its exit code, or why it cannot be run.

    It listens on all interfaces, with the identity that clients of one server expect.
    """
    prefixes = ament_prefixes()
    program = find_path(_PROGRAM, prefixes)
    if program is None:
        looked = ', '.join(map(str, prefixes))
        return f'there is no fast-discovery-server of Fast DDS in {looked}'
    mark = find_mark(port)
    if mark.exists():
        sys.stdout.write(f'The last one was killed: this one starts in {_MISSED_SEC:g} s.\n')
        sys.stdout.flush()
        time.sleep(_MISSED_SEC)
    mark.parent.mkdir(parents=True, exist_ok=True)
    mark.touch()
    command = [str(program), '-i', '0', '-p', port]
    with subprocess.Popen(command, env=find_variables(program)) as server:  # noqa: S603 - its own
        signal.signal(signal.SIGINT, lambda *_: server.send_signal(signal.SIGINT))
        code = server.wait()
    if code >= 0:
        mark.unlink(missing_ok=True)
    return code


def find_mark(port: str) -> Path:
    """Return the file that is there while a server runs, and after it was killed."""
    state = os.environ.get('XDG_STATE_HOME') or '~/.local/state'
    return Path(state).expanduser() / 'composer' / f'discovery_server_{port}'


def find_variables(program: Path) -> Mapping[str, str]:
    """Return the environment of the program, with the folders of its libraries.

    The one in wheels does not find them by itself: these move it when they are installed.
    """
    wheels = Path(sysconfig.get_path('platlib'), 'ros_fastrtps.libs')
    folders = [program.parents[1] / 'lib', wheels]
    given = os.environ.get(_LIBRARIES, '').split(os.pathsep)
    return {**os.environ, _LIBRARIES: os.pathsep.join(filter(None, [*map(str, folders), *given]))}


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
