"""Includes: other files as parts of this one, each with the arguments that it is given.

A file sees its own arguments, defaults and QoS profiles, and nothing of who includes it. What the
include says beside (`namespace`, `remap`) applies to all that comes out of it.
"""

from __future__ import annotations

import os
from functools import partial
from typing import TYPE_CHECKING, Any

from composer.confidential import may_show_lines
from composer.diagnostics import Diagnostic, diagnostic_at, errors_first
from composer.expressions import SECTIONS
from composer.input_limits import MAX_ENTRIES, MAX_FINDINGS, MAX_INCLUDE_DEPTH, MAX_VALUES
from composer.language.arguments import (
    ArgumentValues,
    find_help,
    find_value_problem,
    sample_values,
)
from composer.language.includes.include_entry import IncludeEntry, shown_path
from composer.language.includes.merging import IncludeMerger, Inclusion
from composer.language.loaded_system import LoadedSystem, Reaching
from composer.language.namespaces import join_namespaces
from composer.language.values.start_values import StartValues
from composer.ros_parameters.parameter_types import convert_parameter_value
from composer.spelling import suggest
from composer.yaml_text.reader import read_document

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping
    from pathlib import Path

    from composer.language.arguments import ArgumentSpec, GiveValues
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath

# How often an entry may be merged on average: once for each file around it.
_MOST_MERGED = 2


class _TooLargeError(Exception):
    """The system has too many entries.

    Attributes:
        findings: What says so.
    """

    def __init__(self, findings: Iterable[Diagnostic]) -> None:
        super().__init__()
        self.findings = list(findings)


class Includer:
    """Reads the files that a file includes, and what these include, each file once.

    What an include brings whose `when` does not hold is read as well, and left out as a whole.

    Args:
        system: The file that is started: no other one sets environment variables.
        load_file: Takes an included file through the steps before this one.
    """

    def __init__(
        self, system: LoadedSystem, load_file: Callable[[LoadedSystem, GiveValues], None]
    ) -> None:
        self._system = system
        self._load_file = load_file
        self._documents: dict[str, Document] = {}
        self._limit = system.entries.get('max_nodes', MAX_ENTRIES)
        self._inclusions = 0
        # Entries that were merged, once for each file around them.
        self._merged = 0
        # Of the files alone, and with all that they include.
        self._values = 0
        self._merged_values = 0
        # Entries and includes that were read although they are left out.
        self._left_out = 0

    def include_all(self) -> None:
        """Add all that the file includes to it."""
        try:
            self._include(self._system, (_real(self._system.path),), is_left_out=False)
        except _TooLargeError as error:
            self._system.diagnostics += error.findings
            # The rest would take long, and its findings may have no other cause.
            self._system.data = None

    def _include(self, system: LoadedSystem, stack: tuple[str, ...], *, is_left_out: bool) -> None:
        """Add what a file includes to it.

        Args:
            stack: The file, and those that it is included in, innermost first, without links.
            is_left_out: Whether it is read for its errors alone.
        """
        entries = system.entries.pop('include', {})
        merger = IncludeMerger(system)
        for entry in _used_first(entries, system):
            aside = is_left_out or entry.is_left_out
            if aside and self._left_out > self._limit:
                break
            self._inclusions += not aside
            self._check_size(entry)
            namespace = entry.find_namespace()
            part = self._read(entry, namespace, stack, is_left_out=aside)
            if part is None:
                system.dropped.add(entry.at)
                continue
            system.diagnostics += _found_in(part, entry)
            if entry.is_left_out:
                part.leave_out_all()
            merger.add(Inclusion(part, entry, namespace))
            brought = 1 + sum(len(part.entries.get(each, ())) for each in SECTIONS)
            self._merged_values += len(part.positions.values)
            if aside:
                self._left_out += brought
            else:
                self._merged += brought
            self._check_size(entry)

    def _check_size(self, entry: IncludeEntry) -> None:
        """Raise if the system has grown beyond its limit."""
        counts = {each: _count_used(entry.system, each, self._limit) for each in SECTIONS}
        counts['include'] = self._inclusions
        section = max(counts, key=lambda each: counts[each])
        most_entries = _MOST_MERGED * max(self._limit, MAX_ENTRIES)
        help_text: str | None = "raise 'max_nodes' at the top of the file if that is intended"
        if counts[section] > self._limit:
            message = f'{section} has more than {self._limit:,} entries in all files together'
        elif self._merged > most_entries:
            message = f'includes in includes bring more than {most_entries:,} entries'
        elif self._values > MAX_VALUES or self._merged_values > _MOST_MERGED * MAX_VALUES:
            message = f'the includes bring more than {MAX_VALUES:,} keys and values'
            help_text = None
        else:
            return
        finding = diagnostic_at(entry.span, 'too-many-entries', message, help=help_text)
        raise _TooLargeError([finding])

    def _read(
        self, entry: IncludeEntry, namespace: str, stack: tuple[str, ...], *, is_left_out: bool
    ) -> LoadedSystem | None:
        """Return what an include brings; report it if nothing can be read, and return `None`."""
        path = entry.find_file()
        if path is None:
            return None
        real = _real(path)
        if real in stack:
            entry.report('include-cycle', f"'{entry.file}' includes itself")
            return None
        if len(stack) > MAX_INCLUDE_DEPTH:
            message = f'files include each other more than {MAX_INCLUDE_DEPTH} levels deep'
            entry.report('too-deep', message)
            return None
        part = LoadedSystem.of(self._document(path, real), path)
        part.namespace = join_namespaces(entry.system.namespace, namespace)
        part.ros_arguments = entry.system.ros_arguments
        # What is left out takes no change from what is used.
        part.reaching = Reaching() if is_left_out else entry.system.reaching
        part.start = StartValues() if is_left_out else entry.system.start
        if 'version' not in part.entries and not may_show_lines(real):
            # What is wrong with it would tell what is in it.
            message = f"'{entry.file}' is not a system, and lies outside of the project"
            entry.report('missing-include', message)
            return None
        if part.data is None:
            entry.system.diagnostics += _found_in(part, entry)
            return None
        self._load_file(part, partial(values_from_include, place=entry))
        if part.data is None:
            raise _TooLargeError(_found_in(part, entry))
        self._values += len(part.positions.values)
        if self._values > MAX_VALUES:
            self._check_size(entry)
        if not is_left_out:
            part.diagnostics += self._find_unset(part)
        # An included file may ask for more; one that asks for nothing changes nothing.
        self._limit = max(self._limit, part.entries.get('max_nodes', 0))
        try:
            self._include(part, (real, *stack), is_left_out=is_left_out)
        except _TooLargeError as error:
            others = (each.with_related((entry.here,)) for each in error.findings)
            raise _TooLargeError([*_found_in(part, entry), *others]) from error
        return part

    def _document(self, path: Path, real: str) -> Document:
        if real not in self._documents:
            self._documents[real] = read_document(path, shown_path(path))
        return self._documents[real]

    def _find_unset(self, part: LoadedSystem) -> Iterator[Diagnostic]:
        """Yield warnings of environment variables that only the started file could set."""
        environment = self._system.entries.get('environment', {})
        for name in part.entries.get('environment', {}):
            if name not in environment:
                yield diagnostic_at(
                    part.positions.key(('environment', name)),
                    'ignored-environment',
                    f"'{name}' is not set: only the environment of the main file counts",
                    help="set it in that file, or for a process under 'env'",
                )


