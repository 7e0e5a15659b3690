"""External processes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.ament import list_executables, list_packages
from composer.checks.names import check_rules
from composer.names import find_namespace_problem, find_node_name_problem
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ProcessSpec


def check_processes(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that names in processes follow ROS's rules."""
    for process in context.spec.processes.values():
        yield from _check_process_names(context, process)


def check_executables(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that the packages and executables of processes are installed.

    Those that are left out by their `when` need not be: a driver is where its device is.
    """
    for process in context.spec.processes.values():
        yield from _check_executable(context, process)


def _check_process_names(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    path = process.path
    problem = find_node_name_problem(process.node_name) if process.node_name is not None else None
    if problem:
        message = f"'{process.node_name}' cannot name a node: {problem}"
        yield context.at_value((*path, 'name'), 'bad-name', message)
    problem = find_namespace_problem(process.namespace) if process.namespace else None
    if problem:
        message = f"'{process.namespace}': {problem}"
        yield context.at_value((*path, 'namespace'), 'bad-name', message)
    yield from check_rules(context, process)


def _check_executable(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    packages = list_packages()
    if process.package is None or not packages:
        return
    if process.package not in packages:
        yield context.at_value(
            (*process.path, 'package'),
            'missing-package',
            f"no package '{process.package}' is installed",
            help=suggest(process.package, packages, 'there are'),
        )
        return
    names = [path.name for path in list_executables(process.package)]
    if process.executable not in names:
        yield context.at_value(
            (*process.path, 'executable'),
            'unknown-executable',
            f"'{process.package}' has no executable '{process.executable}'",
            help=suggest(process.executable, names, 'it has', 'it has none'),
        )
