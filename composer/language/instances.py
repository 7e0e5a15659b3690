"""A file read with values for its arguments: expressions evaluated, structure checked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.expressions.filling import FilledDocument
from composer.language.arguments import ArgumentSpec, find_argument_faults, read_arguments
from composer.language.paths import resolve_paths
from composer.schema.structure import check_structure, correct_outer_keys, is_sound

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from composer.diagnostics import Related, SourceFile, Span
    from composer.yaml_text.positions import Branch, DataPath, Key, SourceMap
    from composer.yaml_text.reader import Document

# The sections whose entries become part of a file that includes theirs.
PARTS = ('nodes', 'processes', 'qos', 'interfaces')


@dataclass(frozen=True, slots=True)
class ArgumentValues:
    """What the arguments of a file are.

    Attributes:
        samples: The names of those whose value only stands for others of its type.
        origins: Where they come from, in words; those that have their default are not in it.
    """

    values: Mapping[str, Any]
    samples: Collection[str] = ()
    origins: Mapping[str, str] = field(default_factory=dict)


@dataclass(slots=True)
class Instance:
    """What could be read of a file with certain arguments.

    Attributes:
        data: As the schema wants them, without what was wrong.
        dropped: The paths of the data that were left out for that.
        left_out: The paths of entries whose `when` does not hold, or that come with an include
            whose `when` does not; they are still in the data.
        arguments: What the file declares.
        values: What they are in this instance.
        sampled_spans: Where values stand that hang on samples of arguments.
        spans_left_out: As these, in what is left out.
        notes: Where the values that the expressions of a scalar use come from, by its path.
        included: The files that are part of it.
        chains: Where entries come from by includes, innermost first, by their paths.
        inner_names: The namespaces, as written, and simple names of nodes that are called by
            their full names only since another node has the simple one.
    """

    data: dict[str, Any]
    positions: SourceMap
    diagnostics: list[Diagnostic] = field(default_factory=list)
    dropped: set[DataPath] = field(default_factory=set)
    left_out: set[DataPath] = field(default_factory=set)
    arguments: Mapping[str, ArgumentSpec] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)
    sampled_spans: list[Span] = field(default_factory=list)
    spans_left_out: list[Span] = field(default_factory=list)
    notes: dict[DataPath, str] = field(default_factory=dict)
    included: dict[SourceFile, None] = field(default_factory=dict)
    chains: dict[DataPath, tuple[Related, ...]] = field(default_factory=dict)
    inner_names: dict[str, tuple[str, str]] = field(default_factory=dict)
    _branches: dict[str, dict[Key, Branch]] = field(default_factory=dict)
    _notes: dict[DataPath, list[tuple[DataPath, str]]] | None = None

    def notes_by_entry(self) -> dict[DataPath, list[tuple[DataPath, str]]]:
        """Return the notes of each entry of a section, by their paths from there."""
        if self._notes is None:
            self._notes = {}
            for path, note in self.notes.items():
                self._notes.setdefault(path[:2], []).append((path[2:], note))
        return self._notes

    def leave_out_all(self) -> None:
        """Leave out all that the file declares."""
        self.left_out = {
            (section, name) for section in PARTS for name in self.data.get(section, ())
        }
        self.spans_left_out += self.sampled_spans
        self.sampled_spans = []

    def branches(self, section: str) -> dict[Key, Branch]:
        """Return the positions of the entries of a section; call it when they are settled."""
        if section not in self._branches:
            self._branches[section] = self.positions.branches((section,))
        return self._branches[section]


def read_instance(
    document: Document,
    give_values: Callable[[Mapping[str, ArgumentSpec]], ArgumentValues],
) -> Instance | None:
    """Return a document with values for its arguments; `None` if it could not be read at all.

    Args:
        give_values: Returns the value of each argument, and the names of those whose value is
            only a sample. Where the declarations are wrong it is not asked: samples are taken.
    """
    if document.data is None:
        return None
    positions = document.positions.copy()
    written, misspelt = correct_outer_keys(document.data, positions)
    declared = read_arguments(written)
    faults = list(_check_arguments(declared, positions))
    sound = not faults and is_sound({'args': document.data.get('args', {})})
    # Values are not held against declarations that are wrong: those have to be mended first.
    given = give_values(declared) if sound else sample_values(declared)
    filled = _fill(written, given, positions)
    data, dropped, structure_faults = check_structure(
        filled.data, positions, filled.failed, filled.sampled
    )
    # Of arguments that are no mapping nothing is known, not even their names.
    is_known = isinstance(written.get('args', {}), dict)
    unfilled = [each for each in filled.faults if is_known or each.rule != 'undefined-name']
    return Instance(
        resolve_paths(data, positions),
        positions,
        [*document.diagnostics, *misspelt, *faults, *unfilled, *structure_faults],
        set(dropped),
        filled.left_out,
        declared,
        given.values,
        filled.sampled_spans,
        notes=filled.notes,
    )


def sample_values(declared: Mapping[str, ArgumentSpec]) -> ArgumentValues:
    """Return values to check a file with: defaults, and samples where none is known."""
    return ArgumentValues(
        {name: argument.sample for name, argument in declared.items()},
        {name for name, argument in declared.items() if _is_unknown(argument)},
    )


def _is_unknown(argument: ArgumentSpec) -> bool:
    """Return whether the declaration says no value, or none that can be meant."""
    is_wrong = isinstance(argument.default, list | dict) or any(find_argument_faults(argument))
    return argument.is_open or is_wrong


def _fill(data: dict[str, Any], given: ArgumentValues, positions: SourceMap) -> FilledDocument:
    if not (_has_expressions(positions) or _has_conditions(data)):
        return FilledDocument(data)
    # jinja2 takes a tenth of a check's time to import, and most files have no templates.
    from composer.expressions.foreach import expand_document

    declarations = {key: data[key] for key in ('args',) if key in data}
    system = {key: value for key, value in data.items() if key not in declarations}
    origins = {name: _origin(name, given, positions) for name in given.values}
    filled = expand_document(system, given.values, positions, given.samples, origins)
    filled.data |= declarations
    return filled


def _origin(name: str, given: ArgumentValues, positions: SourceMap) -> str:
    place = positions.value(('args', name, 'default'))
    return given.origins.get(name) or f'default, {place.place}'


def _has_expressions(positions: SourceMap) -> bool:
    return any('{{' in line for source in positions.sources() for line in source.lines)


def _has_conditions(data: Mapping[str, Any]) -> bool:
    sections = (data.get(section) for section in ('nodes', 'include', 'processes'))
    return any(
        isinstance(entry, dict) and ('foreach' in entry or 'when' in entry)
        for section in sections
        if isinstance(section, dict)
        for entry in section.values()
    )


def _check_arguments(
    declared: Mapping[str, ArgumentSpec], positions: SourceMap
) -> Iterable[Diagnostic]:
    for name, argument in declared.items():
        for key, fault in find_argument_faults(argument):
            path = ('args', name, *key)
            span = positions.value(path) if key else positions.key(path)
            yield diagnostic_at(span, 'bad-argument-declaration', fault)
