"""`composer show`: print the final system, its arguments, or its parameters.

Comments that silence rules are kept where a check of the output would find more without them than
a check of the files.
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import click

from composer.application.file_selection import load_given
from composer.application.output import show_findings
from composer.checks.checker import check_system, create_context
from composer.checks.parameter_files import check_parameter_files
from composer.confidential import origin_of
from composer.diagnostics import has_errors
from composer.errors import ExitCode
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.arguments import describe_arguments
from composer.language.parameter_files import names_used, read_given_file
from composer.language.parsing.container_parser import unfold_containers
from composer.language.paths import with_folder
from composer.language.pipeline import load_system_text
from composer.language.values.start_reader import StartValueReader
from composer.language.values.start_values import replace_start_values
from composer.ros_parameters.file_writer import render_parameter_file
from composer.ros_parameters.overrides import find_overrides
from composer.yaml_text.comments import read_ignore_comments
from composer.yaml_text.writer import Expression, render_yaml

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import NodeSpec
    from composer.yaml_text.positions import DataPath, SourceMap

# Keys that have no meaning any more once a system is resolved.
_RESOLVED_KEYS = ('args', 'vars', 'check', 'max_nodes')
_SIM_TIME = 'use_sim_time'


def show(
    paths: Sequence[Path],
    words: Sequence[str],
    set_values: Sequence[str],
    *,
    format_name: str,
    origins: bool,
) -> int:
    """Print the final system; return the exit code.

    Raises:
        UsageError: The arguments or `--set` do not fit the file.
    """
    system = load_given(paths, words, set_values, reader=StartValueReader(), is_shown=True)
    show_findings(system.diagnostics)
    if has_errors(system.diagnostics):
        return ExitCode.FAILED
    data = final_data(system)
    if format_name == 'json':
        click.echo(json.dumps(data, indent=2))
    else:
        remark = (lambda path: describe_origin(system, path)) if origins else None
        comments = find_kept_comments(system, render_yaml(data))
        click.echo(append_comments(render_yaml(data, remark=remark), comments), nl=False)
    return ExitCode.DONE


def show_arguments(paths: Sequence[Path], set_values: Sequence[str]) -> int:
    """Print the arguments that a file declares; return the exit code.

    Raises:
        UsageError: `--set` does not fit the file.
    """
    system = load_given(paths, set_values=set_values, is_shown=True)
    show_findings(system.diagnostics)
    click.echo(describe_arguments(system.arguments))
    return ExitCode.FAILED if has_errors(system.diagnostics) else ExitCode.DONE


def show_parameters(paths: Sequence[Path], words: Sequence[str], set_values: Sequence[str]) -> int:
    """Print the parameters of all nodes as one parameter file; return the exit code.

    Raises:
        UsageError: The arguments or `--set` do not fit the file.
    """
    system = load_given(paths, words, set_values, reader=StartValueReader(), is_shown=True)
    findings = _check_parameters(system)
    show_findings(findings)
    if has_errors(findings) or system.spec is None:
        return ExitCode.FAILED
    nodes = system.spec.nodes.values()
    click.echo(
        render_parameter_file({node.full_name: final_values(node) for node in nodes}), nl=False
    )
    return ExitCode.DONE


def final_data(system: LoadedSystem) -> dict[str, Any]:
    """Return a system as data that `composer up` accepts, from any folder."""
    data = {
        key: value
        for key, value in system.entries.items()
        if key not in _RESOLVED_KEYS
        and not key.startswith('x-')
        and (value != {} or key == 'nodes')
    }
    return unfold_containers(_with_absolute_paths(data))


def describe_origin(system: LoadedSystem, path: DataPath) -> str:
    """Return where a value was written, and where the values in its expressions come from."""
    if not path:
        return ''
    if path[0] == 'containers':
        path = ('processes', *path[1:])
    place = system.positions.value(path).place
    note = system.notes.get(path)
    return f'{place}, {note}' if note else place


def final_values(node: NodeSpec) -> dict[str, tuple[str, Any]]:
    """Return the type and value of each parameter of a node that has a value, by name."""
    files = map(read_given_file, node.parameter_files)
    overrides = find_overrides(files, node.full_name)
    values = {_SIM_TIME: ('bool', True)} if node.use_sim_time else {}
    if _SIM_TIME in overrides:
        values[_SIM_TIME] = 'bool', overrides[_SIM_TIME].value
    for name, spec in node.parameters.items():
        value = overrides[name].value if name in overrides else spec.value
        if value is not None:
            values[name] = str(spec.type), value
    return values


def _check_parameters(system: LoadedSystem) -> list[Diagnostic]:
    context = create_context(system, InterfaceCatalogue())
    found = check_parameter_files(context) if context else ()
    return list(dict.fromkeys([*system.diagnostics, *found]))


def _with_absolute_paths(data: dict[str, Any]) -> dict[str, Any]:
    absolute = dict(data)
    if 'interfaces' in data:
        packages = data['interfaces'].items()
        absolute['interfaces'] = {name: with_folder(entry, _absolute) for name, entry in packages}
    if 'environment' in data:
        absolute['environment'] = _without_values(data['environment'])
    for section in ('nodes', 'processes', 'workers', 'hosts'):
        if section in data:
            entries = data[section].items()
            absolute[section] = {name: _entry_with_absolute(entry) for name, entry in entries}
    return replace_start_values(absolute, lambda _, value: _with_absolute_file(value))


def _given_absolute(file: str | dict[str, Any]) -> str | dict[str, Any]:
    if isinstance(file, str):
        return _absolute(file)
    changed = dict(_with_absolute_file(file))
    values = file.get('expressions')
    if isinstance(values, dict):
        changed['expressions'] = _without_values(names_used(file['file'], values))
    return changed


def _with_absolute_file(value: dict[str, Any]) -> dict[str, Any]:
    return value | {'file': _absolute(value['file'])} if 'file' in value else value


def _entry_with_absolute(entry: dict[str, Any]) -> dict[str, Any]:
    changed: dict[str, Any] = {}
    if 'cwd' in entry:
        changed['cwd'] = _absolute(entry['cwd'])
    if 'parameter_files' in entry:
        changed['parameter_files'] = [*map(_given_absolute, entry['parameter_files'])]
    if 'components' in entry:
        components = entry['components'].items()
        changed['components'] = {name: _entry_with_absolute(each) for name, each in components}
    if 'identity_file' in entry and not entry['identity_file'].startswith('~'):
        changed['identity_file'] = _absolute(entry['identity_file'])
    for key in ('env', 'environment'):
        if key in entry:
            changed[key] = _without_values(entry[key])
    return entry | changed


def _without_values(variables: dict[str, Any]) -> dict[str, Any]:
    """Return variables without those values that are from the environment itself."""
    return {name: _hidden(value) for name, value in variables.items()}


def _hidden(value: Any) -> Any:
    origin = origin_of(value)
    if origin is None or not origin.startswith('env('):
        return value
    name = origin.partition('"')[2].rpartition('"')[0]
    if os.environ.get(name) != value:
        return f'<from {origin}>'
    return Expression(f"{{{{ env('{name}') }}}}")


def _absolute(path: str) -> str:
    # Not `Path.resolve`: symbolic links stay as they are written.
    return path if path.startswith('package://') else os.path.abspath(path)  # noqa: PTH100


def find_kept_comments(system: LoadedSystem, text: str) -> dict[int, str]:
    """Return the comments to print, by line number.

    Args:
        text: The output without comments.
    """
    silenced = _find_silenced(system.positions.sources())
    if not silenced:
        return {}
    shown = load_system_text(text, system.path, [])
    places = _paths_by_line(shown.positions)
    rules: dict[int, set[str]] = defaultdict(set)
    for finding in check_system(shown, InterfaceCatalogue()):
        span = finding.span
        if span is None or span.source is not shown.positions.source:
            continue
        written = _lines_of(system.positions, places[span.line])
        if any(finding.rule in silenced.get(each, ()) for each in written):
            rules[span.line].add(finding.rule)
    return {line: f'# composer: ignore[{", ".join(sorted(rules[line]))}]' for line in rules}


def append_comments(text: str, comments: Mapping[int, str]) -> str:
    """Return a text with comments at the ends of its lines, given by line number."""
    lines = text.splitlines(keepends=True)
    for number, comment in comments.items():
        line = lines[number - 1].rstrip('\n')
        lines[number - 1] = f'{line}  {comment}\n'
    return ''.join(lines)


def _find_silenced(sources: Iterable[SourceFile]) -> dict[tuple[SourceFile, int], set[str]]:
    """Return the rules that comments name, by file and line."""
    found: dict[tuple[SourceFile, int], set[str]] = {}
    for source in sources:
        for comment in read_ignore_comments(source):
            rules = {rule.text for rule in comment.rules}
            found.setdefault((source, comment.span.line), set()).update(rules)
    return found


def _paths_by_line(positions: SourceMap) -> dict[int, list[DataPath]]:
    paths: dict[int, list[DataPath]] = defaultdict(list)
    for spans in (positions.keys, positions.values):
        for path, span in spans.items():
            paths[span.line].append(path)
    return paths


def _lines_of(positions: SourceMap, paths: Iterable[DataPath]) -> set[tuple[SourceFile, int]]:
    """Return the files and lines in which the keys and values at some paths were written."""
    spans: set[Span] = set()
    for path in paths:
        spans |= {positions.key(path), positions.value(path)}
    return {(span.source, span.line) for span in spans}
