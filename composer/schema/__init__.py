"""The JSON Schemas of the files that Composer reads, and where they are."""

from __future__ import annotations

from pathlib import Path

# `importlib.resources` takes a twentieth of a check's time to import.
_PACKAGE = Path(__file__).resolve().parent.parent
SCHEMA_NAME = 'composer.schema.json'
SCENARIO_SCHEMA_NAME = 'scenario.schema.json'


def schema_path(name: str = SCHEMA_NAME) -> Path:
    """Return the path of a schema: beside the package in a checkout, inside it in a wheel."""
    packaged = _PACKAGE / 'schemas' / name
    return packaged if packaged.exists() else packaged.parents[2] / 'schemas' / name
