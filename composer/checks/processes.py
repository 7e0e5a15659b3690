"""External processes, and texts that launch files and shells evaluate, and nobody here."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

from composer.ament import (
    explain_missing_package,
    list_components,
    list_executables,
    list_packages,
)
from composer.checks.names import IS_EMPTY, check_rules
from composer.diagnostics import diagnostic_at
from composer.input_limits import explain_missing
from composer.language.paths import PathError, explain_absent, is_in_package, resolve_path
from composer.names import find_namespace_problem, find_node_name_problem
from composer.programs import (
    base_environment,
    find_program_problem,
    is_on_path,
    shell_environment,
)
from composer.ros_parameters.expressions_in_files import find_substitution
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ProcessSpec
    from composer.yaml_text.positions import DataPath

# What takes a script as its first argument after flags without values.
_INTERPRETERS = re.compile(r'(?:python|pypy)[\d.]*|(?:ba|da|z)?sh|perl|ruby')
_FLAGS = re.compile('-[bBdEeiIOPqsSuvx]+')
# What evaluates its arguments as a shell, or takes operators as arguments.
_EVALUATE = re.compile(
    r'-\w*c|(.*/)?((ba|da|k|z)?sh|ssh|su|watch|tmux|screen|xterm|expr|test|\[|dpkg|find)'
)
_VARIABLE = re.compile(r'(?:^|(?<=[=:,/_-]))(\$(?:[A-Z_][A-Z0-9_]*|\{[A-Z_][A-Z0-9_]*\}))(?!\w)')
_HOME = re.compile(r'(?:^|(?<==))~(?=/)')
_OPERATOR = re.compile(r'&&|\|\|?|[12&]?>>?(/\S*|&[12])?')
_SIGNS = re.compile(r'\$|~/|[|>&]')
# Commands of ROS 2 and its tools, which nobody misses where there is no ROS 2.
_OF_ROS = ('ros2', 'rviz', 'rqt', 'gz', 'plotjuggler', 'foxglove')


def check_processes(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that names in processes follow ROS's rules."""
    for process in context.spec.processes.values():
        yield from _check_process_names(context, process)


