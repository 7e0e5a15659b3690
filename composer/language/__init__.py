"""YAML text → `SystemSpec`: read → schema → specs.

Each step is one module; findings are collected on the way and nothing is raised for input.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from composer.language.parser import parse_system
from composer.language.schema import check_structure
from composer.language.source import Document, parse_document, read_document

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic
    from composer.language.positions import DataPath, SourceMap
    from composer.language.specs import SystemSpec


@dataclass(frozen=True, slots=True)
class LoadedSystem:
    """What could be read of a file, and what was wrong with the rest.

    Attributes:
        path: The file; relative module paths and the like are sought from its folder.
        spec: The system without the parts that were wrong; `None` if nothing could be read.
        dropped: The paths of the data that were left out of `spec` for that.
    """

    path: Path
    spec: SystemSpec | None
    positions: SourceMap
    dropped: frozenset[DataPath]
    diagnostics: tuple[Diagnostic, ...]


def load_system(path: Path) -> LoadedSystem:
    """Read a file as far as it can be read."""
    return _load(read_document(path), path)


def load_system_text(text: str, path: Path = Path('<text>')) -> LoadedSystem:
    """Read the text of a file that would stand at `path`."""
    return _load(parse_document(text.encode(), str(path)), path)


def _load(document: Document, path: Path) -> LoadedSystem:
    positions = document.positions
    if document.data is None:
        return LoadedSystem(path, None, positions, frozenset(), document.diagnostics)
    data, dropped, findings = check_structure(document.data, positions)
    spec = parse_system(data, path.stem)
    return LoadedSystem(path, spec, positions, dropped, (*document.diagnostics, *findings))
