"""What findings do not show: values that are read at the start, and lines of files of others.

In CI, who changes a file sees what a check of it reports, and should not see the variables and
files of the machine with it. What this promises, and what not, is in `docs/checking.md`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.ament import ament_prefixes

if TYPE_CHECKING:
    from collections.abc import Iterable

PROJECT_MARKS = ('pyproject.toml', '.git')
# Of a ROS package that is in no project.
_PACKAGE_MARKS = ('package.xml',)
_WORD = re.compile(r'\w+')
# What stands in quotes, with what is left out of it where it is long; or a word.
_QUOTED_OR_WORD = re.compile(r"'([^']*)'|\w+")
# Of a longer text, as a description of a robot, no words are hidden but those of variables.
_LONGEST_OF_WORDS = 1000
# They tell no more than a comparison does.
_COMMON = frozenset(('true', 'false', 'null', 'none', ''))

# The words of hidden values, in lower case, and these values: each with where it is from.
_origins: dict[str, str] = {}
_roots: set[Path] = set()


def begin(files: Iterable[Path]) -> None:
    """Forget all values, and take the projects of these files, and that of this folder, as own."""
    _origins.clear()
    _roots.clear()
    may_show_lines.cache_clear()
    for path in (Path('file'), *files):
        # A name may be no path at all, or the working folder may be gone.
        with suppress(OSError, ValueError):
            # As written: a link in the project may lead anywhere.
            root = list_lineage(Path(os.path.abspath(path)).parent)[-1]  # noqa: PTH100
            _roots.add(Path(os.path.realpath(root)))


def list_lineage(folder: Path) -> list[Path]:
    """Return a folder and its parents up to the root of its project.

    That is the nearest one with a `pyproject.toml` or `.git`; if there is none, the nearest one
    with a `package.xml`; else the folder itself.
    """
    lineage = [folder, *folder.parents]
    for marks in (PROJECT_MARKS, _PACKAGE_MARKS):
        for count, at in enumerate(lineage, 1):
            if any((at / mark).exists() for mark in marks):
                return lineage[:count]
    return [folder]


@cache
def may_show_lines(name: str) -> bool:
    """Return whether lines of a file may be shown: it is in the project, or in a ROS package."""
    if not _roots or not os.path.lexists(name):
        return True  # such as standard input
    path = Path(os.path.realpath(name))
    return any(path.is_relative_to(folder) for folder in (*_roots, *ament_prefixes()))


def hide(value: Any, origin: str, written: str = '') -> None:
    """Hide a value in all findings to come, and all that is in it.

    Args:
        origin: What is shown instead, as in `env("HOME")`.
        written: A text whose words stand in the value anyway.
    """
    if isinstance(value, dict):
        hide([*value, *value.values()], origin, written)
    elif isinstance(value, list | tuple):
        for each in value:
            hide(each, origin, written)
    elif value is not None and not isinstance(value, bool):
        text = str(value).lower()
        has_words = len(text) <= _LONGEST_OF_WORDS or origin.startswith('env(')
        words = {text, *_WORD.findall(text if has_words else '')}
        words -= {*_WORD.findall(written.lower())} | _COMMON
        _origins.update((word, origin) for word in words if word not in _origins)


def hidden_values() -> dict[str, str]:
    """Return what is hidden, with its origins, to be hidden again after other files are read."""
    return dict(_origins)


def hide_again(values: Mapping[str, str]) -> None:
    """Hide values beside those that are hidden now."""
    _origins.update(values)


def origin_of(value: Any) -> str | None:
    """Return where a hidden value is from; `None` for any other value."""
    if isinstance(value, list | tuple | dict):
        items = [*value, *value.values()] if isinstance(value, dict) else value
        return next(filter(None, map(origin_of, items)), None)
    return None if isinstance(value, bool) else _origins.get(str(value).lower())


def conceal(text: str) -> str:
    """Return a text with the origins of hidden values in their place."""
    return _QUOTED_OR_WORD.sub(_concealed, text) if _origins else text


def conceal_data(value: Any) -> Any:
    """Return data with the origins of hidden values in their place, also inside of it."""
    if isinstance(value, str):
        return conceal(value)
    if isinstance(value, Mapping):
        return {conceal_data(key): conceal_data(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [conceal_data(each) for each in value]
    return f'<from {origin}>' if (origin := origin_of(value)) else value


def _concealed(found: re.Match[str]) -> str:
    words = [found[0]] if found[1] is None else [found[1], *_WORD.findall(found[1])]
    if words == ['a']:
        return 'a'  # as in 'a node'
    for word in words:
        if (origin := _origins.get(word.lower())) is not None:
            return f'<from {origin}>'
    # Long values are shown in part.
    if found[1] is not None and '…' in found[1]:
        beginning = found[1].partition('…')[0].lower()
        for value, origin in _origins.items():
            if beginning and value.startswith(beginning):
                return f'<from {origin}>'
    return found[0]
