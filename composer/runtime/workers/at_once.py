"""Calls to several workers at the same time."""

from __future__ import annotations

import queue
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager

    from composer.runtime.workers.worker import Worker

# How long a worker may take to answer what is only asked.
ANSWER_SEC = 1.0


def do_at_once(
    workers: Sequence[Worker],
    do: Callable[[Worker], Any],
    ending: Callable[[Callable[[], None]], AbstractContextManager[bool]],
) -> Iterator[tuple[Worker, Any]]:
    """Do something with all workers, beginning now; yield each with its result.

    Args:
        ending: Has a function called if a stop is requested; then nothing more is waited for.

    Raises:
        ComposerError: It failed with one of them.
    """
    outcomes: queue.SimpleQueue[tuple[Worker, Any, BaseException | None] | None]
    outcomes = queue.SimpleQueue()

    def run(worker: Worker) -> None:
        try:
            outcomes.put((worker, do(worker), None))
        except BaseException as error:  # noqa: BLE001 - it is raised below
            outcomes.put((worker, None, error))

    for worker in workers:
        threading.Thread(target=run, args=(worker,), daemon=True).start()

    def results() -> Iterator[tuple[Worker, Any]]:
        with ending(lambda: outcomes.put(None)) as goes_on:
            for _ in range(len(workers) if goes_on else 0):
                outcome = outcomes.get()
                if outcome is None:
                    return
                worker, result, error = outcome
                if error is not None:
                    raise error
                yield worker, result

    return results()


def ask_all(
    workers: Sequence[Worker], what: str, *arguments: Any, timeout_sec: float = ANSWER_SEC
) -> dict[str, Any]:
    """Return what each worker answers that does in time, by name."""
    answers: dict[str, Any] = {}

    def ask(worker: Worker) -> None:
        with suppress(ComposerError):
            answers[worker.name] = worker.call(what, *arguments, timeout_sec=timeout_sec)

    alive = [each for each in workers if each.is_alive and each.has_imported]
    threads = [threading.Thread(target=ask, args=(each,), daemon=True) for each in alive]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return {name: answer for name, answer in answers.items() if answer is not None}
