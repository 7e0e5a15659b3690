"""Generate `docs/reference.md` from the schema and `docs/rules.md` from the rules.

Run by `make docs`; a test checks that both files are current.
"""

from __future__ import annotations

import json
from pathlib import Path

from reference_page import reference_page
from rules_page import rules_page

from composer.schema import schema_path

FOLDER = Path(__file__).parent


def main() -> None:
    """Write both files."""
    for name, text in generate().items():
        (FOLDER / name).write_text(text, encoding='utf-8')


def generate() -> dict[str, str]:
    """Return the text of each generated file, by its name."""
    schema = json.loads(schema_path().read_text(encoding='utf-8'))
    return {
        'reference.md': '\n'.join(reference_page(schema)) + '\n',
        'rules.md': '\n'.join(rules_page()) + '\n',
    }


if __name__ == '__main__':
    main()
