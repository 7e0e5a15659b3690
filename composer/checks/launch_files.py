"""Processes that run a launch file: the file, its arguments, and keys it has no use for."""

from __future__ import annotations

import ast
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from composer.ament import find_share
from composer.input_limits import UnreadableFileError, read_file
from composer.language.includes.include_entry import shown_path
from composer.language.paths import PackagePathError, PathError, explain_absent, resolve_path
from composer.programs import base_environment, is_on_path, shell_environment
from composer.records import record
from composer.spelling import suggest
from composer.yaml_text.reader import parse_document

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ProcessSpec

# Larger files are not read for their arguments.
_MAX_BYTES = 1_000_000
# With these a Python file may declare arguments that no reading of it shows.
_OPAQUE = frozenset(('IncludeLaunchDescription', 'OpaqueFunction', 'For', 'While', 'ListComp'))


@record
class DeclaredArguments:
    """The arguments that a launch file declares.

    Attributes:
        names: All of them.
        required: Those without a default value.
    """

    names: frozenset[str]
    required: frozenset[str]


def check_launch_files(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that launch files exist, and the keys and arguments beside them make sense."""
    for process in context.spec.processes.values():
        findings = [*_check_arguments_form(context, process)]
        if process.launch is not None:
            findings += _check_keys(context, process)
            findings += [] if findings else _check_file(context, process, process.launch)
        yield from findings
        if process.launch is not None and not findings:
            yield from _check_ros2(context, process)


def read_launch_arguments(path: Path) -> DeclaredArguments | None:
    """Return the arguments that a launch file declares; `None` if only running it would tell."""
    try:
        content = read_file(path, _MAX_BYTES)
        text = content.decode()
        if path.suffix == '.xml':
            return _read_xml(ET.fromstring(text))  # noqa: S314 - a file of the user, as all are
        if path.suffix in ('.yaml', '.yml'):
            return _read_yaml(parse_document(content, path.name).data)
        return _read_python(ast.parse(text))
    except (UnreadableFileError, ValueError, SyntaxError, ET.ParseError):
        return None
    except RecursionError:
        return None


def _check_arguments_form(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    at = (*process.path, 'arguments')
    written = _written(context, process).get('arguments', {} if process.launch else [])
    if isinstance(written, dict) == (process.launch is not None):
        return
    if process.launch is None:
        message, help_text = 'expected a list of arguments, got a mapping', 'one item each'
    else:
        message = 'expected the arguments of the launch file by name, got a list'
        help_text = 'as in {use_sim_time: true}'
    yield context.at_value(at, 'wrong-type', message, help=help_text)


def _check_keys(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    written = _written(context, process)
    keys = ('executable', 'package', 'name', 'namespace', 'parameters', 'parameter_files')
    for key in (*keys, 'remap', 'log_level'):
        if key in written:
            message = f"'launch' and '{key}' cannot be used together in process '{process.name}'"
            help_text = (
                "a launch file names its own programs and what they get: pass it 'arguments', or "
                "let 'composer import' make processes of it"
            )
            yield context.at_key((*process.path, key), 'conflicting-keys', message, help=help_text)


def _written(context: CheckContext, process: ProcessSpec) -> dict[str, Any]:
    entries: dict[str, Any] = context.system.entries.get('processes', {})
    entry: dict[str, Any] = entries.get(process.name, {})
    return entry


def _check_file(context: CheckContext, process: ProcessSpec, launch: str) -> Iterator[Diagnostic]:
    at = (*process.path, 'launch')
    try:
        path = resolve_path(launch, Path())
    except PathError as error:
        is_package = isinstance(error, PackagePathError)
        rule = 'missing-package' if is_package else 'missing-launch-file'
        yield context.at_value(at, rule, str(error), help=error.help)
        return
    if os.path.isfile(path):
        yield from _check_arguments(context, process, path)
        return
    message = f"there is no launch file '{shown_path(path)}'"
    help_text = explain_absent(path, context.system.positions.value(at))
    yield context.at_value(at, 'missing-launch-file', message, help=help_text)


def _check_arguments(
    context: CheckContext, process: ProcessSpec, path: Path
) -> Iterator[Diagnostic]:
    declared = read_launch_arguments(path)
    if declared is None:
        return
    given = [each.partition(':=')[0] for each in process.arguments]
    for name in given:
        if name not in declared.names:
            yield context.at_key(
                (*process.path, 'arguments', name),
                'bad-launch-argument',
                f"'{path.name}' declares no argument '{name}'",
                help=suggest(name, declared.names, 'it declares', 'it declares none'),
            )
    for name in sorted(declared.required.difference(given)):
        message = f"'{path.name}' requires the argument '{name}', which has no default value"
        help_text = f'arguments: {{{name}: …}}'
        yield context.at_value(
            (*process.path, 'launch'), 'bad-launch-argument', message, help=help_text
        )


def _check_ros2(context: CheckContext, process: ProcessSpec) -> Iterator[Diagnostic]:
    variables = {**shell_environment(), **context.spec.environment}
    environment = {**base_environment(variables), **process.env}
    if is_on_path('ros2', environment.get('PATH')):
        return
    message = "there is no program 'ros2' on the PATH, which runs launch files"
    source = 'source it' if find_share('ros2launch') else 'install ros-$ROS_DISTRO-ros2launch'
    help_text = f'{source}, or run the system where ROS 2 is sourced'
    yield context.at_value((*process.path, 'launch'), 'missing-program', message, help=help_text)


def _read_xml(root: ET.Element) -> DeclaredArguments | None:
    if root.find('.//include') is not None:
        return None
    # An <arg> of an <include> is a value, not a declaration.
    found = {each.get('name', ''): each.get('default') for each in root.iter('arg')}
    return DeclaredArguments(
        frozenset(found), frozenset(name for name, default in found.items() if default is None)
    )


def _read_yaml(data: Any) -> DeclaredArguments | None:
    entries = data.get('launch') if isinstance(data, dict) else None
    if not isinstance(entries, list) or 'include' in _keys_in(data):
        return None
    declared = [each['arg'] for each in entries if isinstance(each, dict) and 'arg' in each]
    if len(declared) != _keys_in(data).count('arg') or not all(
        isinstance(each, dict) and 'name' in each for each in declared
    ):
        return None
    return DeclaredArguments(
        frozenset(str(each['name']) for each in declared),
        frozenset(str(each['name']) for each in declared if 'default' not in each),
    )


def _keys_in(data: Any) -> list[Any]:
    if isinstance(data, dict):
        return [*data, *(key for value in data.values() for key in _keys_in(value))]
    return [key for item in data for key in _keys_in(item)] if isinstance(data, list) else []


def _read_python(tree: ast.Module) -> DeclaredArguments | None:
    names, required = set(), set()
    for node in ast.walk(tree):
        word = getattr(node, 'id', None) or getattr(node, 'attr', None) or type(node).__name__
        if word in _OPAQUE:
            return None
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith('DeclareLaunchArgument'):
            first = node.args[0] if node.args else None
            keywords = {each.arg: each.value for each in node.keywords}
            given = keywords.get('name', first)
            if not isinstance(given, ast.Constant) or None in keywords:
                return None
            names.add(str(given.value))
            if 'default_value' not in keywords and len(node.args) < 2:  # noqa: PLR2004 - the second
                required.add(str(given.value))
    is_declared = 'DeclareLaunchArgument' in ast.dump(tree)
    return (
        DeclaredArguments(frozenset(names), frozenset(required))
        if names or not is_declared
        else None
    )
