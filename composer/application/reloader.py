"""Edits of a system's files change the system while it runs."""

from __future__ import annotations

import math
import os
import threading
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

import click

from composer.application.output import show_findings
from composer.application.system_reader import import_reading, list_files
from composer.application.watched_files import WatchedFiles
from composer.confidential import conceal
from composer.diagnostics import has_errors
from composer.errors import ComposerError
from composer.interfaces.declared_packages import import_declared
from composer.interfaces.search_paths import extend_variables
from composer.planning.differences import compare, find_new_start
from composer.planning.snapshot_data import conceal_snapshot
from composer.planning.snapshot_taking import take_snapshot
from composer.planning.text import NEEDS_RESTART, render_plan
from composer.python_source.module_finder import project_search_path
from composer.reports.text import render_finding
from composer.runtime.health.system_state import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from composer.application.system_reader import SystemReader
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.planning.plan import Plan
    from composer.planning.snapshot import Snapshot
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.system import System

_RUNS_ON = 'the system runs on as it was'
_STOPS = 'the system stops'
# How often files are looked at while something is waited for.
_LOOK_SEC = 0.2
# Editors may write a file more than once for one save, of which one line is enough.
_SAVE_SEC = 2.0
_NO_CHANGE = 'nothing has changed'
_GOOD_AGAIN = 'the files have no errors any more, and nothing has changed'
_READ_AGAIN = 'the files were read again, and nothing has changed'


