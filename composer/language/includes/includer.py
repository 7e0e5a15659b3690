"""Includes: other files as parts of this one, each with the arguments that it is given.

A file sees its own arguments, defaults and QoS profiles, and nothing of who includes it. What the
include says beside (`namespace`, `remap`) is applied to all that comes out of it.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, Related, diagnostic_at
from composer.expressions.filling import MAX_ENTRIES, SECTIONS
from composer.language.defaults import push_defaults
from composer.language.includes.include_arguments import give_arguments
from composer.language.includes.include_entry import IncludePlace
from composer.language.includes.included_files import locate_file, shown_path
from composer.language.includes.included_namespaces import mend_namespace
from composer.language.includes.merging import Flattening, Inclusion
from composer.language.includes.profile_names import drop_unknown_profiles
from composer.language.instances import Instance, read_instance
from composer.language.paths import PathError
from composer.yaml_text.reader import Document, read_document

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping


_HERE = 'included here'


class Includer:
    """Reads the files that a file includes, and what these include, each file once.

    What an include brings whose `when` does not hold is read as well, and left out as a whole.

    Args:
        environment: The variables that the file sets which is started: no other file sets any.
    """

    def __init__(self, environment: Collection[str]) -> None:
        self._environment = environment
        self._documents: dict[Path, Document] = {}
        self._limit = 0
        self._inclusions = 0
        # Entries and includes that were read although they are left out.
        self._left_out = 0

    def include(
        self,
        instance: Instance,
        path: Path,
        chain: tuple[Related, ...] = (),
        *,
        is_left_out: bool = False,
    ) -> Instance:
        """Return an instance with all that it includes in it.

        Args:
            path: The file of the instance.
            chain: Where it is included itself, innermost first.
            is_left_out: Whether it is read for its faults alone.
        """
        # An included file may ask for more; one that asks for nothing changes nothing.
        asked = instance.data.get('max_nodes', 0 if chain else MAX_ENTRIES)
        self._limit = max(self._limit, asked)
        entries = instance.data.pop('include', {})
        if not entries:
            return instance
        _settle(instance)
        flattening = Flattening(instance, chain)
        for place in _used_first(entries, instance):
            aside = is_left_out or place.is_left_out
            if aside and self._left_out > self._limit:
                break
            part = self._read(place, path, chain, is_left_out=aside)
            if part is None:
                instance.dropped.add(place.at)
                continue
            if place.is_left_out:
                part.leave_out_all()
            entry = mend_namespace(instance, place.at, place.entry)
            flattening.add(Inclusion(part, place.at, entry))
            if aside:
                self._left_out += 1 + sum(len(part.data.get(each, ())) for each in SECTIONS)
            elif self._is_too_large(place, chain):
                break
        return instance

    def _is_too_large(self, place: IncludePlace, chain: tuple[Related, ...]) -> bool:
        """Return whether a system has grown beyond its limit; say so once."""
        if self._inclusions > self._limit:
            return True
        self._inclusions += 1
        counts = {each: _count_used(place.instance, each, self._limit) for each in SECTIONS}
        counts['include'] = self._inclusions
        section = max(counts, key=lambda each: counts[each])
        if counts[section] <= self._limit:
            return False
        self._inclusions = self._limit + 1
        message = f'there are more than {self._limit:,} entries in {section} of all files'
        help_text = "if that is meant, raise 'max_nodes' at the top of the file"
        place.report('too-many-entries', message, chain, help_text)
        return True

    def _read(
        self,
        place: IncludePlace,
        parent: Path,
        chain: tuple[Related, ...],
        *,
        is_left_out: bool,
    ) -> Instance | None:
        """Return what an include brings, or say what is wrong with it and return `None`."""
        path = _find_file(place, chain)
        if path is None:
            return None
        stack = (parent, *(Path(each.span.source.name) for each in chain))
        if path.resolve() in [each.resolve() for each in stack]:
            place.report('include-cycle', f"'{place.file}' includes itself", chain)
            return None
        instance, document = place.instance, self._document(path)
        faults: list[Diagnostic] = []
        part = read_instance(document, lambda declared: give_arguments(declared, place, faults))
        instance.diagnostics += _with_chain(faults, chain)
        inner_chain = (Related(_HERE, place.span), *chain)
        if part is None:
            instance.diagnostics += _with_chain(document.diagnostics, inner_chain)
            return None
        _settle(part)
        own = part.diagnostics
        if not is_left_out:
            own += _find_unset(part, self._environment)
        part.diagnostics = []
        part = self.include(part, path, inner_chain, is_left_out=is_left_out)
        instance.diagnostics += [*_with_chain(own, inner_chain), *part.diagnostics]
        instance.included |= {part.positions.source: None} | part.included
        return part

    def _document(self, path: Path) -> Document:
        resolved = path.resolve()
        if resolved not in self._documents:
            self._documents[resolved] = read_document(path, shown_path(path))
        return self._documents[resolved]


def _used_first(entries: Mapping[str, dict[str, Any]], instance: Instance) -> list[IncludePlace]:
    """Return the includes of a file; what is left out must not take names from what is used."""
    places = [IncludePlace(instance, ('include', name), entries[name]) for name in entries]
    return sorted(places, key=lambda place: place.is_left_out)


def _count_used(instance: Instance, section: str, limit: int) -> int:
    """Return how many entries a section has; those that are left out count up to a limit."""
    count = len(instance.data.get(section, ()))
    if count <= limit:
        return count
    return count - sum(path[0] == section for path in instance.left_out)


def _find_unset(part: Instance, environment: Collection[str]) -> Iterator[Diagnostic]:
    for name in part.data.get('environment', {}):
        if name not in environment:
            yield diagnostic_at(
                part.positions.key(('environment', name)),
                'ignored-environment',
                f"'{name}' is not set: only the environment of the file that is started counts",
                help="set it in that file, or for a process under 'env'",
            )


def _find_file(place: IncludePlace, chain: tuple[Related, ...]) -> Path | None:
    """Return the file that an include names; if there is none, say so and return `None`."""
    try:
        return locate_file(place.file, place.span)
    except PathError as error:
        if not place.may_be_absent:
            place.report('missing-include', str(error), chain, error.help)
    return None


def _settle(instance: Instance) -> None:
    """Let a file's defaults and profiles hold in this file alone."""
    push_defaults(instance)
    drop_unknown_profiles(instance)


def _with_chain(
    diagnostics: Collection[Diagnostic], chain: tuple[Related, ...]
) -> list[Diagnostic]:
    return [finding.with_related(chain) for finding in diagnostics]
