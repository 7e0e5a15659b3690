"""Includes: other files as parts of this one, each with the arguments that it is given.

A file sees its own arguments, defaults and QoS profiles, and nothing of who includes it. What the
include says beside (`namespace`, `remap`) is applied to all that comes out of it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, Related, diagnostic_at
from composer.language.filling import MAX_ENTRIES, SECTIONS
from composer.language.flattening import Flattening, Inclusion, push_defaults
from composer.language.instances import ArgumentValues, Instance, read_instance, sample_values
from composer.language.namespaces import mend_namespace
from composer.language.parameters import convert_parameter_value, find_type_fault
from composer.language.paths import PathError, list_neighbours, resolve_path
from composer.language.profiles import drop_unknown_profiles
from composer.language.source import Document, read_document
from composer.names import did_you_mean, suggest

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from composer.diagnostics import Span
    from composer.language.arguments import ArgumentSpec
    from composer.language.positions import DataPath


_HERE = 'included here'


class Includer:
    """Reads the files that a file includes, and what these include, each file once.

    Args:
        folder: Where relative paths of a text without a file begin.
    """

    def __init__(self) -> None:
        self._documents: dict[Path, Document] = {}
        self._limit = 0
        self._inclusions = 0

    def include(self, instance: Instance, path: Path, chain: tuple[Related, ...] = ()) -> Instance:
        """Return an instance with all that it includes in it.

        Args:
            path: The file of the instance.
            chain: Where it is included itself, innermost first.
        """
        # An included file may ask for more; one that asks for nothing changes nothing.
        asked = instance.data.get('max_nodes', 0 if chain else MAX_ENTRIES)
        self._limit = max(self._limit, asked)
        entries = instance.data.pop('include', {})
        if not entries:
            return instance
        _settle(instance)
        flattening = Flattening(instance, chain)
        stack = (path.resolve(), *(Path(each.span.source.name).resolve() for each in chain))
        for name, entry in entries.items():
            at = ('include', name)
            if at in instance.left_out:
                continue
            part = self._read(instance, at, entry, stack, chain)
            if part is None:
                instance.dropped.add(at)
                continue
            flattening.add(Inclusion(part, at, mend_namespace(instance, at, entry)))
            if self._is_too_large(instance, at):
                break
        return instance

    def _is_too_large(self, instance: Instance, at: DataPath) -> bool:
        """Return whether a system has grown beyond its limit; say so once."""
        if self._inclusions > self._limit:
            return True
        counts = {section: len(instance.data.get(section, ())) for section in SECTIONS}
        self._inclusions += 1
        counts['include'] = self._inclusions
        section = max(counts, key=lambda each: counts[each])
        if counts[section] <= self._limit:
            return False
        self._inclusions = self._limit + 1
        instance.diagnostics.append(
            diagnostic_at(
                instance.positions.value((*at, 'file')),
                'too-many-entries',
                f'there are more than {self._limit:,} entries in {section} of all files',
                help="if that is meant, raise 'max_nodes' at the top of the file",
            )
        )
        return True

    def _read(
        self,
        instance: Instance,
        at: DataPath,
        entry: dict[str, Any],
        stack: tuple[Path, ...],
        chain: tuple[Related, ...],
    ) -> Instance | None:
        place = instance.positions.value((*at, 'file'))
        try:
            path = _locate(entry['file'], place)
        except PathError as error:
            instance.diagnostics.append(
                diagnostic_at(place, 'missing-include', str(error), help=error.help)
            )
            return None
        here = Related(_HERE, place)
        if path.resolve() in stack:
            message = f"'{entry['file']}' includes itself"
            related = [Related(_HERE, each.span) for each in chain]
            instance.diagnostics.append(
                diagnostic_at(place, 'include-cycle', message, related=related)
            )
            return None
        document = self._document(path)
        faults: list[Diagnostic] = []
        part = read_instance(
            document, lambda declared: _give(declared, instance, at, entry, faults)
        )
        instance.diagnostics += faults
        inner_chain = (here, *chain)
        if part is None:
            instance.diagnostics += _with_chain(document.diagnostics, inner_chain)
            return None
        _settle(part)
        own = part.diagnostics
        part.diagnostics = []
        part = self.include(part, path, inner_chain)
        instance.diagnostics += [*_with_chain(own, inner_chain), *part.diagnostics]
        instance.included |= {part.positions.source: None} | part.included
        return part

    def _document(self, path: Path) -> Document:
        resolved = path.resolve()
        if resolved not in self._documents:
            self._documents[resolved] = read_document(path, _shown(path))
        return self._documents[resolved]


def _settle(instance: Instance) -> None:
    """Let a file's defaults and profiles hold in this file alone."""
    push_defaults(instance)
    drop_unknown_profiles(instance)


