"""Programs that are started, watched and stopped by a measurement."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

_READY_SEC = 120.0
_STOP_SEC = 10.0
_LONGEST_STOP_SEC = 600.0


class Program:
    """A child process and the lines that it has printed.

    Attributes:
        begun: When it was started (monotonic, s).
    """

    def __init__(self, arguments: list[str]) -> None:
        self.begun = time.monotonic()
        self._process = subprocess.Popen(  # noqa: S603 (modules of this project)
            [sys.executable, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._lines: list[str] = []
        self._grown = threading.Condition()
        self._ended = False
        threading.Thread(target=self._read, daemon=True).start()

    def wait_for_line(self, part: str, timeout_sec: float = _READY_SEC) -> str:
        """Return the first line with `part` in it.

        Raises:
            RuntimeError: The program ended without, or the time is over.
        """
        with self._grown:
            self._grown.wait_for(lambda: self._ended or self._find(part), timeout_sec)
            line = self._find(part)
            if line is None:
                last = ' / '.join(self._lines[-3:])
                message = f"'{part}' was not printed; the last lines: {last}"
                raise RuntimeError(message)
            return line

    def memory_mb(self) -> float:
        """Return its memory (PSS: of shared pages a part, as many as share them)."""
        return self._rollup_mb('Pss:')

    def resident_mb(self) -> float:
        """Return its memory with all shared pages, whoever else uses them."""
        return self._rollup_mb('Rss:')

    def _rollup_mb(self, field: str) -> float:
        for line in Path(f'/proc/{self._process.pid}/smaps_rollup').read_text().splitlines():
            if line.startswith(field):
                return int(line.split()[1]) / 1000
        message = f'smaps_rollup has no {field}'
        raise RuntimeError(message)

    def threads(self) -> int:
        """Return how many threads it has."""
        return sum(1 for _ in Path(f'/proc/{self._process.pid}/task').iterdir())

    def descriptors(self) -> list[str]:
        """Return what its descriptors are of, as in `socket:[1234]`."""
        found = []
        for each in Path(f'/proc/{self._process.pid}/fd').iterdir():
            with suppress(FileNotFoundError):
                found.append(str(each.readlink()))
        return found

    def cpu_sec(self) -> float:
        """Return the processor time that it has used."""
        fields = Path(f'/proc/{self._process.pid}/stat').read_text().rpartition(')')[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')

    def interrupt(self) -> None:
        """Ask it to end."""
        self._process.send_signal(signal.SIGINT)

    def stop(self) -> float:
        """Ask it to end, and return how long that took (s)."""
        begun = time.monotonic()
        self.interrupt()
        self._process.wait(_LONGEST_STOP_SEC)
        return time.monotonic() - begun

    def end(self) -> None:
        """See that it has ended."""
        try:
            self._process.wait(_STOP_SEC)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _find(self, part: str) -> str | None:
        return next((line for line in self._lines if part in line), None)

    def _read(self) -> None:
        for line in self._process.stdout or ():
            with self._grown:
                self._lines.append(line.rstrip())
                self._grown.notify_all()
        with self._grown:
            self._ended = True
            self._grown.notify_all()


@contextmanager
def running(*commands: list[str]) -> Iterator[list[Program]]:
    """Start programs at once, one for each command after `python`, and end them afterwards."""
    with ExitStack() as stack:
        programs = []
        for command in commands:
            program = Program(command)
            stack.callback(program.end)
            programs.append(program)
        try:
            yield programs
        finally:
            for program in programs:
                program.interrupt()


@contextmanager
def composed(text: str, *options: str) -> Iterator[Program]:
    """Run `composer up` with a file of this text, and these options."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'system.yaml'
        path.write_text(text)
        with running(['-m', 'composer', 'up', str(path), *options]) as (program,):
            yield program


def start_figures(programs: list[Program], ready: str) -> dict[str, float]:
    """Wait until all have printed `ready`; return seconds since the first began, and MB."""
    for program in programs:
        program.wait_for_line(ready)
    return {
        'start_sec': time.monotonic() - programs[0].begun,
        'memory_mb': sum(program.memory_mb() for program in programs),
    }


def printed_figures(program: Program, timeout_sec: float) -> dict[str, Any]:
    """Wait for the JSON object that the program prints."""
    figures: dict[str, Any] = json.loads(program.wait_for_line('{"', timeout_sec))
    return figures


READY = ' ready in '
"""What `composer up` prints when all nodes are up."""

BARE_READY = 'all nodes are ready'
"""What `benchmarks.bare_nodes` prints then."""


def bare_nodes(first: int, count: int, style: str) -> list[str]:
    """Return the command for nodes written by hand; see `benchmarks.bare_nodes`."""
    return ['-m', 'benchmarks.bare_nodes', str(first), str(count), style]
