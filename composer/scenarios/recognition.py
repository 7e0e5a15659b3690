"""Which files are scenario files: by their name, the schema that they name, or their keys."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from composer.input_limits import UnreadableFileError, read_file
from composer.schema import SCENARIO_SCHEMA_NAME

if TYPE_CHECKING:
    from pathlib import Path

SUFFIXES = ('.scenario.yaml', '.scenario.yml')
_MAX_BYTES_READ = 1_000_000
_NAMES_SCHEMA = re.compile(rf'^#.*\$schema=\S*{re.escape(SCENARIO_SCHEMA_NAME)}', re.MULTILINE)
_KEYS = tuple(re.compile(rf'^{key}\s*:(?=\s|$)', re.MULTILINE) for key in ('system', 'cases'))


def is_scenario_file(path: Path) -> bool:
    """Return whether a file is meant as a scenario file, even if it has errors."""
    if path.name.endswith(SUFFIXES):
        return True
    try:
        text = read_file(path)[:_MAX_BYTES_READ].decode('utf-8-sig', errors='replace')
    except UnreadableFileError:
        return False
    return bool(_NAMES_SCHEMA.search(text)) or all(key.search(text) for key in _KEYS)