def _found_in(part: LoadedSystem, entry: IncludeEntry) -> list[Diagnostic]:
    """Return the findings of an included file for the file around it, as many as are shown."""
    room = max(MAX_FINDINGS + 1 - len(entry.system.diagnostics), 0)
    first = errors_first(part.diagnostics)[:room]
    return [each.with_related((entry.here,)) for each in first]


def _real(path: Path) -> str:
    # As Path.resolve, but for links that lead back to themselves.
    return os.path.realpath(path)


def _used_first(entries: Mapping[str, dict[str, Any]], system: LoadedSystem) -> list[IncludeEntry]:
    """Return the includes of a file; what is left out must not take names from what is used."""
    includes = [IncludeEntry(system, ('include', name), entries[name]) for name in entries]
    return sorted(includes, key=lambda entry: entry.is_left_out)


def _count_used(system: LoadedSystem, section: str, limit: int) -> int:
    """Return how many entries a section has; those that are left out count up to a limit."""
    entries = system.entries.get(section, ())
    if len(entries) <= limit:
        return len(entries)
    return sum((section, name) not in system.left_out for name in entries)


def values_from_include(
    declared: Mapping[str, ArgumentSpec], place: IncludeEntry
) -> ArgumentValues:
    """Return the values that an include gives; errors in them are added to its file."""
    findings = place.system.diagnostics
    given = place.data.get('args', {})
    values = dict(sample_values(declared).values)
    origins: dict[str, str] = {}
    section = (*place.at, 'args')
    findings += _find_unknown(declared, given, place)
    unknown: list[str] = []
    for name, argument in declared.items():
        path = (*section, name)
        if name in given:
            value = convert_parameter_value(given[name], argument.type)
            problem = find_value_problem(argument, value)
            if not problem:
                values[name] = value
                origins[name] = _origin(place.system, path)
            elif not place.is_open(path):
                span = place.system.positions.value(path)
                near = find_help(argument, value)
                findings.append(diagnostic_at(span, 'argument-type', problem, help=near))
            if problem or place.is_open(path):
                unknown.append(name)
        elif not place.system.dropped.isdisjoint((path, section)):
            unknown.append(name)
        elif argument.default is None:
            unknown.append(name)
            findings.append(_missing_argument(argument, place))
    return ArgumentValues(values, unknown, origins)


def _find_unknown(
    declared: Mapping[str, ArgumentSpec], given: Mapping[str, Any], place: IncludeEntry
) -> Iterator[Diagnostic]:
    for name in [each for each in given if each not in declared]:
        yield diagnostic_at(
            place.system.positions.key((*place.at, 'args', name)),
            'unknown-argument',
            f"'{place.file}' takes no argument '{name}'",
            help=suggest(name, declared, 'it takes'),
        )


def _origin(system: LoadedSystem, path: DataPath) -> str:
    note = system.notes.get(path)
    return system.positions.value(path).place + (f', {note}' if note else '')


def _missing_argument(argument: ArgumentSpec, place: IncludeEntry) -> Diagnostic:
    message = f"'{place.file}' needs the argument '{argument.name}'"
    help_text = f"give it under 'args': {argument}"
    return diagnostic_at(place.span, 'missing-argument', message, help=help_text)
