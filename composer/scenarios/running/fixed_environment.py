"""The environment of cases: the same on every machine, and without any network.

Variables that say where things are installed stay; what else a run could depend on is fixed.
"""

from __future__ import annotations

import os
import tempfile
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

# What each case has, whatever the shell says.
FIXED: Mapping[str, str] = {
    # The order of sets of texts.
    'PYTHONHASHSEED': '0',
    'TZ': 'UTC',
    'LANG': 'C.UTF-8',
    'LC_ALL': 'C.UTF-8',
    # Sums of floats depend on the number of threads that share them.
    'OMP_NUM_THREADS': '1',
    'OPENBLAS_NUM_THREADS': '1',
    'MKL_NUM_THREADS': '1',
}
# Participants of one process hear no other process, and send nothing. Over UDP, as shared memory
# would leave files behind where a process is killed.
ISOLATED: Mapping[str, str] = {
    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF',
    'FASTDDS_BUILTIN_TRANSPORTS': 'UDPv4',
    # Fast DDS reads profiles from the working folder, too, which may have messages come late.
    'SKIP_DEFAULT_XML_FILE': '1',
}
# They would choose another middleware, other peers, another clock or another form of the log.
_CLEANED_PREFIXES = ('ROS_', 'RMW_', 'RCUTILS_', 'FASTDDS_', 'FASTRTPS_', 'CYCLONEDDS_', 'ZENOH_')
# Which ROS this is: packages read it.
_KEPT = frozenset({'ROS_DISTRO', 'ROS_VERSION', 'ROS_PYTHON_VERSION', 'ROS_HOME'})
_CLEANED = frozenset({'LANGUAGE', 'PYTHONUNBUFFERED', 'PYTHONINSPECT'})


def fix_environment(shell: Mapping[str, str], log_folder: str) -> dict[str, str]:
    """Return the environment of cases.

    Args:
        shell: The environment of the caller.
        log_folder: Where ROS writes its log files.
    """
    kept = {name: value for name, value in shell.items() if not is_cleaned(name)}
    return {**kept, **FIXED, **ISOLATED, 'ROS_LOG_DIR': log_folder}


def is_cleaned(name: str) -> bool:
    """Return whether cases do not get this variable of the shell."""
    return name in _CLEANED or name.startswith('LC_') or is_cleaned_of_ros(name)


def is_cleaned_of_ros(name: str) -> bool:
    """Return whether a variable would change what ROS does."""
    return name not in _KEPT and name.startswith(_CLEANED_PREFIXES)


@contextmanager
def isolated_environment() -> Iterator[None]:
    """Keep the systems of this process from all others meanwhile; what is fixed stays as it is."""
    before = dict(os.environ)
    with tempfile.TemporaryDirectory(prefix='composer-log-', ignore_cleanup_errors=True) as folder:
        for name in filter(_is_isolated, before):
            del os.environ[name]
        os.environ.update({**ISOLATED, 'ROS_LOG_DIR': folder, 'TZ': FIXED['TZ']})
        time.tzset()
        try:
            yield
        finally:
            for name in filter(_is_isolated, list(os.environ)):
                del os.environ[name]
            os.environ.update({name: before[name] for name in filter(_is_isolated, before)})
            time.tzset()


def _is_isolated(name: str) -> bool:
    return name == 'TZ' or name in ISOLATED or is_cleaned_of_ros(name)