def _locate(text: str, place: Span) -> Path:
    """Return the file that an include names.

    Raises:
        PathError: There is no such file.
    """
    path = resolve_path(text, place.source.folder)
    if not os.path.isfile(path):  # noqa: PTH113 - Path.is_file raises for names that are too long
        message = f"there is no file '{_shown(path)}'"
        raise PathError(message, help=did_you_mean(path.name, list_neighbours(path), 'there are'))
    return path


def _shown(path: Path) -> str:
    """Return a path as findings show it: from the working folder, where it lies below that."""
    plain = Path(os.path.normpath(path))
    try:
        return str(plain.resolve().relative_to(Path.cwd()))
    except ValueError:
        return str(plain)


def _give(
    declared: Mapping[str, ArgumentSpec],
    instance: Instance,
    at: DataPath,
    entry: dict[str, Any],
    faults: list[Diagnostic],
) -> ArgumentValues:
    """Return the values that an include gives."""
    given = entry.get('args', {})
    values = dict(sample_values(declared).values)
    origins: dict[str, str] = {}
    section = (*at, 'args')
    positions = instance.positions
    faults += [
        diagnostic_at(
            positions.key((*section, name)),
            'unknown-argument',
            f"'{entry['file']}' takes no argument '{name}'",
            help=did_you_mean(name, declared, 'it takes'),
        )
        for name in given
        if name not in declared
    ]
    unknown: list[str] = []
    for name, argument in declared.items():
        path = (*section, name)
        if name in given:
            value = convert_parameter_value(given[name], argument.type)
            fault = _find_fault(argument, value)
            if not fault:
                values[name] = value
                origins[name] = _origin(instance, path)
            elif positions.value(path) not in instance.sampled_spans:
                near = _nearest_choice(argument, value)
                faults.append(
                    diagnostic_at(positions.value(path), 'argument-type', fault, help=near)
                )
            if fault or positions.value(path) in instance.sampled_spans:
                unknown.append(name)
        elif path in instance.dropped or section in instance.dropped:
            unknown.append(name)
        elif argument.default is None:
            unknown.append(name)
            faults.append(
                _missing_argument(argument, entry['file'], positions.value((*at, 'file')))
            )
    return ArgumentValues(values, unknown, origins)


def _origin(instance: Instance, path: DataPath) -> str:
    note = instance.notes.get(path)
    return instance.positions.value(path).place + (f', {note}' if note else '')


def _missing_argument(argument: ArgumentSpec, file: str, place: Span) -> Diagnostic:
    message = f"'{file}' wants the argument '{argument.name}'"
    return diagnostic_at(
        place, 'missing-argument', message, help=f"give it under 'args': {argument}"
    )


def _nearest_choice(argument: ArgumentSpec, value: Any) -> str | None:
    choices = [choice for choice in argument.choices if isinstance(choice, str)]
    near = suggest(value, choices) if isinstance(value, str) else None
    return f"did you mean '{near}'?" if near else None


def _find_fault(argument: ArgumentSpec, value: Any) -> str | None:
    fault = find_type_fault(value, argument.type)
    if fault:
        return f"'{argument.name}': {fault}"
    if argument.choices and value not in argument.choices:
        choices = ', '.join(map(str, argument.choices))
        return f"'{argument.name}': {value!r} is none of {choices}"
    return None


def _with_chain(
    diagnostics: Collection[Diagnostic], chain: tuple[Related, ...]
) -> list[Diagnostic]:
    return [finding.with_related(chain) for finding in diagnostics]
