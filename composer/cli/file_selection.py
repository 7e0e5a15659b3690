"""Find the files to check: those named on the command line, by a pattern, or in a folder."""

from __future__ import annotations

import difflib
import glob
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import Diagnostic
from composer.entity_kinds import WORK_KEYS
from composer.input_limits import UnreadableFileError, read_file

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

_SUFFIXES = ('.yaml', '.yml')
_SCHEMA = 'composer.schema.json'
# Not searched: these hold other people's files. Hidden folders belong to tools.
_SKIPPED_FOLDERS = frozenset({'node_modules', '__pycache__', 'site-packages'})
_MAX_BYTES_READ = 1_000_000

# The similarity of two words that differ by one letter.
_SIMILAR = 0.8

_TOP_KEY = re.compile(r'^(["\']?)([A-Za-z]\w*)\1\s*:(?=\s|$)', re.MULTILINE)
_FLOW_KEY = re.compile(r'[{,]\s*["\']?(version|nodes)["\']?\s*:')
_LIST = re.compile(r'\s*(#[^\n]*\n\s*)*(-\s|\[)')
# Other keys, such as `parameters`, stand in other people's files, too.
_ENTITIES = re.compile(rf'^\s+({"|".join(sorted(WORK_KEYS))})\s*:', re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Selection:
    """The files to check.

    Attributes:
        paths: Each once, in the order of the command line; `-` is standard input.
        findings: An error for each pattern or folder without a file to check.
    """

    paths: tuple[Path, ...]
    findings: tuple[Diagnostic, ...]


def select_files(words: Sequence[str], *, skip_other_files: bool = False) -> Selection:
    """Return the files that the words of a command line stand for.

    Files that are named, or matched by a pattern, are always selected. Folders are searched
    recursively for `.yaml` and `.yml` files that look like systems.

    Args:
        words: Files, folders, patterns, and `-` for standard input.
        skip_other_files: Also skip named files that do not look like systems.
    """
    paths: dict[str, Path] = {}
    findings = []
    for word in words:
        nothing = None
        for path, is_named in _expand(word):
            if path is None:
                nothing = _explain_nothing(word)
            elif not (is_named and skip_other_files) or looks_like_system(path):
                paths.setdefault(os.path.abspath(path) if word != '-' else '-', path)  # noqa: PTH100
        findings += [nothing] if nothing else []
    return Selection(tuple(paths.values()), tuple(findings))


def looks_like_system(path: Path) -> bool:
    """Return whether a file is meant for Composer, even if it has errors.

    A file is if it names the schema of Composer, or has the top-level keys `version` and `nodes`
    (`nodes` not being a list). If one of the two is missing or misspelt, publishers, timers and so
    on must be below `nodes`. This excludes Docker Compose files, GitHub workflows and ROS 2
    parameter files.
    """
    try:
        text = read_file(path)[:_MAX_BYTES_READ].decode('utf-8-sig', errors='replace')
    except UnreadableFileError:
        return True  # reading it for the check will report the error
    if re.search(rf'^#.*\$schema=\S*{re.escape(_SCHEMA)}', text, re.MULTILINE):
        return True
    if text.lstrip().startswith('{'):
        return {match[1] for match in _FLOW_KEY.finditer(text)} == {'version', 'nodes'}
    keys = {match[2]: match.end() for match in _TOP_KEY.finditer(text)}
    nodes = _find_near('nodes', keys)
    if nodes is None or _LIST.match(text, keys[nodes]):
        return False
    if nodes == 'nodes' and _find_near('version', keys):
        return True
    return bool(_ENTITIES.search(text, keys[nodes]))


def _find_near(wanted: str, keys: Mapping[str, int]) -> str | None:
    """Return the wanted key, or one that differs by about one letter."""
    if wanted in keys:
        return wanted
    near = difflib.get_close_matches(wanted, keys, n=1, cutoff=_SIMILAR)
    return near[0] if near else None


def _expand(word: str) -> Iterator[tuple[Path | None, bool]]:
    """Yield each file and whether it was named; `None` instead of a file if nothing was found."""
    if word == '-' or os.path.lexists(word) or (word and not glob.has_magic(word)):
        matches = [word]
    else:
        matches = _match(word)
        if not matches:
            yield None, False
    for match in matches:
        path = Path(match)
        if word == '-' or not os.path.isdir(path):  # noqa: PTH112 - pathlib's raises
            yield path, word != '-'
            continue
        found = [inside for inside in _walk(path) if looks_like_system(inside)]
        yield from ((inside, False) for inside in found)
        if not found:
            yield None, False


def _match(pattern: str) -> list[str]:
    """Return what a pattern matches, without what is hidden."""
    path = Path(pattern)
    parts = set(path.parts)
    try:
        # In contrast to `glob`, links to folders are not followed: two that lead back have no end.
        found = Path(path.anchor).glob(str(path.relative_to(path.anchor)))
        shown = [each for each in found if not any(map(_is_hidden, {*each.parts} - parts))]
    except (ValueError, IndexError, NotImplementedError):
        # Two stars within a name count as one, and an empty pattern matches nothing.
        return sorted(glob.glob(pattern))  # noqa: PTH207 - pathlib's refuses it
    return sorted(map(str, shown))


def _is_hidden(part: str) -> bool:
    return part.startswith('.') and part not in ('.', '..')


def _walk(folder: Path) -> Iterator[Path]:
    for at, folders, files in os.walk(folder):
        folders[:] = sorted(
            name for name in folders if not name.startswith('.') and name not in _SKIPPED_FOLDERS
        )
        paths = (Path(at, name) for name in sorted(files) if name.endswith(_SUFFIXES))
        # A pipe or a device is nobody's system.
        yield from (path for path in paths if path.is_file() or not path.exists())


def _explain_nothing(word: str) -> Diagnostic:
    if os.path.isdir(word):  # noqa: PTH112 - the word may not be a path
        return Diagnostic(
            'nothing-to-check',
            'no system in this folder',
            word,
            help="a system is a .yaml file with 'version:' and 'nodes:' at its top level",
        )
    return Diagnostic('nothing-to-check', 'no file matches this pattern', word or "''")
