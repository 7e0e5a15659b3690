"""Combinations: the arguments, layers and settings with which a system is checked.

They stand under `check:` in the system itself, or in a file of their own.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from composer.confidential import may_show_lines
from composer.diagnostics import Diagnostic, diagnostic_at
from composer.input_limits import MAX_COMBINATIONS
from composer.language.arguments import (
    ArgumentValues,
    find_help,
    find_value_problem,
    sample_values,
)
from composer.language.includes.include_entry import locate_file, shown_path
from composer.language.layers import merge_documents
from composer.language.paths import PathError
from composer.language.set_option import Setting, SettingError, apply_setting
from composer.records import record
from composer.ros_parameters.parameter_types import convert_parameter_value
from composer.spelling import suggest
from composer.yaml_text.document import Document
from composer.yaml_text.positions import Branch
from composer.yaml_text.reader import read_document

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.language.arguments import ArgumentSpec
    from composer.yaml_text.positions import DataPath, SourceMap

SECTION = 'check'
_FORM = "name the combinations, as in 'fast: {args: {speed: 2.0}}'"


@record
class Combination:
    """One combination.

    Attributes:
        name: The name that the file gives it.
        data: What it says: `args`, `layers` and `set`, as far as they are valid.
        positions: Those of the file.
    """

    name: str
    data: Mapping[str, Any]
    positions: SourceMap

    @property
    def at(self) -> DataPath:
        """Its path in the file."""
        return SECTION, self.name


def with_matrix(system: Document, matrix: Document) -> Document:
    """Return a system with the combinations of a matrix file in place of its own."""
    if system.data is None:
        return system
    if matrix.data is None:
        found = [_with_own_help(each) for each in matrix.diagnostics]
        return Document(system.data, system.positions, [*system.diagnostics, *found])
    positions = system.positions.copy()
    positions.remove((SECTION,))
    branch = Branch(tuple(matrix.positions.keys.items()), tuple(matrix.positions.values.items()))
    positions.graft((SECTION,), branch)
    data = system.data | {SECTION: matrix.data}
    return Document(data, positions, [*system.diagnostics, *matrix.diagnostics])


def read_combinations(system: Document) -> list[Combination]:
    """Return the combinations of a system; what the schema refuses is left out.

    That there are too many is added to its findings.
    """
    named = (system.data or {}).get(SECTION)
    if not isinstance(named, dict):
        return []
    if len(named) > MAX_COMBINATIONS:
        first = next(islice(named, MAX_COMBINATIONS, None))
        message = f'only the first {MAX_COMBINATIONS} combinations are checked'
        span = system.positions.key((SECTION, first))
        system.diagnostics.append(diagnostic_at(span, 'too-many-entries', message))
    return [
        Combination(name, entry, system.positions)
        for name, entry in islice(named.items(), MAX_COMBINATIONS)
        if isinstance(entry, dict)
    ]


def apply_combination(system: Document, combination: Combination) -> Document:
    """Return a system with the layers and settings of a combination.

    What is wrong with them is among its findings.
    """
    findings: list[Diagnostic] = []
    layers = _read_layers(combination, findings)
    changed = merge_documents([system, *layers])
    for setting in _list_settings(combination):
        if changed.data is not None:
            try:
                changed = apply_setting(changed, setting)
            except SettingError as error:
                findings.append(_describe(setting.path_span, error))
    return Document(changed.data, changed.positions, [*changed.diagnostics, *findings])


def values_from_combination(
    declared: Mapping[str, ArgumentSpec], combination: Combination, findings: list[Diagnostic]
) -> ArgumentValues:
    """Return the values that a combination gives; errors in them are added to the findings."""
    given = _entries(combination, 'args')
    samples = sample_values(declared)
    values, unknown = dict(samples.values), set(samples.samples)
    at, positions = (*combination.at, 'args'), combination.positions
    for name in given:
        if name not in declared:
            span, message = positions.key((*at, name)), f"there is no argument '{name}'"
            help_text = suggest(name, declared, 'the file declares')
            findings.append(diagnostic_at(span, 'unknown-argument', message, help=help_text))
    for name, argument in declared.items():
        if name in given:
            value = convert_parameter_value(given[name], argument.type)
            problem = find_value_problem(argument, value)
            if problem:
                span, near = positions.value((*at, name)), find_help(argument, value)
                findings.append(diagnostic_at(span, 'argument-type', problem, help=near))
            else:
                values[name] = value
                unknown.discard(name)
        elif argument.default is None:
            message = f"'{combination.name}' does not give the argument '{name}'"
            help_text = f"give it under 'args': {argument}"
            span = positions.key(combination.at)
            findings.append(diagnostic_at(span, 'missing-argument', message, help=help_text))
    origins = dict.fromkeys(given, f"combination '{combination.name}'")
    return ArgumentValues(values, unknown, origins)


def _read_layers(combination: Combination, findings: list[Diagnostic]) -> Iterator[Document]:
    layers = combination.data.get('layers')
    for index, text in enumerate(layers if isinstance(layers, list) else ()):
        span = combination.positions.value((*combination.at, 'layers', index))
        try:
            path = locate_file(str(text), span)
        except PathError as error:
            findings.append(_describe(span, error))
            continue
        if may_show_lines(str(path)):
            yield read_document(path, shown_path(path))
        else:
            # What is wrong with it would tell what is in it.
            message = f"'{text}' lies outside of the project"
            findings.append(diagnostic_at(span, 'bad-combination', message))


def _list_settings(combination: Combination) -> Iterator[Setting]:
    positions = combination.positions
    for path, value in _entries(combination, 'set').items():
        at = (*combination.at, 'set', path)
        yield Setting(path, value, positions.key(at), positions.value(at))


def _entries(combination: Combination, key: str) -> dict[str, Any]:
    entries = combination.data.get(key)
    return entries if isinstance(entries, dict) else {}


def _describe(span: Any, error: PathError | SettingError) -> Diagnostic:
    return diagnostic_at(span, 'bad-combination', str(error), help=error.help)


def _with_own_help(finding: Diagnostic) -> Diagnostic:
    """Return a finding in a file that holds no mapping, with the help for a matrix file."""
    if finding.help is None or 'version' not in finding.help:
        return finding
    message = 'a matrix file must be a mapping of names to combinations'
    return Diagnostic('wrong-type', message, finding.file, finding.span, help=_FORM)
