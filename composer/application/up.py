"""`composer up`: check a file, then run the system that it declares."""

from __future__ import annotations

import io
import os
import sys
from contextlib import suppress
from functools import partial
from time import time_ns
from typing import IO, TYPE_CHECKING

import click

from composer.application.output import show_findings
from composer.application.recording_options import RecordingOptions
from composer.application.system_reader import SystemReader, import_reading
from composer.application.timelines import write_timeline
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode, UsageError
from composer.interfaces.declared_packages import import_declared
from composer.language.values.start_reader import StartValueReader
from composer.network.local_networks import check_loopback, wait_for_network, wait_for_port
from composer.network.transport_profile import shared_memory_variables
from composer.network.variables import clear_others, drop_unknown_peers, ros_variables
from composer.planning.snapshot_taking import take_snapshot
from composer.processes.kernel import check_kernel
from composer.programs import shell_environment_kept
from composer.python_source.module_finder import project_search_path
from composer.runtime.environment import (
    check_log_folder,
    check_middleware,
    check_ros,
    check_shell,
    environment_set,
    find_colour,
)
from composer.runtime.workers.workers import Workers
from composer.scenarios.recognition import is_scenario_file

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from composer.application.reloader import Reloader
    from composer.checks.context import CheckContext
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec


def up(  # noqa: PLR0913 - one for each option
    paths: Sequence[Path],
    words: Sequence[str] = (),
    ros_arguments: Sequence[str] = (),
    log_levels: Sequence[str] = (),
    set_values: Sequence[str] = (),
    *,
    host: str = '',
    watches: bool = False,
    is_asked: bool = True,
    recording: RecordingOptions | None = None,
    hold: Path | None = None,
    trace: IO[str] | None = None,
    ends_process: bool = False,
) -> int:
    """Run a system until it ends; return the exit code.

    Args:
        paths: The file and its layers.
        words: Values for the arguments that the file declares.
        ros_arguments: As after `--ros-args` on a command line.
        log_levels: `debug` for all nodes, `talker:=debug` for one.
        set_values: Values to change, as in `nodes.talker.log_level=debug`.
        host: The host whose part runs here; empty for the whole system.
        watches: Whether edits of the files change the running system.
        is_asked: Whether the system serves what `composer reload` and the like ask.
        recording: What is recorded of it; `None` for nothing.
        hold: While this file is there, no behaviour starts; `None` for no such file.
        trace: The file for a timeline of the whole run; `None` for none.
        ends_process: Whether the process exits afterwards.

    Raises:
        RosNotFoundError: There is no rclpy.
        StartError: The system could not start, a port that it needs is in use, or the kernel
            lacks something.
        UsageError: The arguments do not fit the file, or the ROS arguments are wrong; or standard
            input is to be watched.
    """
    if ends_process and isinstance(sys.stdout, io.TextIOWrapper):
        # What behaviours print is shown at once, in a file, too; and in whole lines, also if
        # Python was told not to buffer: workers write there as well.
        sys.stdout.reconfigure(line_buffering=True, write_through=False)
    _refuse_scenario(paths[0])
    if watches and str(paths[0]) == '-':
        message = '--watch cannot watch standard input, which is read once'
        raise UsageError(message, help='give a file')
    if ends_process:
        check_kernel()
    reader = SystemReader(paths, words, set_values, host, StartValueReader(host), ros_arguments)
    begun_ns = time_ns()
    with Workers(ros_arguments, log_levels) as workers:
        context, _files, told = reader.read(
            loaded=lambda system: _spawn_early(workers, system, host)
        )
        show_findings(told)
        if context is None or has_errors(told):
            return ExitCode.FAILED
        check_ros()
        from composer.application.reloader import Reloader

        check_loopback(context.spec, {**os.environ, **ros_variables(context.spec)})
        wait_for_network(context.spec, lambda text: click.echo(text, err=True))
        wait_for_port(context.spec)
        variables = _find_variables(context.spec)
        with shell_environment_kept(), environment_set({**find_colour(), **variables}):
            check_shell(variables)
            check_log_folder(ros_arguments)
            check_middleware(os.environ)
            return _run(
                context,
                lambda prefixes: Reloader(reader, context, prefixes, begun_ns, told),
                workers,
                ros_arguments,
                log_levels,
                watches=watches,
                is_asked=is_asked,
                recording=recording or RecordingOptions(),
                hold=hold,
                trace=trace,
                ends_process=ends_process,
            )


def _find_variables(spec: SystemSpec) -> dict[str, str]:
    """Return the environment that a system starts in; tell what its network lacks."""
    variables = ros_variables(spec)
    if spec.host and spec.network:
        variables, unknown = drop_unknown_peers(clear_others(variables, os.environ))
        for name in unknown:
            text = f"network: there is no address of '{name}' now: it must find this host itself"
            click.echo(text, err=True)
    try:
        return {**shared_memory_variables(spec, {**os.environ, **variables}), **variables}
    except ComposerError as error:
        click.echo(f'network: {error}\n  help: {error.help}', err=True)
        return variables


def _spawn_early(workers: Workers, system: LoadedSystem, host: str) -> None:
    """Start the workers of a system while it is checked, if it is known what they start with."""
    spec = system.spec
    if spec is None or has_errors(system.diagnostics) or system.start.found:
        return
    # Which workers the part of a host has is known once all is checked.
    if host or spec.network or spec.interfaces:
        return
    # What is wrong is told when all is checked.
    with suppress(ComposerError):
        check_ros()
        variables = ros_variables(spec)
        variables |= shared_memory_variables(spec, {**os.environ, **variables})
        with environment_set({**find_colour(), **variables}):
            workers.spawn(spec)


def _refuse_scenario(path: Path) -> None:
    if str(path) != '-' and is_scenario_file(path):
        message = f"'{path}' is a scenario file, which tests a system"
        raise UsageError(message, help=f'run it with composer test {path}')


def _run(  # noqa: PLR0913 - as above
    context: CheckContext,
    create_reloader: Callable[[Sequence[Path]], Reloader],
    workers: Workers,
    ros_arguments: Sequence[str],
    log_levels: Sequence[str],
    *,
    watches: bool,
    is_asked: bool,
    recording: RecordingOptions,
    hold: Path | None,
    trace: IO[str] | None,
    ends_process: bool,
) -> int:
    from composer.interfaces.search_paths import extend_variables
    from composer.runtime.behaviours.callables import project_on_path

    prefixes = import_declared(context.interfaces, lambda line: click.echo(line, err=True))
    with (
        environment_set(extend_variables(os.environ, prefixes)),
        project_on_path(project_search_path(context.system.files)),
    ):
        snapshot = take_snapshot(context, prefixes)
        workers.spawn(snapshot.spec)
        # It imports ROS, as the workers do meanwhile.
        from composer.runtime.run import run_system

        with workers.importing():
            reading = import_reading(context, snapshot, show_findings, workers)
        if reading is None:
            return ExitCode.FAILED
        reloader = create_reloader(prefixes)
        with recording.recorder(context.spec.name) as recorder:
            return run_system(
                reading,
                watch=reloader.watching if watches else None,
                commands=reloader if is_asked else None,
                ros_arguments=ros_arguments,
                log_level_requests=log_levels,
                recorder=recorder,
                workers=workers,
                hold=hold,
                write_trace=None if trace is None else partial(write_timeline, trace),
                ends_process=ends_process,
            )
