"""Find the files to check: those named on the command line, by a pattern, or in a folder."""

from __future__ import annotations

import glob
import os
import re
import sys
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from composer.application.launch_file import LAUNCH_SUFFIXES, is_launch_file, load_launch_file
from composer.diagnostics import Diagnostic, has_errors
from composer.entity_kinds import WORK_KEYS
from composer.errors import UsageError
from composer.input_limits import MAX_FILE_BYTES, UnreadableFileError, read_file
from composer.language.pipeline import load_system
from composer.records import record
from composer.scenarios.recognition import is_scenario_file
from composer.schema.structure import known_keys
from composer.terminal import escape
from composer.yaml_text.reader import read_document

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from composer.language.loaded_system import LoadedSystem
    from composer.language.values.start_reader import StartValueReader

_STANDARD_INPUT = '-'
SUFFIXES = ('.yaml', '.yml')
_SCHEMA = 'composer.schema.json'
# Not searched: these hold other people's files. Hidden folders belong to tools.
_SKIPPED_FOLDERS = frozenset({'node_modules', '__pycache__', 'site-packages'})
# Of a workspace, colcon's folders build, install and log have this file.
_SKIPPED_BY_COLCON = 'COLCON_IGNORE'
_MAX_BYTES_READ = 1_000_000
# Of the systems in a folder, the first are listed.
_MOST_LISTED = 20

# The similarity of two words that differ by one letter.
_SIMILAR = 0.8

_TOP_KEY = re.compile(r'^(["\']?)([A-Za-z]\w*)\1\s*:(?=\s|$)', re.MULTILINE)
_FLOW_KEY = re.compile(r'[{,]\s*["\']?(version|nodes|processes|containers|include)["\']?\s*:')
_VERSION_1 = re.compile(r'^[{\s]*["\']?version["\']?\s*:\s*1\s*($|[#,}])', re.MULTILINE)
_VERSION = re.compile(r'^["\']?version["\']?\s*:|^\s*\{', re.MULTILINE)
_LIST = re.compile(r'\s*(#[^\n]*\n\s*)*(-\s|\[)')
# Other keys, such as `parameters`, stand in other people's files, too.
_WITHOUT_NODES = ('processes', 'containers', 'include')
_ENTITIES = re.compile(rf'^\s+({"|".join(sorted(WORK_KEYS))})\s*:', re.MULTILINE)


@record
class SelectedSystem:
    """A system to check, as `composer up` would be given it.

    Attributes:
        path: Its file; `-` is standard input.
        layers: Files that change it, each over those before it.
        arguments: Values of its arguments, as on the command line.
    """

    path: Path
    layers: tuple[Path, ...] = ()
    arguments: tuple[str, ...] = ()


@record
class Selection:
    """The systems to check.

    Attributes:
        systems: Each once, in the order of the command line.
        scenarios: The scenario files, each once.
        findings: An error for each pattern or folder without a file to check.
    """

    systems: tuple[SelectedSystem, ...]
    findings: tuple[Diagnostic, ...] = ()
    scenarios: tuple[Path, ...] = ()


def select_files(words: Sequence[str], *, skip_other_files: bool = False) -> Selection:
    """Return the systems that the words of a command line stand for.

    Files that are named, or matched by a pattern, are always selected. A file that is named after
    another one, and has keys of a system but no `version`, is a layer of it. Folders are searched
    recursively for `.yaml` and `.yml` files that look like systems.

    Args:
        words: Files, folders, patterns, and `-` for standard input.
        skip_other_files: Also skip named files that do not look like systems. No file is a layer:
            a tool that names all files of a project says nothing by their order.
    """
    systems: list[SelectedSystem] = []
    scenarios: dict[str, Path] = {}
    findings = []
    may_have_layer = False
    for word in words:
        if may_have_layer and not skip_other_files and _is_layer(word):
            systems[-1] = replace(systems[-1], layers=(*systems[-1].layers, Path(word)))
            continue
        nothing = None
        for path, is_named in _expand(word):
            if path is None:
                nothing = _explain_nothing(word)
            elif is_scenario_file(path):
                scenarios.setdefault(_identity(path), path)
            elif not (is_named and skip_other_files) or looks_like_system(path):
                systems.append(SelectedSystem(path))
        findings += [nothing] if nothing else []
        may_have_layer = bool(systems) and str(systems[-1].path) == str(Path(word))
    once: dict[tuple[str, ...], SelectedSystem] = {}
    for system in systems:
        once.setdefault(tuple(map(_identity, (system.path, *system.layers))), system)
    return Selection(tuple(once.values()), tuple(findings), tuple(scenarios.values()))


