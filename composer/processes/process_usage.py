"""What external processes use of the machine, with all that they have started."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.processes.external_process import describe_end

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from composer.processes.external_process import ExternalProcess, ProcessRun

# A share of a shorter time would be that of a few ticks of the kernel.
_LEAST_SEC = 0.5
_TICKS_PER_SEC, _PAGE = os.sysconf('SC_CLK_TCK'), os.sysconf('SC_PAGE_SIZE')


def describe_processes(processes: Iterable[ExternalProcess]) -> list[dict[str, Any]]:
    """Return the state of each process that the system runs, and what it uses.

    Returns:
        `cpu` is the share of a core since it was asked for last, the first time since the start;
        `level` is that of its health.
    """
    owned = [each for each in processes if not each.spec.external]
    used = _read_sessions() if owned else {}
    return [_describe(process, used) for process in owned]


def _describe(process: ExternalProcess, used: Mapping[int, tuple[float, int]]) -> dict[str, Any]:
    run, state = process.run, process.word
    is_running = run is not None and state == 'running'
    end = '' if run is None or run.code is None else describe_end(run.code)
    told = {'failed': ('error', f'it {end}'), 'restarting': ('warn', f'it {end}')}
    level, message = told.get(state, ('ok', ''))
    cpu, memory = _measure(run, used) if run is not None and is_running else (None, None)
    return {
        'name': process.spec.name,
        'state': state,
        'pid': run.pid if run is not None and is_running else None,
        'restarts': process.restarts,
        'cpu': cpu,
        'memory_bytes': memory,
        'level': level,
        'message': message,
    }


def _measure(
    run: ProcessRun, used: Mapping[int, tuple[float, int]]
) -> tuple[float | None, int | None]:
    cpu_sec, memory = used.get(run.pid, (None, None))
    now = monotonic()
    if cpu_sec is not None and now - run.measured_at >= _LEAST_SEC:
        run.cpu = max(0.0, cpu_sec - run.cpu_sec) / (now - run.measured_at)
        run.measured_at, run.cpu_sec = now, cpu_sec
    return run.cpu, memory


def _read_sessions() -> dict[int, tuple[float, int]]:
    """Return the processor time and memory of each session; a process begins one of its own."""
    used: dict[int, tuple[float, int]] = {}
    for name in filter(str.isdecimal, os.listdir('/proc')):  # noqa: PTH208 - fast
        # It may have ended meanwhile.
        with suppress(OSError):
            # See `proc_pid_stat(5)`; what children used that have ended is in the time, too.
            stat = Path(f'/proc/{name}/stat').read_bytes().rpartition(b')')[2].split()
            before_sec, before = used.get(int(stat[3]), (0.0, 0))
            ticks = sum(map(int, stat[11:15]))
            memory = before + int(stat[21]) * _PAGE
            used[int(stat[3])] = before_sec + ticks / _TICKS_PER_SEC, memory
    return used
