"""The environment variables of a file: set before ROS is imported, and restored at the end.

Those of the shell are checked as those of the file were.
"""

from __future__ import annotations

import importlib.util
import os
import socket
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from composer.checks.environment import find_environment_problems
from composer.errors import RosNotFoundError, StartError
from composer.processes.kernel import check_kernel
from composer.terminal import colour_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

_MIDDLEWARE = 'RMW_IMPLEMENTATION'
_COLOUR = 'RCUTILS_COLORIZED_OUTPUT'
_PEERS = 'ROS_STATIC_PEERS'
_KEYSTORE = 'ROS_SECURITY_KEYSTORE'
_NO_LOG_FILES = '--disable-external-lib-logs'
_NO_ROS_HELP = (
    "install it (pip install 'rclpy-composer[ros]'), or source yours: . /opt/ros/jazzy/setup.sh"
)


def check_ros() -> None:
    """Check that ROS 2 is there, without importing it, and what it needs of the kernel.

    Raises:
        RosNotFoundError: There is no rclpy.
        StartError: The kernel lacks something.
    """
    if importlib.util.find_spec('rclpy') is None:
        message = 'cannot run without ROS 2: this Python has no rclpy'
        raise RosNotFoundError(message, help=_NO_ROS_HELP)
    check_kernel()


@contextmanager
def environment_set(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables, and restore their old values at the end."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def find_colour() -> dict[str, str]:
    """Return the variable that tells ROS whether to colour its log, if the shell says so."""
    wanted = colour_of(os.environ)
    if wanted is None or os.environ.get(_COLOUR):
        return {}
    return {_COLOUR: str(int(wanted))}


def check_shell(of_file: Mapping[str, str]) -> None:
    """Check the variables that ROS reads and that the shell has set.

    Args:
        of_file: Those of the file, which have been checked.

    Raises:
        StartError: ROS cannot use one of them.
    """
    of_shell = {name: value for name, value in os.environ.items() if name not in of_file}
    for _, message, advice in find_environment_problems(of_shell):
        text = f'{message} (as the shell has set it)'
        raise StartError(text, help=advice)
    for peer in filter(None, os.environ.get(_PEERS, '').split(';')):
        try:
            socket.getaddrinfo(peer, None)
        except (OSError, UnicodeError) as error:
            message = f"{_PEERS}: the host '{peer}' cannot be found: {error}"
            raise StartError(message) from error
    keystore = os.environ.get(_KEYSTORE)
    if os.environ.get('ROS_SECURITY_ENABLE') == 'true' and keystore:
        enclaves = Path(keystore) / 'enclaves'
        if not os.path.isdir(enclaves):
            message = f"{_KEYSTORE}: there is no folder '{enclaves}'"
            raise StartError(message)


def check_log_folder(ros_arguments: Sequence[str]) -> None:
    """Create the folder of ROS's log files if it does not exist, as ROS does.

    Raises:
        StartError: It cannot be created or written to.
    """
    if _NO_LOG_FILES in ros_arguments:
        return
    name, text = _find_log_folder()
    problem: str | None = 'HOME is not set'
    if os.environ.get('HOME') or not text.startswith('~'):
        folder = find_log_folder()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            problem = None if os.access(folder, os.W_OK | os.X_OK) else 'it cannot be written to'
        except OSError as error:
            problem = error.strerror
    if problem:
        message = f"ROS cannot keep its log files in '{text}' ({name}): {problem}"
        raise StartError(message, help='set ROS_LOG_DIR to a folder that can be written to')


def find_log_folder() -> Path:
    """Return the folder of ROS's log files."""
    _, text = _find_log_folder()
    home = os.environ.get('HOME', '')
    return Path(text.replace('~', home, 1) if text.startswith('~') else text)


def _find_log_folder() -> tuple[str, str]:
    """Return the variable that names the folder of ROS's log files, and the folder.

    Source: `rcl_logging_get_logging_directory` of `rcl_logging_interface`.
    """
    if folder := os.environ.get('ROS_LOG_DIR'):
        return 'ROS_LOG_DIR', folder
    if home := os.environ.get('ROS_HOME'):
        return 'ROS_HOME', f'{home}/log'
    return 'HOME', '~/.ros/log'


def check_middleware(variables: Mapping[str, str]) -> None:
    """Load the middleware that the variables name, if they name one.

    Raises:
        StartError: It cannot be loaded, or this process has loaded another one before.
    """
    wanted = variables.get(_MIDDLEWARE)
    if not wanted:
        return
    from rclpy.utilities import get_rmw_implementation_identifier

    try:
        loaded = get_rmw_implementation_identifier()
    except Exception as error:
        message = f"the middleware '{wanted}' cannot be loaded: {error}"
        raise StartError(message) from error
    if loaded != wanted:
        message = f"{_MIDDLEWARE} is '{wanted}', but this process has loaded '{loaded}' before"
        raise StartError(message, help='a process has one middleware: run this system in another')
