"""YAML text → `SystemSpec`: read → arguments → templates → schema → specs.

Each step is one module; findings are collected on the way. Only the words of the command line
raise, since what is wrong with them is not in the file.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.language.arguments import (
    ArgumentSpec,
    find_argument_faults,
    parse_arguments,
    read_arguments,
)
from composer.language.filling import FilledDocument
from composer.language.parser import parse_system
from composer.language.schema import check_structure, is_sound
from composer.language.source import Document, parse_document, read_document

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from composer.diagnostics import Span
    from composer.language.positions import DataPath, SourceMap
    from composer.language.specs import SystemSpec


@dataclass(frozen=True, slots=True)
class LoadedSystem:
    """What could be read of a file, and what was wrong with the rest.

    Attributes:
        path: The file; relative module paths and the like are sought from its folder.
        spec: The system without the parts that were wrong; `None` if nothing could be read.
        dropped: The paths of the data that were left out of `spec` for that.
        arguments: What the file takes from the command line.
        sampled: Where values stand that hang on samples of arguments: what is said of these
            need not hold for the real ones.
    """

    path: Path
    spec: SystemSpec | None
    positions: SourceMap
    dropped: frozenset[DataPath]
    diagnostics: tuple[Diagnostic, ...]
    arguments: Mapping[str, ArgumentSpec] = field(default_factory=dict)
    sampled: tuple[Span, ...] = ()


def load_system(path: Path, words: Sequence[str] | None = None) -> LoadedSystem:
    """Read a file as far as it can be read.

    Args:
        words: The arguments of the command line; `None` to read the file with its defaults, and
            with samples where there are none.

    Raises:
        UsageError: The words do not fit the arguments that the file declares.
    """
    return _load(read_document(path), path, words)


def load_system_text(
    text: str, path: Path = Path('<text>'), words: Sequence[str] | None = None
) -> LoadedSystem:
    """Read the text of a file that would stand at `path`."""
    return load_system_content(text.encode(), path, words)


def load_system_content(
    content: bytes, path: Path, words: Sequence[str] | None = None
) -> LoadedSystem:
    """Read the bytes of a file that would stand at `path`."""
    return _load(parse_document(content, str(path)), path, words)


def _load(document: Document, path: Path, words: Sequence[str] | None) -> LoadedSystem:
    positions = document.positions
    if document.data is None:
        return LoadedSystem(path, None, positions, frozenset(), document.diagnostics)
    declared = read_arguments(document.data)
    faults = _check_arguments(declared, positions)
    sound = not faults and is_sound({'args': document.data.get('args', {})})
    # Words are not held against declarations that are wrong: those have to be mended first.
    values, samples = _give_values(declared, words if sound else None)
    filled = _fill(document.data, values, positions, samples if sound else values)
    data, dropped, structure_faults = check_structure(
        filled.data, positions, filled.failed, filled.sampled
    )
    return LoadedSystem(
        path,
        parse_system(data, path.stem),
        positions,
        dropped,
        (*document.diagnostics, *faults, *filled.faults, *structure_faults),
        declared,
        tuple(filled.sampled_spans),
    )


def _give_values(
    declared: Mapping[str, ArgumentSpec], words: Sequence[str] | None
) -> tuple[dict[str, Any], Collection[str]]:
    """Return the value of each argument, and the names of those whose value is a sample."""
    if words is not None:
        return parse_arguments(declared, words), ()
    values = {name: argument.sample for name, argument in declared.items()}
    return values, [name for name, argument in declared.items() if argument.is_open]


def _fill(
    data: dict[str, Any],
    values: Mapping[str, Any],
    positions: SourceMap,
    samples: Collection[str],
) -> FilledDocument:
    if not any('{{' in line for line in positions.source.lines):
        return FilledDocument(data)
    # jinja2 takes a tenth of a check's time to import, and most files have no templates.
    from composer.language.templates import fill_templates

    declarations = {key: data[key] for key in ('args',) if key in data}
    system = {key: value for key, value in data.items() if key not in declarations}
    filled = fill_templates(system, values, positions, samples)
    filled.data |= declarations
    return filled


def _check_arguments(
    declared: Mapping[str, ArgumentSpec], positions: SourceMap
) -> list[Diagnostic]:
    found = []
    for name, argument in declared.items():
        for key, fault in find_argument_faults(argument):
            path = ('args', name, *key)
            span = positions.value(path) if key else positions.key(path)
            found.append(diagnostic_at(span, 'bad-argument-declaration', fault))
    return found
