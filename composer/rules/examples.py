"""The examples of rules, files of the package: one that fires the rule, and one that does not."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

_OWN = ('bad.yaml', 'bad.txt', 'good.yaml')


@dataclass(frozen=True, slots=True)
class Example:
    """What shows a rule.

    Attributes:
        folder: Where its files lie.
        bad: The text of a file with the fault.
        said: What Composer says of it.
        good: The text of a file without it.
        others: The texts of the files that these need, by their path in the folder.
    """

    folder: Path
    bad: str
    said: str
    good: str
    others: dict[str, str]


def examples_folder() -> Path:
    """Return the folder that holds a folder for each rule with an example."""
    return Path(str(resources.files('composer'))) / 'examples'


def read_example(rule: str) -> Example | None:
    """Return the example of a rule, if it has one."""
    folder = examples_folder() / rule
    if not folder.is_dir():
        return None
    others = {
        path.relative_to(folder).as_posix(): _read(path)
        for path in sorted(folder.rglob('*'))
        if path.is_file() and path.name not in _OWN and path.suffix != '.pyc'
    }
    bad, said, good = (_read(folder / name) for name in _OWN)
    return Example(folder, bad, said, good, others)


def _read(path: Path) -> str:
    """Return the text of a file; what is not UTF-8, as some examples are, as escapes."""
    return path.read_bytes().decode(errors='backslashreplace')
