"""The examples of rules: a file that breaks the rule, and one that does not."""

from __future__ import annotations

from composer.records import record
from typing import TYPE_CHECKING

from composer.rules import RULES_FOLDER

if TYPE_CHECKING:
    from pathlib import Path

_OWN = ('rule.yaml', 'bad.yaml', 'bad.txt', 'good.yaml')


@record
class Example:
    """An example of a rule.

    Attributes:
        bad: The text of a file that breaks the rule.
        report: What Composer reports of it.
        good: The text of a file that does not.
        others: The texts of the files that these need, by their path in the folder.
    """

    bad: str
    report: str
    good: str
    others: dict[str, str]


def load_example(rule: str) -> Example | None:
    """Return the example of a rule, or `None` if it has none."""
    folder = RULES_FOLDER / rule
    if not (folder / 'bad.yaml').is_file():
        return None
    others = {
        path.relative_to(folder).as_posix(): _read(path)
        for path in sorted(folder.rglob('*'))
        if path.is_file() and path.name not in _OWN and path.suffix != '.pyc'
    }
    bad, report, good = (_read(folder / name) for name in _OWN[1:])
    return Example(bad, report, good, others)


def _read(path: Path) -> str:
    """Return the text of a file; what is not UTF-8, as some examples are, as escapes."""
    return path.read_bytes().decode(errors='backslashreplace')
