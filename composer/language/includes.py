"""Includes: other files as parts of this one, each with the arguments that it is given.

A file sees its own arguments, defaults and QoS profiles, and nothing of who includes it. What the
include says beside (`namespace`, `remap`) is applied to all that comes out of it.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, Related, diagnostic_at
from composer.language.defaults import push_defaults
from composer.language.filling import MAX_ENTRIES, SECTIONS
from composer.language.flattening import Flattening, Inclusion
from composer.language.given_arguments import give_arguments
from composer.language.included_files import locate_file, shown_path
from composer.language.instances import Instance, read_instance
from composer.language.paths import PathError
from composer.language.profiles import drop_unknown_profiles
from composer.language.source import Document, read_document

if TYPE_CHECKING:
    from collections.abc import Collection

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
                continue
            flattening.add(Inclusion(part, at, entry))
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
            path = locate_file(entry['file'], place)
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
            document, lambda declared: give_arguments(declared, instance, at, entry, faults)
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
            self._documents[resolved] = read_document(path, shown_path(path))
        return self._documents[resolved]


def _settle(instance: Instance) -> None:
    """Let a file's defaults and profiles hold in this file alone."""
    push_defaults(instance)
    drop_unknown_profiles(instance)


def _with_chain(
    diagnostics: Collection[Diagnostic], chain: tuple[Related, ...]
) -> list[Diagnostic]:
    return [finding.with_related(chain) for finding in diagnostics]
