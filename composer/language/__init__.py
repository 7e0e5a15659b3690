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
from composer.language.parser import parse_system
from composer.language.schema import check_structure
from composer.language.source import Document, parse_document, read_document

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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
    """

    path: Path
    spec: SystemSpec | None
    positions: SourceMap
    dropped: frozenset[DataPath]
    diagnostics: tuple[Diagnostic, ...]
    arguments: Mapping[str, ArgumentSpec] = field(default_factory=dict)


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
    return _load(parse_document(text.encode(), str(path)), path, words)


def _load(document: Document, path: Path, words: Sequence[str] | None) -> LoadedSystem:
    positions = document.positions
    if document.data is None:
        return LoadedSystem(path, None, positions, frozenset(), document.diagnostics)
    declared = read_arguments(document.data)
    findings = [*document.diagnostics, *_check_arguments(declared, positions)]
    if words is None:
        values = {name: argument.sample for name, argument in declared.items()}
    else:
        values = parse_arguments(declared, words)
    data, failed = _fill(document.data, values, positions, findings)
    data, dropped, faults = check_structure(data, positions, failed)
    spec = parse_system(data, path.stem)
    return LoadedSystem(path, spec, positions, dropped, (*findings, *faults), declared)


def _fill(
    data: dict[str, Any],
    values: Mapping[str, Any],
    positions: SourceMap,
    findings: list[Diagnostic],
) -> tuple[dict[str, Any], Sequence[DataPath]]:
    if not any('{{' in line for line in positions.source.lines):
        return data, ()
    # jinja2 takes a tenth of a check's time to import, and most files have no templates.
    from composer.language.templates import fill_templates

    filled, faults, failed = fill_templates(data, values, positions)
    findings += faults
    return filled, failed


def _check_arguments(
    declared: Mapping[str, ArgumentSpec], positions: SourceMap
) -> list[Diagnostic]:
    return [
        diagnostic_at(positions.value(('args', name)), 'bad-argument-declaration', fault)
        for name, argument in declared.items()
        for fault in find_argument_faults(argument)
    ]
