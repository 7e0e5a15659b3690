"""Generate the reference pages from the schemas, and `docs/rules.md` from the rules.

Run by `make docs`; a test checks that the files are current.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from reference_page import reference_page, scenario_reference_page
from rules_page import rules_page

from composer.schema import SCENARIO_SCHEMA_NAME, SCHEMA_NAME, schema_path

FOLDER = Path(__file__).parent


def main() -> None:
    """Write the files."""
    for name, text in generate().items():
        (FOLDER / name).write_text(text, encoding='utf-8')


def generate() -> dict[str, str]:
    """Return the text of each generated file, by its name."""
    return {
        'reference.md': '\n'.join(reference_page(_read(SCHEMA_NAME))) + '\n',
        'testing_reference.md': '\n'.join(scenario_reference_page(_read(SCENARIO_SCHEMA_NAME)))
        + '\n',
        'rules.md': '\n'.join(rules_page()) + '\n',
    }


def _read(name: str) -> Any:
    return json.loads(schema_path(name).read_text(encoding='utf-8'))


if __name__ == '__main__':
    main()
