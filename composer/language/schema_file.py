"""Where the schema of the language lies."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

SCHEMA_NAME = 'composer.schema.json'


def schema_path() -> Path:
    """Return where the schema lies: beside the package in a checkout, inside it in a wheel."""
    packaged = Path(str(resources.files('composer'))) / 'schemas' / SCHEMA_NAME
    return packaged if packaged.exists() else packaged.parents[2] / 'schemas' / SCHEMA_NAME
