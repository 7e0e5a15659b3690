"""A scenario file → its cases, and the system that they test."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import diagnostic_at
from composer.errors import UsageError
from composer.language.paths import PathError, explain_absent, resolve_path
from composer.language.pipeline import load_system
from composer.scenarios.parsing.file_parser import parse_reference, parse_scenarios
from composer.schema import SCENARIO_SCHEMA_NAME
from composer.schema.structure import check_keys_and_values
from composer.yaml_text.reader import parse_document, read_document

if TYPE_CHECKING:
    from composer.language.loaded_system import LoadedSystem
    from composer.scenarios.specs import ScenarioSpec, SystemReferenceSpec
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath, SourceMap


@dataclass(slots=True)
class LoadedScenarios:
    """A scenario file, as far as it could be read.

    Attributes:
        document: Its data, positions and the findings in its structure; those of the system, and
            what only a comparison with the system tells, are not in it: see
            `composer.scenarios.checks`.
        invalid: The paths of what was left out because of a finding.
        system: The system as the file gives it; `None` if it could not be read.
        spec: The cases without the parts that were wrong; `None` if nothing could be read.
    """

    path: Path
    document: Document
    invalid: set[DataPath]
    system: LoadedSystem | None = None
    spec: ScenarioSpec | None = None

    @property
    def positions(self) -> SourceMap:
        """Where all of it is written."""
        return self.document.positions


def load_scenarios(path: Path, *, text: bytes | None = None) -> LoadedScenarios:
    """Read a scenario file and its system.

    Args:
        text: The text of the file, if it is not to be read.
    """
    document = read_document(path) if text is None else parse_document(text, str(path))
    invalid = check_keys_and_values(document, SCENARIO_SCHEMA_NAME)
    loaded = LoadedScenarios(path, document, invalid)
    data = document.data
    if data is None or not isinstance(data.get('system'), dict) or _is_system_wrong(invalid):
        return loaded
    reference = _read_reference(loaded)
    if reference is None:
        return loaded
    loaded.system = _load_system(loaded, reference)
    nodes = loaded.system.spec.nodes if loaded.system and loaded.system.spec else {}
    loaded.spec = parse_scenarios(document, reference, nodes, invalid)
    return loaded


def _is_system_wrong(invalid: set[DataPath]) -> bool:
    return any(path[:1] == ('system',) for path in invalid)


def _read_reference(loaded: LoadedScenarios) -> SystemReferenceSpec | None:
    """Return what the file says of its system; `None` if a file of it is missing."""
    data = loaded.document.data or {}
    paths: dict[DataPath, Path] = {}
    named: list[tuple[DataPath, str]] = [(('system', 'file'), data['system']['file'])]
    layers = data['system'].get('layers', ())
    named += [(('system', 'layers', index), layer) for index, layer in enumerate(layers)]
    for at, text in named:
        path = find_file(loaded.document, at, text)
        if path is None:
            return None
        paths[at] = path
    return parse_reference(data['system'], paths)


def find_file(document: Document, at: DataPath, text: str) -> Path | None:
    """Return the path of a file that a scenario file names; report it if there is none."""
    span = document.positions.value(at)
    try:
        path = Path(os.path.normpath(resolve_path(text, document.positions.source.folder)))
    except PathError as error:
        found = diagnostic_at(span, 'uninstalled-package', str(error), help=error.help)
        document.diagnostics.append(found)
        return None
    if os.path.isfile(path):
        return path
    help_text = explain_absent(path, span)
    message = f"there is no file '{path}'"
    document.diagnostics.append(diagnostic_at(span, 'unreadable-file', message, help=help_text))
    return None


def _load_system(loaded: LoadedScenarios, reference: SystemReferenceSpec) -> LoadedSystem | None:
    try:
        return load_system(
            reference.file,
            reference.words,
            layers=reference.layers,
            set_values=reference.set_values,
        )
    except UsageError as error:
        key = 'set' if str(error).startswith('--set ') else 'args'
        span = loaded.positions.key(('system', key))
        message = str(error).removeprefix('--set ')
        help_text = error.help and ' '.join(error.help.split())
        loaded.document.diagnostics.append(
            diagnostic_at(span, 'bad-system-argument', message, help=help_text)
        )
        return None
