"""Paths in a file: relative to it, absolute, or in the share folder of a ROS package."""

from __future__ import annotations

import os
from functools import partial
from typing import TYPE_CHECKING, Any

from composer.ament import explain_missing_package, find_share, find_source, list_packages
from composer.errors import ComposerError
from composer.input_limits import explain_missing
from composer.language.values.start_values import replace_start_values

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from composer.diagnostics import Span
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath, SourceMap

_PACKAGE = 'package://'
_NODL = 'nodl://'


class PathError(ComposerError):
    """A path leads nowhere."""


class PackagePathError(PathError):
    """A path leads into a package that is not installed."""


def is_in_package(text: str) -> bool:
    """Return whether a path leads into the share folder of a ROS package."""
    return text.startswith(_PACKAGE)


def resolve_path(text: str, folder: Path) -> Path:
    """Return the path that a text means in a file of `folder`.

    Of a package that colcon has linked, the source counts, also where a file is a copy.

    Raises:
        PackagePathError: The package of `package://name/path` is not installed.
    """
    if not is_in_package(text):
        return folder / text
    package, _, rest = text.removeprefix(_PACKAGE).partition('/')
    share = find_share(package)
    if share is None:
        message = f"no package '{package}' is installed"
        help_text = explain_missing_package(package, list_packages())
        raise PackagePathError(message, help=help_text)
    path = share / rest
    source = None if os.path.islink(path) else find_source(share)  # noqa: PTH114 - for any name
    is_copy = source is not None and os.path.isfile(path) and os.path.isfile(source / rest)
    return source / rest if source and is_copy else path


def explain_absent(path: Path, place: Span, *, is_folder: bool = False) -> str | None:
    """Return the help for a path to nothing that is written at `place`, in the form used there."""
    is_relative = not place.text.lstrip('\'"').startswith(('/', _PACKAGE))
    return explain_missing(path, place.source.folder if is_relative else None, is_folder=is_folder)


def resolve_paths(system: LoadedSystem) -> None:
    """Resolve the paths of a file, so that its data hold in any file.

    Paths into packages stay as they are: what is wrong with them is for the checks to say.
    """
    data, positions = system.entries, system.positions
    resolved = dict(data)
    if 'interfaces' in data:
        resolved['interfaces'] = {
            package: with_folder(entry, partial(_resolved, path=path, positions=positions))
            for package, entry in data['interfaces'].items()
            for path in [path_of_folder(package, positions)]
        }
    for section in ('nodes', 'processes', 'hosts'):
        if section in data:
            resolved[section] = {
                name: with_paths(entry, (section, name), positions)
                for name, entry in data[section].items()
            }
    system.data = replace_start_values(
        resolved, lambda path, value: _with_file(value, path, positions)
    )


def path_of_folder(package: str, positions: SourceMap) -> DataPath:
    """Return where a file names the folder of an interface package."""
    path = ('interfaces', package)
    return (*path, 'folder') if (*path, 'folder') in positions.values else path


def with_folder(entry: str | dict[str, Any], change: Callable[[str], str]) -> str | dict[str, Any]:
    """Return an entry of `interfaces:` with its folder changed."""
    return change(entry) if isinstance(entry, str) else entry | {'folder': change(entry['folder'])}


def _with_file(value: dict[str, Any], path: DataPath, positions: SourceMap) -> dict[str, Any]:
    if 'file' not in value:
        return value
    return value | {'file': _resolved(value['file'], (*path, 'file'), positions)}


def with_paths(entry: dict[str, Any], path: DataPath, positions: SourceMap) -> dict[str, Any]:
    """Return an entry of a section with its paths resolved."""
    changed: dict[str, Any] = {}
    if 'cwd' in entry:
        changed['cwd'] = _resolved(entry['cwd'], (*path, 'cwd'), positions)
    # As ssh reads it, `~` is the folder of who logs in here.
    if 'identity_file' in entry and not entry['identity_file'].startswith('~'):
        at = (*path, 'identity_file')
        changed['identity_file'] = _resolved(entry['identity_file'], at, positions)
    if 'launch' in entry:
        changed['launch'] = _resolved_launch_file(entry['launch'], (*path, 'launch'), positions)
    if 'interface' in entry:
        changed['interface'] = _resolved(entry['interface'], (*path, 'interface'), positions)
    if path[0] == 'processes' and isinstance(entry.get('nodes'), dict):
        changed['nodes'] = {
            name: node and with_paths(node, (*path, 'nodes', name), positions)
            for name, node in entry['nodes'].items()
        }
    if 'components' in entry:
        changed['components'] = {
            name: with_paths(each, (*path, 'components', name), positions)
            for name, each in entry['components'].items()
        }
    if 'parameter_files' in entry:
        at = (*path, 'parameter_files')
        changed['parameter_files'] = [
            _with_file(each, (*at, index), positions)
            if isinstance(each, dict)
            else _resolved(each, (*at, index), positions)
            for index, each in enumerate(entry['parameter_files'])
        ]
    return entry | changed if changed else entry


def _resolved(text: str, path: DataPath, positions: SourceMap) -> str:
    if is_in_package(text) or text.startswith(_NODL):
        return text
    return str(positions.value(path).source.folder / text)


def _resolved_launch_file(text: str, path: DataPath, positions: SourceMap) -> str:
    """Return a launch file as `_resolved`; what is not beside the file is in a package."""
    beside = positions.value(path).source.folder / text
    is_path = (
        '/' not in text or text.startswith(('./', '../', '/', _PACKAGE)) or os.path.exists(beside)
    )
    return _resolved(text if is_path else f'{_PACKAGE}{text}', path, positions)