def check_executables(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that the programs of processes, and the folders that they run in, exist.

    Those that are left out by their `when` need not be: a driver is where its device is.
    """
    for process in context.spec.processes.values():
        yield from _check_executable(context, process)
        yield from _check_components(context, process)
        yield from _check_folder(context, process)
        yield from _check_program(context, process)
        yield from _check_script(context, process)


def check_unevaluated(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that no text has to be evaluated by a launch file or a shell."""
    values = context.system.positions.values
    sources = {span.source for span in values.values()}
    lines = {
        (source, number)
        for source in sources
        for number, line in enumerate(source.lines, 1)
        if _SIGNS.search(line)
    }
    for path, span in values.items():
        if (span.source, span.line) not in lines or path[-1:] == ('description',):
            continue
        text = span.text.strip('\'"')
        # Arguments by name are those of launch files, whose programs may know `~`.
        is_list = path[-2:-1] in (('command',), ('arguments',)) and isinstance(path[-1], int)
        is_command = is_list and 'parameters' not in path
        before = [values[at].text.strip('\'"') for at in _items_before(path) if at in values]
        if is_command and any(map(_EVALUATE.fullmatch, before)):
            continue
        who, found = 'nobody', find_substitution(text)
        if found is None and is_command:
            who, found = 'no shell', _find_for_shells(text, before)
        elif found is None and path[-2:-1] in (('env',), ('environment',)):
            who, found = 'no shell', None if 'parameters' in path else _find_variable(text)
        if found:
            message = f"{who} evaluates '{found[0]}' here: it stays text"
            place = span.narrowed_to(found[0], first=True)
            yield diagnostic_at(place, 'unevaluated-expression', message, help=f'write {found[1]}')


def _items_before(path: DataPath) -> Iterator[DataPath]:
    """Yield the paths of the items before that of a list."""
    for index in range(path[-1] if path and isinstance(path[-1], int) else 0):
        yield (*path[:-1], index)


def _find_variable(text: str) -> tuple[str, str] | None:
    """Return a variable as shells have them, and the expression for it."""
    found = None if '{{' in text else _VARIABLE.search(text)
    return (found[1], f"{{{{ env('{found[1].strip('${}')}') }}}}") if found else None


def _find_for_shells(text: str, before: Sequence[str]) -> tuple[str, str] | None:
    """Return what a shell evaluates in an argument, and what to write for it."""
    if before and _OPERATOR.fullmatch(text):
        return text, "command: [sh, -c, '…'], with the whole command line"
    is_name = '--ros-args' in before or ':=' in text
    if '{{' not in text and not is_name and _HOME.search(text):
        return '~', "{{ env('HOME') }}"
    return _find_variable(text)


def _check_process_names(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    path = process.path
    if not process.name.strip():
        yield context.at_key(
            path, 'bad-name', f"'{process.name}' cannot name a process: {IS_EMPTY}"
        )
    problem = find_node_name_problem(process.node_name) if process.node_name is not None else None
    if problem:
        message = f"'{process.node_name}' cannot name a node: {problem}"
        yield context.at_value((*path, 'name'), 'bad-name', message)
    listed = [each.full_name for each in process.nodes]
    if len(listed) > 1 and not process.components and not {*process.named_nodes} <= {*listed}:
        message = f"'name' renames all nodes of a process, and 'nodes' lists {len(listed)} others"
        advice = "leave out 'name', or list the node that has it alone"
        yield context.at_value((*path, 'name'), 'conflicting-keys', message, help=advice)
    problem = find_namespace_problem(process.namespace) if process.namespace else None
    if problem:
        message = f"'{process.namespace}': {problem}"
        yield context.at_value((*path, 'namespace'), 'bad-name', message)
    yield from check_rules(context, process)
    for component in process.components.values():
        if problem := find_namespace_problem(component.namespace):
            message = f"'{component.namespace}': {problem}"
            yield context.at_value((*component.path, 'namespace'), 'bad-name', message)
        yield from check_rules(context, component)


def _check_components(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    """Check that the packages of components are installed, and have their plugins.

    Of a container that is no executable of a package, nobody knows what it can load.
    """
    packages = list_packages() if process.package in list_packages() else []
    for component in process.components.values() if packages else ():
        if component.package not in packages:
            yield context.at_value(
                (*component.path, 'package'),
                'missing-package',
                f"no package '{component.package}' is installed",
                help=explain_missing_package(component.package, packages),
            )
            continue
        plugins = list_components(component.package)
        if component.plugin not in plugins:
            yield context.at_value(
                (*component.path, 'plugin'),
                'unknown-executable',
                f"'{component.package}' has no component '{component.plugin}'",
                help=suggest(component.plugin, plugins, 'it has', 'it has none'),
            )


def _check_executable(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    packages = list_packages()
    if process.package is None:
        return
    if process.package not in packages:
        yield context.at_value(
            (*process.path, 'package'),
            'missing-package',
            f"no package '{process.package}' is installed",
            help=explain_missing_package(process.package, packages),
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


def _check_folder(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    if process.cwd is None:
        return
    try:
        folder = resolve_path(process.cwd, Path())
    except PathError as error:
        at, help_text = (*process.path, 'cwd'), error.help
        yield context.at_value(at, 'uninstalled-package', str(error), help=help_text)
        return
    if os.path.isdir(folder):
        return
    message = f"there is no folder '{process.cwd}' to run in"
    at = (*process.path, 'cwd')
    help_text = explain_absent(folder, context.system.positions.value(at), is_folder=True)
    yield context.at_value(at, 'missing-folder', message, help=help_text)


def _check_script(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    """Check that the file exists that an interpreter is given as its script."""
    program, *arguments = process.command or ('',)
    index = sum(1 for _ in takewhile(_FLAGS.fullmatch, arguments))
    if not _INTERPRETERS.fullmatch(Path(program).name) or index == len(arguments):
        return
    script = Path(arguments[index])
    path = (*process.path, 'command', index + 1)
    place = context.system.positions.value(path)
    # Without `cwd` it runs where the system is started: here, or beside the file.
    folders = [Path(process.cwd)] if process.cwd else [Path(), place.source.folder]
    if script.name.startswith('-') or any(os.path.exists(folder / script) for folder in folders):
        return
    if (
        not os.path.isdir(folders[-1])
        or is_in_package(process.cwd or '')
        or is_on_path(str(script))
    ):
        return
    help_text = explain_missing(
        folders[-1] / script, None if script.is_absolute() else folders[-1]
    )
    message = f"there is no script '{script}'"
    yield context.at_value(path, 'missing-program', message, help=help_text)


def _check_program(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    if not process.command:
        return
    program = process.command[0]
    folder = Path(process.cwd or '.')
    at = (*process.path, 'command', 0)
    is_known = process.cwd is not None and os.path.isdir(folder)
    if '/' in program and not (is_known or Path(program).is_absolute()):
        # Without `cwd` it is searched from where the system is started: here, or beside the file.
        beside = context.system.positions.value(at).source.folder
        if process.cwd is None and not any(
            os.path.exists(each / program) for each in (folder, beside)
        ):
            message = f"there is no program '{program}' here, where a system without 'cwd' runs it"
            help_text = explain_missing(beside / program, beside)
            yield context.at_value(at, 'missing-program', message, help=help_text)
        return
    variables = {**shell_environment(), **context.spec.environment}
    environment = {**base_environment(variables), **process.env}
    if program.startswith(_OF_ROS) and not find_spec('rclpy'):
        return
    problem = find_program_problem(program, folder, environment)
    if problem:
        message, advice = problem
        yield context.at_value(at, 'missing-program', message, help=advice)
