"""Asks the server of cases, a child process, to run them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from itertools import count
from multiprocessing import Pipe
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from composer.errors import ComposerError
from composer.processes.kernel import CASE_THREADS, check_threads
from composer.scenarios.running.fixed_environment import fix_environment

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from multiprocessing.connection import Connection
    from types import TracebackType
    from typing import Self

    from composer.scenarios.running.case_results import CaseRequest, CaseResult

Key = TypeVar('Key')

_END_SEC = 5.0
# This Composer is imported, wherever the process is started; nothing else is found there.
_PROGRAM = (
    'import sys; folder = sys.argv[2]; sys.path.insert(0, folder); import composer; '
    'sys.path.remove(folder); from composer.scenarios.running.case_server import main; '
    'main(int(sys.argv[1]))'
)


class CaseClient:
    """Runs cases in a server of its own, which is started by the first of them.

    Args:
        environment: Variables to set beside those that all cases have.
        folder: Where relative paths start; `None` for the working folder.
    """

    def __init__(
        self, environment: Mapping[str, str] | None = None, folder: Path | None = None
    ) -> None:
        self._started_in = folder
        self._environment = dict(environment or {})
        self._numbers = count()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._folder = ''

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def start(self) -> None:
        """Start the server, and do not wait for it.

        Raises:
            StartError: There may not be as many threads as a case needs.
        """
        if self._process is not None:
            return
        check_threads(CASE_THREADS)
        own, its = Pipe()
        self._folder = tempfile.mkdtemp(prefix='composer-cases-')
        command = [sys.executable, '-P', '-c', _PROGRAM]
        with its:
            self._process = subprocess.Popen(  # noqa: S603 - this Python
                [*command, str(its.fileno()), str(Path(__file__).parents[3])],
                env={**fix_environment(os.environ, self._folder), **self._environment},
                pass_fds=[its.fileno()],
                cwd=self._started_in,
            )
        self._connection = own

    def submit(self, request: CaseRequest) -> int:
        """Ask for a run; return its number."""
        self.start()
        number = next(self._numbers)
        try:
            self._require().send((number, request))
        except OSError as error:
            raise self._explain_end() from error
        return number

    def wait(self) -> tuple[int, CaseResult]:
        """Return the number and result of the run that ends next.

        Raises:
            ComposerError: The server has ended.
        """
        try:
            answer: tuple[int, CaseResult] = self._require().recv()
        except (EOFError, OSError) as error:
            raise self._explain_end() from error
        return answer

    def run(self, request: CaseRequest) -> CaseResult:
        """Run a case; nothing else may run meanwhile."""
        try:
            self.submit(request)
            return self.wait()[1]
        except BaseException:
            # Else the next case would be given the result of this one.
            self.close()
            raise

    def run_all(
        self, requests: Mapping[Key, CaseRequest], jobs: int
    ) -> Iterator[tuple[Key, CaseResult]]:
        """Yield the key and result of each run as it ends; so many run at a time."""
        pending, running = list(requests.items())[::-1], dict[int, Key]()
        while pending or running:
            while pending and len(running) < jobs:
                key, request = pending.pop()
                running[self.submit(request)] = key
            number, result = self.wait()
            yield running.pop(number), result

    def close(self) -> None:
        """End the server, and all that still runs."""
        if self._connection is not None:
            self._connection.close()
        if self._process is not None:
            try:
                self._process.wait(_END_SEC)
            except subprocess.TimeoutExpired:
                # Cases end with it, by the kernel.
                self._process.kill()
                self._process.wait()
        if self._folder:
            shutil.rmtree(self._folder, ignore_errors=True)
        self._connection = self._process = None

    def _require(self) -> Connection:
        if self._connection is None:
            message = 'the server of cases has not been started'
            raise ComposerError(message)
        return self._connection

    def _explain_end(self) -> ComposerError:
        code = self._process.wait() if self._process else None
        return ComposerError(f'the process that runs cases ended with exit code {code}')
