"""The system of a command line as it is read before it runs, and again after each edit."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.application.file_selection import create_loader
from composer.application.host_part import find_part
from composer.application.output import show_findings
from composer.checks.ignore_comments import IgnoreComments
from composer.diagnostics import has_errors
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.paths import PathError, resolve_path
from composer.language.values.start_reader import StartValueReader
from composer.language.values.start_values import list_named_files
from composer.python_source.module_finder import project_search_path
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.bindings import Binding
    from composer.language.loaded_system import LoadedSystem
    from composer.planning.snapshot import Snapshot
    from composer.runtime.rewiring.reading import Reading
    from composer.runtime.workers.workers import Workers

Report: TypeAlias = 'Callable[[list[Diagnostic]], None]'


@record
class SystemReader:
    """Reads a system.

    Attributes:
        paths: The file and its layers.
        words: Values for the arguments that the file declares.
        set_values: Values to change.
        host: The host whose part runs here; empty for the whole system.
        reader: Reads the values that are known when the system starts.
        ros_arguments: The arguments after `--ros-args` of the command line.
    """

    paths: Sequence[Path]
    words: Sequence[str]
    set_values: Sequence[str]
    host: str = ''
    reader: StartValueReader = field(default_factory=StartValueReader)
    ros_arguments: Sequence[str] = ()

    def check(self, report: Report = show_findings) -> CheckContext | None:
        """Return a system without errors; `None` if there are errors.

        Args:
            report: Takes the findings; by default they are printed.

        Raises:
            UsageError: The arguments do not fit the file.
        """
        context, _files, findings = self.read()
        report(findings)
        return None if has_errors(findings) else context

    def read(
        self,
        before: CheckContext | None = None,
        loaded: Callable[[LoadedSystem], object] = lambda _system: None,
    ) -> tuple[CheckContext | None, list[Path], list[Diagnostic]]:
        """Return a system, if there is one, the files that it names, and what is wrong with it.

        With `host`, it is the part that runs there, of a system that is read as a whole.

        Args:
            before: What was read before: what is the same in it is kept.
            loaded: Called before the system is checked, which takes longer than to read it.

        Raises:
            UsageError: The arguments do not fit the file, or nothing of it runs on the host.
            StartValueError: A value that is known when the system starts cannot be read.
        """
        system_before = before.system if before else None
        load = create_loader(
            self.paths, self.words, self.set_values, system_before, self.ros_arguments
        )
        system = load()
        loaded(system)
        # It is much code, which is read meanwhile.
        from composer.checks.checker import check_in_context, create_context

        context = create_context(system, InterfaceCatalogue(), before)
        findings = check_in_context(system, context, host=self.host)
        if system.start.found and not has_errors(findings):
            # No command is run for a system with errors.
            system = load(read_value=self.reader.read)
            context = create_context(system, InterfaceCatalogue(), before)
            findings = check_in_context(system, context, host=self.host)
        if context and self.host and not has_errors(findings):
            context = find_part(context, self.host)
        named = list_files(context) if context else {*system.files, *system.named}
        return context, [*self.paths, *named], findings


def import_reading(
    context: CheckContext,
    snapshot: Snapshot,
    report: Report = show_findings,
    workers: Workers | None = None,
    stale: Collection[str] = (),
) -> Reading | None:
    """Import the behaviours of a system; return `None` if they have errors.

    Args:
        report: Takes the findings; by default they are printed.
        workers: Import those of their nodes; `None` if all are imported here.
        stale: The modules that workers execute anew.
    """
    from composer.runtime.behaviours.import_check import import_behaviours
    from composer.runtime.rewiring.reading import Reading

    system = context.system
    own = snapshot.spec
    elsewhere: Iterator[tuple[Binding, Any]] = iter(())
    if workers is not None and workers.are_used:
        own = own.in_worker('')
        search_path = project_search_path(system.files)
        elsewhere = workers.import_behaviours(snapshot, search_path, stale)
    functions, findings = import_behaviours(context, own, elsewhere)
    # The check has already reported comments that silence nothing.
    comments = IgnoreComments(system.positions.source)
    shown = [each for each in findings if not comments.silence(each)]
    report(shown)
    if has_errors(shown):
        return None
    return Reading(snapshot.spec, system.positions, functions, snapshot)


def list_files(context: CheckContext) -> set[Path]:
    """Return the files that a system is read from, and those that it lacks."""
    spec = context.spec
    files = {*context.system.files, *context.system.named, *context.modules.list_files()}
    files |= list_named_files(context.system.start.found)
    named = [
        *(each.parameter_files for each in spec.nodes.values()),
        *(each.parameter_files for each in spec.processes.values()),
        *(each.parameter_files for each in spec.components),
    ]
    for text in (file.file for files in named for file in files):
        # A package that is not installed is for the checks to say.
        with suppress(PathError):
            files.add(resolve_path(text, Path()))
    for package in context.interfaces.definitions or ():
        files |= {package.folder / name for name in package.sources}
    return files
