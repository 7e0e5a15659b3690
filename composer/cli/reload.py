"""Edits of a system's files change the system while it runs."""

from __future__ import annotations

import os
import threading
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

import click

from composer.cli.common.output import show_findings
from composer.cli.common.system_reader import import_reading
from composer.cli.rehearsal import rehearse
from composer.diagnostics import has_errors
from composer.errors import ComposerError
from composer.interfaces.declared_packages import import_declared
from composer.interfaces.search_paths import extend_variables
from composer.language.paths import resolve_path
from composer.planning.differences import compare, find_new_start
from composer.planning.snapshot import take_snapshot
from composer.planning.text import render_plan
from composer.reports.text import render_finding

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.checks.context import CheckContext
    from composer.cli.common.system_reader import Report, SystemReader
    from composer.diagnostics import Diagnostic
    from composer.planning.plan import Operation, Plan
    from composer.runtime.health.system_state import Outcome
    from composer.runtime.system import System

# Changes of these files may change a system; parameter files may have any name.
_SUFFIXES = ('.yaml', '.yml', '.py', '.msg', '.srv', '.action')
# An editor writes a file in several steps: the last one counts.
_STEP_MS = 10
_DEBOUNCE_MS = 100
_LOOK_MS = 500
_RUNS_ON = 'the system runs on as it was'
_STOPS = 'the system stops'
_NO_CHANGE = 'nothing has changed'


class Reloader:
    """Reads the files of a running system again, and lets it become what they say.

    Args:
        reader: Reads them.
        context: What they said when it started.
        prefixes: Where the interface packages are that were built for the system.
    """

    def __init__(
        self, reader: SystemReader, context: CheckContext, prefixes: Sequence[Path]
    ) -> None:
        self._reader = reader
        self._prefixes = prefixes
        self._files = _list_files(reader, context)
        self._seen = _stamps(self._files)
        self._lock = threading.Lock()
        self._aborts_goals = threading.Event()

    def reload(self, system: System) -> Outcome:
        """Read the files, and rewire the system; after errors it is as it was.

        What was done is logged, and errors are printed. Goals in flight of actions that go are
        waited for.
        """
        from composer.runtime.health.system_state import Outcome
        from composer.runtime.logs import system_logger

        with self._lock, system.state.reloading():
            begun = monotonic()
            findings: list[Diagnostic] = []
            try:
                plan = self._rewire(system, findings)
            except ComposerError as error:
                text = f'not reloaded: {error}'
                system_logger.error(text)
                errors = [
                    f'{each.span or each.file}: {each.message}'
                    for each in findings
                    if has_errors([each])
                ]
                system.state.note_reload(Outcome(succeeded=False, text='; '.join(errors) or text))
                return Outcome(succeeded=False, text=_with_findings(findings, text))
            took_ms = (monotonic() - begun) * 1000
            text = _NO_CHANGE
            if system.starts_again:
                text = f'the system starts again: {summarize(plan)}'
                system_logger.info(text)
            elif plan:
                text = f'reloaded in {took_ms:.0f} ms: {summarize(plan)}'
                system_logger.info(text)
            system.state.note_reload(Outcome(succeeded=True, text=text))
            return Outcome(succeeded=True, text=_with_findings(findings, text))

    def reload_now(self, system: System) -> Outcome:
        """Do as `reload`, but abort goals; also those that another reload waits for."""
        self._aborts_goals.set()
        try:
            return self.reload(system)
        finally:
            self._aborts_goals.clear()

    def plan(self, system: System) -> Outcome:
        """Read the files, and tell what `reload` would do."""
        from composer.runtime.health.system_state import Outcome

        findings: list[Diagnostic] = []
        with self._lock:
            try:
                context = self._check(findings.extend)
                new = take_snapshot(context, self._prefixes)
            except ComposerError as error:
                return Outcome(succeeded=False, text=_with_findings(findings, str(error)))
            text = render_plan(compare(system.snapshot, new)).rstrip('\n')
        return Outcome(succeeded=True, text=_with_findings(findings, text))

    def _rewire(self, system: System, findings: list[Diagnostic]) -> Plan:
        from composer.runtime.rewiring.fresh_modules import fresh_modules

        def report(found: list[Diagnostic]) -> None:
            findings.extend(found)
            show_findings(found)

        self._seen = _stamps(self._files)
        context = self._check(report)
        self._note_files(self._files | _list_files(self._reader, context))
        snapshot = take_snapshot(context, self._prefixes)
        if cause := find_new_start(system.snapshot, snapshot):
            self._start_again(system, cause)
            if not system.starts_again:
                raise ComposerError(_STOPS)
            return compare(system.snapshot, snapshot)
        if snapshot.definitions != system.snapshot.definitions:
            self._add_packages(system, context)
            snapshot = take_snapshot(context, self._prefixes)
        stale = snapshot.stale_modules(system.snapshot)
        with fresh_modules(stale, snapshot.sources):
            reading = import_reading(context, snapshot, report)
            if reading is None:
                raise ComposerError(_RUNS_ON)
            plan = system.rewire(reading, self._aborts_goals.is_set)
            if system.stop_requested:
                raise ComposerError(_STOPS)
        self._note_files(_list_files(self._reader, context))
        return plan

    def _start_again(self, system: System, cause: Operation) -> None:
        """Have the whole system start again, if it can."""
        from composer.runtime.logs import system_logger

        changes = ' and '.join(sorted({each.key for each in cause.changes}))
        if not system.can_start_again:
            message = f'{changes} cannot change while the system runs: {cause.reason}'
            raise ComposerError(
                message, help='end the program that it runs in, and start that again'
            )
        system_logger.info(f'reload: the system must start again, because of {changes}')
        rehearse(system)
        system.start_again(self._aborts_goals.is_set)

    def _add_packages(self, system: System, context: CheckContext) -> None:
        """Build and import the interface packages that were not declared before."""
        if system.can_start_again:
            # Another process can be ended whatever it does.
            rehearse(system)
        self._prefixes = import_declared(
            context.interfaces, lambda line: click.echo(line, err=True)
        )
        os.environ.update(extend_variables(os.environ, self._prefixes))

    def _check(self, report: Report) -> CheckContext:
        if any(str(path) == '-' for path in self._reader.paths):
            message = 'the system was read from standard input, which cannot be read again'
            raise ComposerError(message)
        context = self._reader.check(report)
        if context is None:
            raise ComposerError(_RUNS_ON)
        return context

    def _note_files(self, files: set[Path]) -> None:
        """Watch these files; those that are new were read just now."""
        self._seen.update(_stamps(files - self._files))
        self._files = files

    @contextmanager
    def watching(self, system: System) -> Iterator[None]:
        """Reload the system whenever a file changes, until the block ends."""
        ended = threading.Event()
        thread = threading.Thread(
            target=self._watch, args=(system, ended), name='watch files', daemon=True
        )
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def _watch(self, system: System, ended: threading.Event) -> None:
        from watchfiles import watch

        while not ended.is_set():
            folders = {path.parent for path in self._files}
            changes = watch(
                *folders,
                watch_filter=lambda _change, path: self._matters(path),
                stop_event=ended,
                step=_STEP_MS,
                debounce=_DEBOUNCE_MS,
                rust_timeout=_LOOK_MS,
                yield_on_timeout=True,
                recursive=False,
            )
            for changed in changes:
                # Nothing tells of edits before the watch began, or on some network drives.
                if changed or any(self._seen.get(p) != s for p, s in _stamps(self._files).items()):
                    self.reload(system)
                if folders != {path.parent for path in self._files}:
                    break

    def _matters(self, path: str) -> bool:
        return path.endswith(_SUFFIXES) or Path(path) in self._files


