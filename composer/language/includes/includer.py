"""Includes: other files as parts of this one, each with the arguments that it is given.

A file sees its own arguments, defaults and QoS profiles, and nothing of who includes it. What the
include says beside (`namespace`, `remap`) applies to all that comes out of it.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from composer.diagnostics import diagnostic_at
from composer.expressions import MAX_ENTRIES, SECTIONS
from composer.language.includes.include_arguments import values_from_include
from composer.language.includes.include_entry import IncludeEntry, shown_path
from composer.language.includes.merging import IncludeMerger, Inclusion
from composer.language.loaded_system import LoadedSystem
from composer.yaml_text.reader import read_document

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path
    from typing import Any

    from composer.diagnostics import Diagnostic
    from composer.language.arguments import GiveValues
    from composer.yaml_text.document import Document


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
        self._documents: dict[Path, Document] = {}
        self._limit = system.entries.get('max_nodes', MAX_ENTRIES)
        self._inclusions = 0
        # Entries and includes that were read although they are left out.
        self._left_out = 0

    def include_all(self) -> None:
        """Add all that the file includes to it."""
        self._include(self._system, (self._system.path,), is_left_out=False)

    def _include(
        self, system: LoadedSystem, stack: tuple[Path, ...], *, is_left_out: bool
    ) -> None:
        """Add what a file includes to it.

        Args:
            stack: The file, and those that it is included in, innermost first.
            is_left_out: Whether it is read for its errors alone.
        """
        entries = system.entries.pop('include', {})
        merger = IncludeMerger(system)
        for entry in _used_first(entries, system):
            aside = is_left_out or entry.is_left_out
            if aside and self._left_out > self._limit:
                break
            part = self._read(entry, stack, is_left_out=aside)
            if part is None:
                system.dropped.add(entry.at)
                continue
            system.diagnostics += [each.with_related((entry.here,)) for each in part.diagnostics]
            if entry.is_left_out:
                part.leave_out_all()
            merger.add(Inclusion(part, entry, entry.find_namespace()))
            if aside:
                self._left_out += 1 + sum(len(part.entries.get(each, ())) for each in SECTIONS)
            elif self._is_too_large(entry):
                break

    def _is_too_large(self, entry: IncludeEntry) -> bool:
        """Return whether a system has grown beyond its limit; report it once."""
        if self._inclusions > self._limit:
            return True
        self._inclusions += 1
        counts = {each: _count_used(entry.system, each, self._limit) for each in SECTIONS}
        counts['include'] = self._inclusions
        section = max(counts, key=lambda each: counts[each])
        if counts[section] <= self._limit:
            return False
        self._inclusions = self._limit + 1
        message = f'{section} has more than {self._limit:,} entries in all files together'
        help_text = "raise 'max_nodes' at the top of the file if that is intended"
        entry.report('too-many-entries', message, help_text)
        return True

    def _read(
        self, entry: IncludeEntry, stack: tuple[Path, ...], *, is_left_out: bool
    ) -> LoadedSystem | None:
        """Return what an include brings; report it if nothing can be read, and return `None`."""
        path = entry.find_file()
        if path is None:
            return None
        if path.resolve() in [each.resolve() for each in stack]:
            entry.report('include-cycle', f"'{entry.file}' includes itself")
            return None
        part = LoadedSystem.of(self._document(path), path)
        if part.data is None:
            entry.system.diagnostics += [
                each.with_related((entry.here,)) for each in part.diagnostics
            ]
            return None
        self._load_file(part, partial(values_from_include, place=entry))
        if not is_left_out:
            part.diagnostics += self._find_unset(part)
        # An included file may ask for more; one that asks for nothing changes nothing.
        self._limit = max(self._limit, part.entries.get('max_nodes', 0))
        self._include(part, (path, *stack), is_left_out=is_left_out)
        return part

    def _document(self, path: Path) -> Document:
        resolved = path.resolve()
        if resolved not in self._documents:
            self._documents[resolved] = read_document(path, shown_path(path))
        return self._documents[resolved]

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


def _used_first(entries: Mapping[str, dict[str, Any]], system: LoadedSystem) -> list[IncludeEntry]:
    """Return the includes of a file; what is left out must not take names from what is used."""
    includes = [IncludeEntry(system, ('include', name), entries[name]) for name in entries]
    return sorted(includes, key=lambda entry: entry.is_left_out)


def _count_used(system: LoadedSystem, section: str, limit: int) -> int:
    """Return how many entries a section has; those that are left out count up to a limit."""
    count = len(system.entries.get(section, ()))
    if count <= limit:
        return count
    return count - sum(path[0] == section for path in system.left_out)