class Reloader:
    """Reads the files of a running system again, and lets it become what they say.

    Args:
        reader: Reads them.
        context: What they said when it started.
        prefixes: Where the interface packages are that were built for the system.
        begun_ns: When they began to be read, on the system's clock.
        told: What was found in them then.
    """

    def __init__(
        self,
        reader: SystemReader,
        context: CheckContext,
        prefixes: Sequence[Path],
        begun_ns: int | None = None,
        told: Iterable[Diagnostic] = (),
    ) -> None:
        self._reader = reader
        self._prefixes = prefixes
        self._folder = Path.cwd()
        self._paths = [self._folder / each for each in reader.paths]
        self._read_before = replace(context)
        self._files = WatchedFiles([*self._paths, *list_files(context)], begun_ns)
        self._lock = threading.Lock()
        self._aborts_goals = threading.Event()
        self._told = ToldFindings(told)
        self._next_look = 0.0
        # What runs, with the nodes that somebody has stopped.
        self._context = replace(context)
        self._whole: Snapshot | None = None
        self._stopped: frozenset[str] = frozenset()
        self._sends_big = False

    @property
    def given(self) -> dict[str, list[str]]:
        """See `Commands`."""
        return {
            'layers': [str(self._folder / each) for each in self._reader.paths[1:]],
            'words': [conceal(each) for each in self._reader.words],
            'set_values': [conceal(each) for each in self._reader.set_values],
            'stopped': sorted(self._stopped),
        }

    def reload(self, system: System) -> Outcome:
        """Read the files, and rewire the system; after errors it is as it was.

        What was done is logged, and errors are printed. Goals in flight of actions that go are
        waited for. If the files change meanwhile, all begins anew.
        """
        return self._reload(system, lambda: not self._files.list_changed())

    def _reload(self, system: System, is_whole: Callable[[], bool]) -> Outcome:
        """Do as `reload`.

        Args:
            is_whole: Whether files with errors are more than half written; may wait to see.
        """
        with self._lock, system.state.reloading():
            begun = monotonic()
            findings: list[Diagnostic] = []
            try:
                plan = self._rewire(system, findings, is_whole)
            except ComposerError as error:
                text = conceal(f'not reloaded: {error}')
                return self._note_failure(system, findings, text)
            return self._note_success(system, findings, plan, monotonic() - begun)

    def _note_failure(self, system: System, findings: list[Diagnostic], text: str) -> Outcome:
        from composer.runtime.logs import system_logger

        if not system.stop_requested and self._told.show(findings, text):
            system_logger.error(text)
        errors = [
            f'{each.span or each.file}: {each.message}' for each in findings if has_errors([each])
        ]
        system.state.note_reload(Outcome(succeeded=False, text='; '.join(errors) or text))
        return Outcome(succeeded=False, text=with_findings(findings, text))

    def _note_success(
        self, system: System, findings: list[Diagnostic], plan: Plan, took_sec: float
    ) -> Outcome:
        from composer.runtime.logs import system_logger

        was_good = not self._told.failure
        self._told.show(findings)
        text = _NO_CHANGE if was_good else _GOOD_AGAIN
        if plan:
            text = f'reloaded in {took_sec * 1000:.0f} ms: {plan.summarize()}'
            text += plan.describe_rebuilt()
        if plan or not was_good:
            system_logger.info(text)
        system.state.note_reload(Outcome(succeeded=True, text=text))
        return Outcome(succeeded=True, text=with_findings(findings, text))

    def reload_now(self, system: System) -> Outcome:
        """Do as `reload`, but abort goals; also those that another reload waits for."""
        self._aborts_goals.set()
        try:
            return self.reload(system)
        finally:
            self._aborts_goals.clear()

    def switch(self, system: System, node: str, *, runs: bool) -> Outcome:
        """Stop a node, or start one that was stopped, as the files said when they were read last.

        Goals of its actions are aborted.

        Args:
            node: Its full name.
        """
        from composer.runtime.logs import system_logger

        with self._lock, system.state.reloading():
            whole = self._whole or system.snapshot
            failure = self._why_no_switch(whole, node, runs=runs)
            if failure:
                return Outcome(succeeded=False, text=failure)
            before = self._stopped
            self._stopped = before - {node} if runs else before | {node}
            try:
                self._apply(system, [], self._context, whole)
            except ComposerError as error:
                self._stopped = before
                return Outcome(succeeded=False, text=conceal(str(error)))
            text = f"node '{node}' was {'started' if runs else 'stopped'}"
            system_logger.warning(text)
        return Outcome(succeeded=True, text=text)

    def _why_no_switch(self, whole: Snapshot, node: str, *, runs: bool) -> str:
        if node not in {each.full_name for each in whole.spec.nodes.values()}:
            return f"'{node}' is no node of Composer's: only these are stopped and started"
        if runs != (node in self._stopped):
            return f"node '{node}' {'runs' if runs else 'is stopped'} already"
        return ''

    def plan(self, system: System) -> Outcome:
        """Read the files, and tell what `reload` would do."""
        findings: list[Diagnostic] = []
        with self._lock:
            try:
                context = self._check(findings)
                new = take_snapshot(context, self._prefixes).without(self._stopped)
            except ComposerError as error:
                return Outcome(succeeded=False, text=with_findings(findings, conceal(str(error))))
            # Who asks may be anybody on the ROS graph.
            plan = compare(conceal_snapshot(system.snapshot), conceal_snapshot(new))
            text = render_plan(plan).rstrip('\n')
        return Outcome(succeeded=True, text=with_findings(findings, text))

    def _rewire(
        self, system: System, findings: list[Diagnostic], is_whole: Callable[[], bool]
    ) -> Plan:
        """Read the files, and rewire the system; anew as long as they change meanwhile."""
        while True:
            findings.clear()
            self._files.note_reading()
            try:
                return self._become(system, findings, is_whole)
            except _HalfWrittenError:
                continue
            except ComposerError:
                if system.stop_requested or is_whole():
                    raise

    def _become(
        self, system: System, findings: list[Diagnostic], is_whole: Callable[[], bool]
    ) -> Plan:
        context = self._check(findings)
        snapshot = take_snapshot(context, self._prefixes)
        self._files.also_follow(list_files(context))
        if cause := find_new_start(system.snapshot, snapshot):
            keys = ' and '.join(sorted({change.key for change in cause.changes}))
            message = f'{keys} cannot change while the system runs: {cause.reason}; '
            raise ComposerError(message + NEEDS_RESTART)
        if snapshot.definitions != system.snapshot.definitions:
            self._add_packages(context)
            snapshot = take_snapshot(context, self._prefixes)
        self._sends_big = any(each.rule == 'big-crossing-message' for each in findings)
        plan = self._apply(system, findings, context, snapshot, is_whole)
        self._files.follow([*self._paths, *list_files(context)])
        return plan

    def _apply(
        self,
        system: System,
        findings: list[Diagnostic],
        context: CheckContext,
        whole: Snapshot,
        is_whole: Callable[[], bool] | None = None,
    ) -> Plan:
        """Import the behaviours of a system, and become it, but for the stopped nodes.

        Args:
            is_whole: See `_reload`; `None` if the files were not read: newer ones are no matter
                then, and goals of actions that go are aborted.
        """
        from composer.runtime.rewiring.fresh_modules import fresh_modules
        from composer.runtime.rewiring.patience import import_with_patience

        aborts_goals = self._aborts_goals.is_set if is_whole else lambda: True
        is_outdated = self._is_outdated if is_whole else lambda: False
        snapshot = whole.without(self._stopped)
        stale = snapshot.stale_modules(system.snapshot)
        search_path = project_search_path(context.system.files)
        workers = system.workers
        with (
            fresh_modules(stale, snapshot.sources, search_path) as import_rest,
            workers.importing(),
        ):
            workers.give_room(snapshot.spec, sends_big=self._sends_big)
            workers.spawn(snapshot.spec)

            def import_all() -> Reading | None:
                reading = import_reading(context, snapshot, findings.extend, workers, stale)
                if reading is not None:
                    import_rest()
                return reading

            reading = import_with_patience(
                import_all,
                lambda: system.stop_requested or is_outdated(),
            )
            if reading is None:
                raise ComposerError(_RUNS_ON)
            if is_whole and _loses_parts(system.snapshot, snapshot) and not is_whole():
                raise _HalfWrittenError
            plan = system.rewire(reading, aborts_goals, is_outdated)
            if system.stop_requested:
                raise ComposerError(_STOPS)
        # A node that has left the files is not stopped if it comes back.
        self._stopped &= {each.full_name for each in whole.spec.nodes.values()}
        self._context, self._whole = replace(context), whole
        system.state.stopped = sorted(self._stopped)
        return plan

    def _add_packages(self, context: CheckContext) -> None:
        """Build and import the interface packages that were not declared before."""
        self._prefixes = import_declared(
            context.interfaces, lambda line: click.echo(line, err=True)
        )
        os.environ.update(extend_variables(os.environ, self._prefixes))

    def _is_outdated(self) -> bool:
        """Return whether the files have changed since they were read; looks at them at times."""
        now = monotonic()
        if now < self._next_look:
            return False
        self._next_look = now + _LOOK_SEC
        return bool(self._files.list_changed())

    def _check(self, findings: list[Diagnostic]) -> CheckContext:
        if any(str(path) == '-' for path in self._reader.paths):
            message = 'the system was read from standard input, which cannot be read again'
            raise ComposerError(message)
        context, files, found = self._reader_here().read(self._read_before)
        findings += found
        self._files.also_follow(files)
        if context is None or has_errors(found):
            raise ComposerError(_RUNS_ON)
        # A copy, without what its checks have found out.
        self._read_before = replace(context)
        return context

    def _reader_here(self) -> SystemReader:
        """Return what reads the files, also where a behaviour has changed the current folder."""
        try:
            folder = Path.cwd()
        except FileNotFoundError:
            # It was removed, and perhaps made anew.
            try:
                os.chdir(self._folder)
            except OSError as error:
                message = f"the folder '{self._folder}', where Composer was started, is gone"
                raise ComposerError(message) from error
            folder = self._folder
        return self._reader if folder == self._folder else replace(self._reader, paths=self._paths)

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
        from composer.runtime.behaviours.tracebacks import format_internal_error
        from composer.runtime.logs import system_logger

        told_sec = -math.inf
        for _ in self._files.edits(ended, system_logger.warning):
            # Other files of their folders may be written at any time.
            is_save = bool(self._files.list_changed()) and monotonic() > told_sec + _SAVE_SEC
            try:
                self._reload(system, lambda: self._files.are_still(ended))
            except Exception as error:  # noqa: BLE001 - the next edit may be fine
                system_logger.error(f'not reloaded:\n{format_internal_error(error)}')
            else:
                last = system.state.last_reload
                if is_save and last is not None and last.outcome.text == _NO_CHANGE:
                    system_logger.info(_READ_AGAIN)
            told_sec = monotonic()


