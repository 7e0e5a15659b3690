"""Inputs are examined in processes of their own, which have limits and may be killed."""

import multiprocessing
import os
import resource
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.reports.text import render_finding
from tests.fuzz.mutations import mutate

ROOT = Path(__file__).parents[2]
MEMORY_BYTES = 1_000_000_000
LIMIT_SEC = 5.0
# Nothing of the process that asks goes on in them, such as its threads and its memory.
_PROCESSES = multiprocessing.get_context('spawn')
# After so much work without an answer a process is killed.
_PATIENCE_SEC = 20.0


@dataclass(frozen=True)
class Failure:
    """An input that did not end in findings or success."""

    index: int
    what: str


def seed_texts():
    """Return the files that mutation begins with."""
    folders = ('configs', 'tests/data/valid', 'tests/data/invalid')
    paths = [path for folder in folders for path in sorted((ROOT / folder).glob('*.yaml'))]
    return [path.read_bytes().decode(errors='replace') for path in paths]


def examine(content, path, catalogue):
    """Check one input as `composer check` does; return why it did not end as it should."""
    path.write_bytes(content)
    begun = time.process_time()
    try:
        system = load_system(path)
        findings = check_system(system, catalogue)
        for finding in findings[:20]:
            render_finding(finding).encode()
    except BaseException:  # noqa: BLE001 - whatever it is, it is what is sought
        return traceback.format_exc()
    if not findings and system.spec is None:
        return 'neither findings nor a system'
    if (taken := time.process_time() - begun) > LIMIT_SEC:
        return f'took {taken:.1f} s'
    return None


def _work(seed, indices, results, step):
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    os.chdir(ROOT)
    sys.stdout = sys.stderr = Path(os.devnull).open('w')  # noqa: SIM115 - until the process ends
    texts = seed_texts()
    catalogue = InterfaceCatalogue()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'input.yaml'
        for index in indices:
            step.value = index
            what = examine(mutate(texts, seed, index), path, catalogue)
            if what:
                results.put(Failure(index, what))
    step.value = -1
    results.close()
    results.join_thread()


def _worked_sec(pid):
    """Return the processor time of a process: it goes on however busy the machine is."""
    try:
        fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


class _Worker:
    """A process for a range of inputs; where it is stuck, another goes on behind that input."""

    def __init__(self, seed, indices, results):
        self.failures = []
        self._seed, self._indices, self._results = seed, indices, results
        self._begin(indices)

    def _begin(self, indices):
        self._step = _PROCESSES.Value('l', indices[0])
        self._seen = (indices[0], 0.0)
        self._process = _PROCESSES.Process(
            target=_work, args=(self._seed, indices, self._results, self._step), daemon=True
        )
        self._process.start()

    def is_done(self):
        """Return whether all is examined; replace the process if it hangs or has died."""
        # In this order: one that has ended says no more where it is.
        alive = self._process.is_alive()
        at = self._step.value
        if at == -1 and not alive:
            return True
        if at != self._seen[0]:
            self._seen = (at, _worked_sec(self._process.pid))
        if not alive or _worked_sec(self._process.pid) - self._seen[1] > _PATIENCE_SEC:
            what = 'hung' if alive else f'the process died with {self._process.exitcode}'
            self._process.kill()
            self._process.join()
            self.failures.append(Failure(at, what))
            rest = self._indices[self._indices.index(at) + 1 :]
            if not rest:
                return True
            self._begin(rest)
        return False


def examine_all(seed, count, first=0, jobs=2):
    """Return the failures among `count` mutated inputs."""
    results = _PROCESSES.Queue()
    ranges = [range(first + job, first + count, jobs) for job in range(jobs)]
    workers = [_Worker(seed, indices, results) for indices in ranges if indices]
    failures = []
    done = []
    while not done or not all(done):
        done = [worker.is_done() for worker in workers]
        while not results.empty():
            failures.append(results.get())
        time.sleep(0.05)
    while not results.empty():
        failures.append(results.get())
    failures += [failure for worker in workers for failure in worker.failures]
    return sorted(failures, key=lambda failure: failure.index)
