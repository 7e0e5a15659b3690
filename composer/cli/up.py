"""`composer up`: check a file, then run the system that it declares."""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING, Any

import click

from composer.checks.checker import check_system, create_context
from composer.checks.ignore_comments import leave_out_silenced
from composer.cli.import_check import import_behaviours
from composer.cli.output import show_findings
from composer.diagnostics import has_errors
from composer.errors import ExitCode, RosNotFoundError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared import provide_declared
from composer.language.arguments import describe_arguments
from composer.language.pipeline import load_system
from composer.python_source.module_finder import project_search_path

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from composer.diagnostics import Diagnostic
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec

_NO_ROS_HELP = (
    "install it (pip install 'rclpy-composer[ros]'), or source yours: . /opt/ros/jazzy/setup.sh"
)


def up(
    paths: Sequence[Path],
    words: Sequence[str] = (),
    ros_arguments: Sequence[str] = (),
    log_levels: Sequence[str] = (),
    settings: Sequence[str] = (),
) -> int:
    """Run a system until it ends; return the exit code.

    Args:
        paths: The file, and layers over it.
        words: Values for the arguments that the file declares.
        ros_arguments: As after `--ros-args` on a command line.
        log_levels: `debug` for all loggers, `talker:=debug` for one.
        settings: Changes of single values, as in `nodes.talker.log_level=debug`.

    Raises:
        RosNotFoundError: There is no rclpy.
        StartError: The system could not be brought up.
        UsageError: The arguments do not fit the file, or the ROS arguments are wrong.
    """
    system = load_system(paths[0], words, layers=paths[1:], settings=settings)
    catalogue = InterfaceCatalogue()
    findings = check_system(system, catalogue)
    if _report(findings) or system.spec is None:
        return ExitCode.FAILED
    if importlib.util.find_spec('rclpy') is None:
        message = 'there is no rclpy in this Python, so nothing can run'
        raise RosNotFoundError(message, help=_NO_ROS_HELP)
    from composer.runtime.environment import check_middleware, environment_set

    # Before anything of ROS is imported, which reads it.
    with environment_set(system.spec.environment):
        check_middleware(system.spec.environment)
        return _run(system, system.spec, catalogue, ros_arguments, log_levels)


def _run(
    system: LoadedSystem,
    spec: SystemSpec,
    catalogue: InterfaceCatalogue,
    ros_arguments: Sequence[str],
    log_levels: Sequence[str],
) -> int:
    from composer.runtime.behaviours.functions import project_on_path
    from composer.runtime.run import run_system

    provide_declared(system, lambda line: click.echo(line, err=True))
    with project_on_path(project_search_path(system.files)):
        functions, findings = _import(system, catalogue)
        if _report(findings):
            return ExitCode.FAILED
        return run_system(
            spec,
            system.positions,
            functions,
            ros_arguments=ros_arguments,
            log_level_requests=log_levels,
        )


def describe_file_arguments(paths: Sequence[Path]) -> str:
    """Return which arguments a file declares, as its help shows them."""
    system = load_system(paths[0], layers=paths[1:])
    if system.spec is None:
        return 'the file cannot be read'
    return describe_arguments(system.arguments)


def _import(
    system: LoadedSystem, catalogue: InterfaceCatalogue
) -> tuple[dict[str, Callable[..., Any]], list[Diagnostic]]:
    """Import every behaviour; return the functions, and what is wrong that nobody ignores."""
    context, _ = create_context(system, catalogue)
    if context is None:
        return {}, []
    functions, findings = import_behaviours(context)
    # Comments that silence nothing were reported before.
    return functions, leave_out_silenced(findings, system.positions.source)


def _report(findings: list[Diagnostic]) -> bool:
    """Show findings; return whether they forbid a start."""
    show_findings(findings)
    return has_errors(findings)
