"""Which files a command line means: files, patterns, and folders with systems in them."""

from __future__ import annotations

import difflib
import glob
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import Diagnostic

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

_SUFFIXES = ('.yaml', '.yml')
_SCHEMA = 'composer.schema.json'
# Neither is read: the folders of tools begin with a dot, these are full of other people's files.
_FOREIGN_FOLDERS = frozenset({'node_modules', '__pycache__', 'site-packages'})
_LARGEST_LOOK = 1_000_000

# How alike two words are of which one has a letter more, less or changed.
_SLIP = 0.8

_TOP_KEY = re.compile(r'^(["\']?)([A-Za-z]\w*)\1\s*:(?=\s|$)', re.MULTILINE)
_FLOW_KEY = re.compile(r'[{,]\s*["\']?(version|nodes)["\']?\s*:')
_LIST = re.compile(r'\s*(#[^\n]*\n\s*)*(-\s|\[)')
_ENTITIES = re.compile(
    r'^\s+(publishers|subscriptions|timers|services|service_clients|actions|action_clients'
    r'|on_start|on_stop|on_parameters)\s*:',
    re.MULTILINE,
)


@dataclass(frozen=True, slots=True)
class Selection:
    """What is to be checked.

    Attributes:
        paths: Each once, in the order of the command line; `-` is standard input.
        findings: Patterns and folders in which there is nothing.
    """

    paths: tuple[Path, ...]
    findings: tuple[Diagnostic, ...]


def select_files(words: Sequence[str], *, skip_other_files: bool = False) -> Selection:
    """Return the files that the words of a command line mean.

    Files that are named, or matched by a pattern, are taken as they are. Of folders, searched
    all the way down, those `.yaml` and `.yml` files are taken that look like systems.

    Args:
        skip_other_files: Whether named files, too, are passed over if they do not look like systems.
    """
    paths: dict[str, Path] = {}
    findings = []
    for word in words:
        fault = None
        for path, is_named in _expand(word):
            if path is None:
                fault = _explain_nothing(word)
            elif not (is_named and skip_other_files) or looks_like_system(path):
                paths.setdefault(os.path.abspath(path) if word != '-' else '-', path)  # noqa: PTH100
        findings += [fault] if fault else []
    return Selection(tuple(paths.values()), tuple(findings))


def looks_like_system(path: Path) -> bool:
    """Return whether a file is meant for Composer, even if much is wrong with it.

    That is so if it names the schema of Composer, or has the keys `version` and `nodes` at its
    top, `nodes` not being a list; if one is missing or misspelt, publishers, timers and so on
    have to stand below. Files of docker compose, of GitHub and of ROS 2 parameters are no systems
    by that.
    """
    try:
        with path.open('rb') as file:
            text = file.read(_LARGEST_LOOK).decode('utf-8-sig', errors='replace')
    except OSError:
        return True  # a finding says why it cannot be read
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
    """Return a key, or else one that is a slip of the pen away from it."""
    if wanted in keys:
        return wanted
    near = difflib.get_close_matches(wanted, keys, n=1, cutoff=_SLIP)
    return near[0] if near else None


def _expand(word: str) -> Iterator[tuple[Path | None, bool]]:
    """Yield each file and whether it was named; a `None` if there is nothing."""
    if word == '-' or os.path.lexists(word) or (word and not glob.has_magic(word)):
        matches = [word]
    else:
        matches = sorted(glob.glob(word, recursive=True))  # noqa: PTH207 - pathlib's has no absolute ones
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


def _walk(folder: Path) -> Iterator[Path]:
    for at, folders, files in os.walk(folder):
        folders[:] = sorted(
            name for name in folders if not name.startswith('.') and name not in _FOREIGN_FOLDERS
        )
        paths = (Path(at, name) for name in sorted(files) if name.endswith(_SUFFIXES))
        # A pipe would be waited for.
        yield from (path for path in paths if not path.is_fifo())


def _explain_nothing(word: str) -> Diagnostic:
    if os.path.isdir(word):  # noqa: PTH112 - the word may be no path
        return Diagnostic(
            'nothing-to-check',
            'there is no system in this folder',
            word,
            help="a file in it is one if 'version:' and 'nodes:' stand at its top",
        )
    return Diagnostic('nothing-to-check', 'no file matches this pattern', word or "''")
