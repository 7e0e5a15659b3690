"""Run programs in parallel, each as soon as the programs before it are done."""

import os
import signal
import subprocess
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from pathlib import Path
from threading import Lock

from composer.records import record


class JobError(Exception):
    """A program failed.

    Attributes:
        job: the name of its job.
        output: what it wrote to standard output and standard error.
    """

    def __init__(self, job: str, output: str) -> None:
        """Store the output; the message has the name of the job."""
        super().__init__(f'{job} failed')
        self.job = job
        self.output = output


@record
class Job:
    """A program to run.

    Attributes:
        name: its name, unique among the jobs.
        command: returns the program and its arguments; it is called when the job starts, and can
            list files that earlier jobs wrote.
        folder: the working directory.
        after: the names of the jobs that must be done before.
    """

    name: str
    command: Callable[[], Sequence[str]]
    folder: Path
    after: tuple[str, ...] = ()


class _Programs:
    """The running programs, which can be stopped together."""

    def __init__(self, environment: Mapping[str, str], descriptors: Sequence[int]) -> None:
        self._environment = environment
        self._descriptors = descriptors
        self._running: set[subprocess.Popen[str]] = set()
        self._lock = Lock()
        self._stopped = False

    def run(self, job: Job) -> None:
        with self._lock:
            if self._stopped:
                return
            program = subprocess.Popen(  # noqa: S603
                job.command(),
                cwd=job.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                encoding='utf-8',
                errors='replace',
                pass_fds=self._descriptors,
                process_group=0,
            )
            self._running.add(program)
        output, _ = program.communicate()
        with self._lock:
            self._running.discard(program)
        if program.returncode:
            raise JobError(job.name, output)

    def stop(self) -> None:
        """Kill the running programs with their child processes, and start no more."""
        with self._lock:
            self._stopped = True
            for program in self._running:
                with suppress(ProcessLookupError):
                    os.killpg(program.pid, signal.SIGKILL)


def run_jobs(
    jobs: Sequence[Job],
    *,
    workers: int,
    environment: Mapping[str, str],
    descriptors: Sequence[int] = (),
) -> None:
    """Run jobs until all are done; of those that can start, the first ones start first.

    Args:
        jobs: without cycles.
        workers: the number of jobs that run at a time.
        environment: the environment variables of all programs.
        descriptors: open files that the programs inherit.

    Raises:
        JobError: one failed; the others were stopped, as on any other exception.
    """
    waiting = list(jobs)
    done: set[str] = set()
    running: dict[Future[None], Job] = {}
    programs = _Programs(environment, descriptors)
    with ThreadPoolExecutor(workers) as pool:
        try:
            while waiting or running:
                for job in [job for job in waiting if done.issuperset(job.after)]:
                    waiting.remove(job)
                    running[pool.submit(programs.run, job)] = job
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    future.result()
                    done.add(running.pop(future).name)
        finally:
            programs.stop()
