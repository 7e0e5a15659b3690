"""`composer up`: check a file, then run the system that it declares."""

from __future__ import annotations

import importlib.util
import os
from typing import TYPE_CHECKING

import click

from composer.checks.checker import check_in_context, create_context
from composer.checks.ignore_comments import IgnoreComments
from composer.cli.common.file_selection import load_given
from composer.cli.common.import_check import import_behaviours
from composer.cli.common.output import show_findings
from composer.diagnostics import has_errors
from composer.errors import ExitCode, RosNotFoundError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared_packages import import_declared
from composer.language.arguments import describe_arguments
from composer.python_source.module_finder import project_search_path

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic

_NO_ROS_HELP = (
    "install it (pip install 'rclpy-composer[ros]'), or source yours: . /opt/ros/jazzy/setup.sh"
)


def up(
    paths: Sequence[Path],
    words: Sequence[str] = (),
    ros_arguments: Sequence[str] = (),
    log_levels: Sequence[str] = (),
    set_values: Sequence[str] = (),
    *,
    ends_process: bool = False,
) -> int:
    """Run a system until it ends; return the exit code.

    Args:
        paths: The file and its layers.
        words: Values for the arguments that the file declares.
        ros_arguments: As after `--ros-args` on a command line.
        log_levels: `debug` for all nodes, `talker:=debug` for one.
        set_values: Values to change, as in `nodes.talker.log_level=debug`.
        ends_process: Whether the process exits afterwards.

    Raises:
        RosNotFoundError: There is no rclpy.
        StartError: The system could not start.
        UsageError: The arguments do not fit the file, or the ROS arguments are wrong.
    """
    system = load_given(paths, words, set_values)
    context = create_context(system, InterfaceCatalogue())
    if _report(check_in_context(system, context)) or context is None:
        return ExitCode.FAILED
    if importlib.util.find_spec('rclpy') is None:
        message = 'cannot run without ROS 2: this Python has no rclpy'
        raise RosNotFoundError(message, help=_NO_ROS_HELP)
    # These import nothing of ROS, which reads its environment when it is imported.
    from composer.runtime.environment import (
        check_log_folder,
        check_middleware,
        check_shell,
        environment_set,
        find_colour,
    )

    variables = context.spec.environment
    with environment_set({**find_colour(), **variables}):
        check_shell(variables)
        check_log_folder(ros_arguments)
        check_middleware(os.environ)
        return _run(context, ros_arguments, log_levels, ends_process=ends_process)


def _run(
    context: CheckContext,
    ros_arguments: Sequence[str],
    log_levels: Sequence[str],
    *,
    ends_process: bool,
) -> int:
    from composer.interfaces.search_paths import extend_processes, extend_variables
    from composer.runtime.behaviours.callables import project_on_path
    from composer.runtime.environment import environment_set
    from composer.runtime.run import run_system

    system = context.system
    prefixes = import_declared(context.interfaces, lambda line: click.echo(line, err=True))
    with (
        environment_set(extend_variables(os.environ, prefixes)),
        project_on_path(project_search_path(system.files)),
    ):
        functions, findings = import_behaviours(context)
        # The check has already reported comments that silence nothing.
        comments = IgnoreComments(system.positions.source)
        if _report([each for each in findings if not comments.silence(each)]):
            return ExitCode.FAILED
        return run_system(
            extend_processes(context.spec, prefixes),
            system.positions,
            functions,
            ros_arguments=ros_arguments,
            log_level_requests=log_levels,
            ends_process=ends_process,
        )


def describe_file_arguments(paths: Sequence[Path]) -> str:
    """Return the arguments that a file declares, as `--help` shows them."""
    system = load_given(paths)
    if system.spec is None:
        return 'the file cannot be read'
    return describe_arguments(system.arguments)


def _report(findings: list[Diagnostic]) -> bool:
    """Print findings; return whether any is an error."""
    show_findings(findings)
    return has_errors(findings)