def select_systems(
    words: Sequence[str], *, is_one: bool, skip_other_files: bool = False
) -> Selection:
    """Return the systems that a command line gives: one, as to `composer up`, or several.

    Args:
        is_one: Whether an option says that it is one; arguments say so, too.

    Raises:
        UsageError: It is one, and the first word is no file.
    """
    if not (is_one or has_arguments(words)):
        return select_files(words, skip_other_files=skip_other_files)
    (path, *layers), arguments = split_words(words)
    return Selection((SelectedSystem(path, tuple(layers), tuple(arguments)),))


def split_words(words: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Split the words of a command line into files and the arguments that follow them.

    The first word is a file, and so are the words right after it that end in `.yaml` or `.yml`;
    `name:=value` is always an argument.

    Raises:
        UsageError: The first word is empty, or a folder.
    """
    if not words[0]:
        message = 'the file name is empty'
        raise UsageError(message, help='is a shell variable unset?')
    if os.path.isdir(words[0]):
        raise _folder_error(words[0])
    count = 1
    suffixes = (*SUFFIXES, *LAUNCH_SUFFIXES) if words[0].endswith(LAUNCH_SUFFIXES) else SUFFIXES
    while count < len(words) and words[count].endswith(suffixes) and ':=' not in words[count]:
        count += 1
    return [Path(word) for word in words[:count]], list(words[count:])


def _folder_error(folder: str) -> UsageError:
    systems = [escape(str(path)) for path in list_systems(Path(folder))]
    shown = [*systems[:_MOST_LISTED], *(['…'] if len(systems) > _MOST_LISTED else [])]
    listed = '\n'.join(f'  {each}' for each in shown)
    message = f"'{folder}' is a folder, and a system is one file"
    return UsageError(message, help=f'it holds\n{listed}' if systems else 'it holds no system')


def list_systems(folder: Path) -> list[Path]:
    """Return the files in a folder, or in one below it, that look like systems."""
    return [path for path in walk_yaml_files(folder) if looks_like_system(path)]


def has_arguments(words: Sequence[str]) -> bool:
    """Return whether some of the words are values of arguments, as `composer up` takes them.

    These are `NAME:=VALUE`, and after a file what is no file, folder or pattern.
    """
    first, *others = words
    is_one_file = first == _STANDARD_INPUT or os.path.isfile(first)
    return any(':=' in word or (is_one_file and _is_value(word)) for word in others)


def load_given(
    paths: Sequence[Path],
    words: Sequence[str] | None = None,
    set_values: Sequence[str] = (),
    before: LoadedSystem | None = None,
    reader: StartValueReader | None = None,
    *,
    is_shown: bool = False,
) -> LoadedSystem:
    """Return the system that a command line gives: a file, its layers and arguments.

    Args:
        is_shown: Whether it is looked at and not run: then it may be a launch file.
        before: A system whose records are kept where the data are the same.
        reader: Reads the values that are known when the system starts, if the file has no errors;
            `None` for samples.

    Raises:
        UsageError: The words or the values to set do not fit the file.
        StartValueError: A value that is known when the system starts cannot be read.
    """
    if is_shown and is_launch_file(paths[0]):
        return load_launch_file(paths[0], words or (), paths[1:], set_values)
    load = create_loader(paths, words, set_values, before)
    system = load()
    if reader is None or not system.start.found or has_errors(system.diagnostics):
        return system
    return load(read_value=reader.read)


def create_loader(
    paths: Sequence[Path],
    words: Sequence[str] | None = None,
    set_values: Sequence[str] = (),
    before: LoadedSystem | None = None,
    ros_arguments: Sequence[str] = (),
) -> partial[LoadedSystem]:
    """Return what loads a system as often as it is called; see `load_given`."""
    path, text = read_standard_input(paths[0])
    return partial(
        load_system,
        path,
        words,
        layers=paths[1:],
        set_values=set_values,
        text=text,
        before=before,
        ros_arguments=ros_arguments,
    )


def read_standard_input(path: Path, name: str = '<stdin>') -> tuple[Path, bytes | None]:
    """Return a path, and no text; for `-` a name, and the text of standard input."""
    if str(path) != _STANDARD_INPUT:
        return path, None
    return Path(name), sys.stdin.buffer.read(MAX_FILE_BYTES + 1)


def _is_value(word: str) -> bool:
    is_file = word == _STANDARD_INPUT or word.endswith(SUFFIXES) or os.path.lexists(word)
    return not (is_file or os.sep in word or glob.has_magic(word))


def _is_layer(word: str) -> bool:
    if not word.endswith(SUFFIXES) or not os.path.isfile(word):
        return False
    data = read_document(Path(word)).data
    if data is None or _find_near('version', {str(key): 0 for key in data}):
        return False
    return not known_keys('').isdisjoint(data)


def _identity(path: Path) -> str:
    return os.path.abspath(path) if str(path) != _STANDARD_INPUT else _STANDARD_INPUT  # noqa: PTH100


def looks_like_system(path: Path) -> bool:
    """Return whether a file is meant for Composer, even if it has errors.

    A file is if it names the schema of Composer, or has the top-level keys `version` and `nodes`
    (`nodes` not being a list). If one of the two is missing or misspelt, publishers, timers and so
    on must be below `nodes`; a file without nodes must have `version: 1`, something else to run,
    and no keys of others. This excludes Docker Compose files, GitHub workflows and ROS 2 parameter
    files.
    """
    try:
        text = read_file(path)[:_MAX_BYTES_READ].decode('utf-8-sig', errors='replace')
    except UnreadableFileError:
        return True  # reading it for the check will report the error
    if re.search(rf'^#.*\$schema=\S*{re.escape(_SCHEMA)}', text, re.MULTILINE):
        return True
    if text.lstrip().startswith('{'):
        names = {match[1] for match in _FLOW_KEY.finditer(text)}
        return 'version' in names and (
            'nodes' in names or _runs_something(text, dict.fromkeys(names, 0))
        )
    keys = {match[2]: match.end() for match in _TOP_KEY.finditer(text)}
    nodes = _find_near('nodes', keys)
    if nodes is None:
        return _runs_something(text, keys)
    if _LIST.match(text, keys[nodes]):
        return False
    if nodes == 'nodes' and _find_near('version', keys):
        return True
    return bool(_ENTITIES.search(text, keys[nodes]))


def _runs_something(text: str, keys: Mapping[str, int]) -> bool:
    """Return whether a file without nodes runs something, by its keys and where they end."""
    if not _VERSION_1.search(text) or not all(_find_near(key, known_keys('')) for key in keys):
        return False
    ends = [keys[key] for name in _WITHOUT_NODES if (key := _find_near(name, keys))]
    return any(not _LIST.match(text, end) for end in ends)


def _find_near(wanted: str, keys: Collection[str]) -> str | None:
    """Return the wanted key, or one that differs by about one letter."""
    if wanted in keys:
        return wanted
    import difflib

    near = difflib.get_close_matches(wanted, keys, n=1, cutoff=_SIMILAR)
    return near[0] if near else None


def _expand(word: str) -> Iterator[tuple[Path | None, bool]]:
    """Yield each file and whether it was named; `None` instead of a file if nothing was found."""
    if word == _STANDARD_INPUT or os.path.lexists(word) or (word and not glob.has_magic(word)):
        matches = [word]
    else:
        matches = match_pattern(word)
        if not matches:
            yield None, False
    for match in matches:
        path = Path(match)
        if word == _STANDARD_INPUT or not os.path.isdir(path):
            yield path, word != _STANDARD_INPUT
            continue
        found = [
            each
            for each in walk_yaml_files(path)
            if is_scenario_file(each) or looks_like_system(each)
        ]
        layers = _find_layers(found)
        yield from ((inside, False) for inside in found if _identity(inside) not in layers)
        if not found:
            yield None, False


def _find_layers(found: Sequence[Path]) -> set[str]:
    """Return the files that others name as their layers, under `check:` or in scenarios."""
    layers: set[str] = set()
    if all(map(_has_version, found)):
        return layers
    for path in found:
        data = read_document(path).data or {}
        named = data.get('check')
        for entry in (*(named.values() if isinstance(named, dict) else ()), data.get('system')):
            texts = entry.get('layers') if isinstance(entry, dict) else None
            for text in texts if isinstance(texts, list) else ():
                layers.add(_identity(path.parent / str(text)))
    return layers


def _has_version(path: Path) -> bool:
    with suppress(UnreadableFileError):
        text = read_file(path)[:_MAX_BYTES_READ].decode('utf-8-sig', errors='replace')
        return is_scenario_file(path) or bool(_VERSION.search(text))
    return True


def match_pattern(pattern: str) -> list[str]:
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


def walk_yaml_files(folder: Path) -> Iterator[Path]:
    """Yield the YAML files in a folder, or in one below it, but not in those of others."""
    for at, folders, files in os.walk(folder):
        folders[:] = sorted(
            name
            for name in folders
            if not name.startswith('.')
            and name not in _SKIPPED_FOLDERS
            and not os.path.exists(Path(at, name, _SKIPPED_BY_COLCON))
        )
        paths = (Path(at, name) for name in sorted(files) if name.endswith(SUFFIXES))
        # A pipe or a device is nobody's system.
        yield from (path for path in paths if os.path.isfile(path) or not os.path.exists(path))


def _explain_nothing(word: str) -> Diagnostic:
    if os.path.isdir(word):
        return Diagnostic(
            'nothing-to-check',
            'no system in this folder',
            word,
            help="a system is a .yaml file with 'version: 1' and 'nodes:', 'processes:', "
            "'containers:' or 'include:' at its top level",
        )
    return Diagnostic('nothing-to-check', 'no file matches this pattern', word or "''")
