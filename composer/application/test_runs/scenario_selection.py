"""The scenario files and cases that a command line names."""

from __future__ import annotations

import glob
import os
from pathlib import Path
from typing import TYPE_CHECKING

from composer.application.file_selection import match_pattern, walk_yaml_files
from composer.application.test_runs.run_options import DEFAULT_PATTERN
from composer.errors import UsageError
from composer.records import record
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

SUFFIXES = ('.scenario.yaml', '.scenario.yml')
_SEPARATOR = '::'


@record
class SelectedFile:
    """A scenario file.

    Attributes:
        name: Its path, as the user wrote it.
        cases: The names of the cases that are meant; empty for all.
    """

    name: str
    cases: tuple[str, ...] = ()


def select_scenarios(words: Sequence[str]) -> list[SelectedFile]:
    """Return the scenario files that words stand for, each once.

    Args:
        words: Files, folders, patterns, and cases as `FILE::case`; none for `DEFAULT_PATTERN`.

    Raises:
        UsageError: A file or folder is not there.
    """
    found: dict[str, SelectedFile] = {}
    for word in words or [DEFAULT_PATTERN]:
        name, _, case = word.partition(_SEPARATOR)
        for path in _expand(name):
            before = found.get(str(path))
            is_whole = not case or (before is not None and not before.cases)
            cases = () if is_whole else (*(before.cases if before else ()), case)
            found[str(path)] = SelectedFile(str(path), tuple(dict.fromkeys(cases)))
    return list(found.values())


def check_case_names(file: SelectedFile, names: Sequence[str]) -> None:
    """Check that a file has the cases that are meant.

    Raises:
        UsageError: It lacks one.
    """
    for case in file.cases:
        if case not in names:
            message = f"{file.name} has no case '{case}'"
            raise UsageError(message, help=suggest(case, names, 'it has'))


def _expand(word: str) -> Iterator[Path]:
    path = Path(word)
    if os.path.isdir(path):
        yield from (each for each in walk_yaml_files(path) if is_scenario(each))
    elif os.path.exists(path):
        yield path
    elif glob.has_magic(word):
        yield from (Path(each) for each in match_pattern(word) if os.path.isfile(each))
    else:
        message = f"there is no file or folder '{word}'"
        raise UsageError(message, help=f'without one, {DEFAULT_PATTERN} is looked for')


def is_scenario(path: Path) -> bool:
    """Return whether a file has the name of a scenario file."""
    return path.name.endswith(SUFFIXES)
