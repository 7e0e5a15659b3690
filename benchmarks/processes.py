"""Measurements in processes of their own, each in a ROS domain that nobody else is in."""

import itertools
import json
import os
import signal
import socket
import subprocess
import sys

from benchmarks.rows import Job

_TIMEOUT_SEC = 60.0
_TIMEOUT_PER_NODE_SEC = 0.06

# Domains below those that tests reserve, which may run beside.
_FIRST_DOMAIN, _DOMAINS = 1, 9
_domain_offsets = itertools.count(os.getpid() * 7)


class MeasurementError(Exception):
    """A measurement did not come to its end."""


def run_job(job: Job, seconds: float) -> dict[str, float]:
    """Return the figures of a job, measured for `seconds`.

    Raises:
        MeasurementError: It failed, or took too long; nothing of it is left running.
    """
    arguments = [job.subject, job.side, str(job.size), str(seconds)]
    process = subprocess.Popen(  # noqa: S603 (a module beside this one)
        [sys.executable, '-m', 'benchmarks.measure', *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=_environment(),
        start_new_session=True,
    )
    timeout_sec = _TIMEOUT_SEC + 2 * seconds + job.size * _TIMEOUT_PER_NODE_SEC
    try:
        output, errors = process.communicate(timeout=timeout_sec)
    except subprocess.TimeoutExpired as error:
        message = f'took more than {timeout_sec:.0f} s'
        raise MeasurementError(message) from error
    finally:
        _kill_session(process)
    try:
        figures: dict[str, float] = json.loads(output.splitlines()[-1])
    except (IndexError, ValueError) as error:
        last = (errors.strip().splitlines() or ['it printed nothing'])[-1]
        raise MeasurementError(last) from error
    return figures


def _environment() -> dict[str, str]:
    return {
        **os.environ,
        'ROS_DOMAIN_ID': str(_free_domain()),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'PYTHONUNBUFFERED': '1',
    }


def _free_domain() -> int:
    for offset in itertools.islice(_domain_offsets, _DOMAINS):
        domain = _FIRST_DOMAIN + offset % _DOMAINS
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                # The port that the first participant of a domain listens on.
                probe.bind(('', 7400 + 250 * domain + 10))
            except OSError:
                continue
        return domain
    message = 'every ROS domain is in use'
    raise MeasurementError(message)


def _kill_session(process: subprocess.Popen[str]) -> None:
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return
    process.communicate()