def _with_findings(findings: list[Diagnostic], text: str) -> str:
    """Return a text after the findings that belong to it."""
    return '\n'.join([*(render_finding(each) + '\n' for each in findings), text])


def summarize(plan: Plan) -> str:
    """Return `~1 timer, +2 subscriptions`."""
    counts = Counter((each.action, each.noun) for each in plan.operations)
    return ', '.join(
        f'{action.value}{count} {noun if count == 1 else f"{noun}s"}'
        for (action, noun), count in counts.items()
    )


def _stamps(files: set[Path]) -> dict[Path, tuple[int, ...] | None]:
    """Return what changes when a file is written or replaced; `None` for no file."""
    stamps: dict[Path, tuple[int, ...] | None] = {}
    for path in files:
        try:
            status = path.stat()
        except OSError:
            stamps[path] = None
        else:
            stamps[path] = status.st_mtime_ns, status.st_size, status.st_ino
    return stamps


def _list_files(reader: SystemReader, context: CheckContext) -> set[Path]:
    """Return the files that a system is read from, as their real paths."""
    spec = context.spec
    files = {*reader.paths, *context.system.files, *context.modules.read_files()}
    named = [
        *(each.parameter_files for each in spec.nodes.values()),
        *(each.parameter_files for each in spec.processes.values()),
    ]
    files |= {resolve_path(text, Path()) for texts in named for text in texts}
    for package in context.interfaces.definitions or ():
        files |= {package.folder / name for name in package.sources}
    return {path.resolve() for path in files}
