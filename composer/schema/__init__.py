"""The JSON Schema of the language, and where it is."""

from __future__ import annotations

from pathlib import Path

# `importlib.resources` takes a twentieth of a check's time to import.
_PACKAGE = Path(__file__).resolve().parent.parent
SCHEMA_NAME = 'composer.schema.json'


def schema_path() -> Path:
    """Return the path of the schema: beside the package in a checkout, inside it in a wheel."""
    packaged = _PACKAGE / 'schemas' / SCHEMA_NAME
    return packaged if packaged.exists() else packaged.parents[2] / 'schemas' / SCHEMA_NAME