class _HalfWrittenError(Exception):
    """The files changed while they were read, or soon after that."""


def _loses_parts(old: Snapshot, new: Snapshot) -> bool:
    """Return whether nodes or processes go: a file may have lost its end, and get it in a moment.

    This is where no lease tells that it is being written.
    """
    before, after = old.spec, new.spec
    return bool(
        before.nodes.keys() - after.nodes.keys()
        or before.processes.keys() - after.processes.keys()
    )


class ToldFindings:
    """What was printed of a system whose files are read again and again.

    Args:
        findings: What was printed first.

    Attributes:
        failure: The errors of the last reading, and what came of them; empty if it was good.
    """

    def __init__(self, findings: Iterable[Diagnostic] = ()) -> None:
        self.failure = ''
        self._warnings = _warnings_in(findings)

    def show(self, findings: Sequence[Diagnostic], failure: str = '') -> bool:
        """Print what was not told before; return whether there are errors that were not.

        Args:
            failure: What came of the errors.
        """
        told = self._warnings
        # Errors hide some.
        self._warnings = _warnings_in(findings) | (told if failure else set())
        errors = [each for each in findings if has_errors([each])]
        # Without errors in the files something was tried, and failed again.
        failure = with_findings(errors, failure) if errors else failure
        is_new = not errors or failure != self.failure
        self.failure = failure
        show_findings(
            each
            for each in findings
            if (is_new if has_errors([each]) else _key_of(each) not in told)
        )
        return is_new


def with_findings(findings: Iterable[Diagnostic], text: str) -> str:
    """Return a text after the findings that belong to it."""
    return '\n'.join([*(render_finding(each) + '\n' for each in findings), text])


def _key_of(finding: Diagnostic) -> tuple[str, str, str]:
    """Return what a finding is known by; its line changes with what is written above it."""
    return finding.file, finding.rule, finding.message


def _warnings_in(findings: Iterable[Diagnostic]) -> set[tuple[str, str, str]]:
    return {_key_of(each) for each in findings if not has_errors([each])}
