"""The files that one host is brought: a release of its part of the system."""

from __future__ import annotations

import hashlib
import re
import shlex
from importlib.resources import files as resources
from typing import TYPE_CHECKING

from composer.export.parts import keep_apart
from composer.export.systemd import (
    environment_file_of,
    explain_environment_file,
    render_unit,
    unit_name,
)
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from pathlib import Path

    from composer.hosts.project_files import ProjectFiles
    from composer.hosts.requirements import PlatformSpec
    from composer.language.specs import HostSpec, SystemSpec

_MODE, _PROGRAM_MODE = 0o644, 0o755
# The stop of a system, and then its exit.
_EXIT_SEC = 15.0
_NO_FOLDER_NAME = re.compile(r'[^A-Za-z0-9_.-]|^\.+')

_COMPOSER = """#!/bin/sh
# Runs Composer as this release has it.
here=$(cd "$(dirname "$0")" && pwd) || exit
venv=${{here%/systems/*}}/venvs/{venv}
{setup}export PATH="$venv/bin:$PATH" PYTHONUNBUFFERED=1
export PYTHONPATH={paths}"${{PYTHONPATH:+:$PYTHONPATH}}"
{variables}cd "$here"/{folder} || exit
exec "$venv/bin/python" -m composer "$@"
"""
_PART = """#!/bin/sh
# Runs Composer for the part of this host.
composer=$(dirname "$0")/composer
case $1 in
  up) shift && exec "$composer" up {words} "$@" ;;
  # The plan from the file to itself has the errors of this part, and nothing else.
  check) exec "$composer" plan {file} {plan} ;;
  plan) exec "$composer" plan {plan} ;;
{build}esac
"""
_BUILD = '  build) exec "$composer" interfaces build {file} ;;\n'


@record
class PartSources:
    """What a part is made of.

    Attributes:
        given: The file and its layers, as the host is given them.
        words: The arguments and settings of the command line.
        behaviours: The files of the behaviours, by the folder that modules are searched in.
        wheels: Those of what is required.
        target: What the host is.
        variables: What the environment says of ROS.
        read: Other variables of the environment, which the files read.
    """

    spec: SystemSpec
    host: HostSpec
    files: ProjectFiles
    given: Sequence[str]
    words: Sequence[str]
    behaviours: Mapping[Path, Mapping[str, bytes]]
    wheels: Sequence[Path]
    target: PlatformSpec
    variables: Mapping[str, str]
    read: Collection[str] = ()


def folder_of(system: str, host: HostSpec) -> str:
    """Return the folder of a system on a host: absolute, or from `~/`."""
    folder = host.folder if host.folder.startswith(('/', '~/')) else f'~/{host.folder}'
    return f'{folder}/systems/{keep_apart(system, _NO_FOLDER_NAME.sub("_", system))}'


def write_part(sources: PartSources, folder: Path) -> None:
    """Write the files that a host is brought into a folder."""
    placed = {sources.files.place(path): path for path in sources.files.paths}
    for place, path in placed.items():
        is_program = path.stat().st_mode & 0o100
        _write(folder / 'files' / place, path.read_bytes(), _PROGRAM_MODE if is_program else _MODE)
    for root, modules in sources.behaviours.items():
        for name, data in modules.items():
            _write(folder / 'files' / sources.files.place(root) / name, data)
    _write(folder / 'composer', _render_composer(sources).encode(), _PROGRAM_MODE)
    _write(folder / 'part', _render_part(sources).encode(), _PROGRAM_MODE)
    _write(folder / 'unit', _render_unit(sources).encode())
    names = sorted(path.name for path in sources.wheels)
    _write(folder / 'wheels.txt', ''.join(f'{name}\n' for name in names).encode())
    write_change(sources.spec.name, sources.host, folder, sources.wheels, sources.target)


def write_change(
    system: str,
    host: HostSpec,
    folder: Path,
    wheels: Sequence[Path] = (),
    target: PlatformSpec | None = None,
) -> None:
    """Write the program that changes what a host runs."""
    settings = {
        'part': f'{system}@{host.name}',
        'unit': unit_name(system, host.name),
        'scope': host.systemd,
        'seconds': '"${COMPOSER_ROLLBACK_SEC:-90}"',
        'venv': _venv_name(host, wheels, target),
        'venv_options': '--system-site-packages' if target and target.ros else '',
        'python': host.python,
    }
    lines = [
        f'{key}={value if key == "seconds" else shlex.quote(value)}'
        for key, value in settings.items()
    ]
    text = (resources('composer.hosts') / 'ansible/change.sh').read_text(encoding='utf-8')
    _write(
        folder / 'change',
        text.replace('# @SETTINGS@', '\n'.join(lines)).encode(),
        _PROGRAM_MODE,
    )


def _venv_name(host: HostSpec, wheels: Sequence[Path], target: PlatformSpec | None) -> str:
    names = sorted(path.name for path in wheels)
    text = '\n'.join([host.python, target.ros if target else '', *names])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _render_composer(sources: PartSources) -> str:
    files, ros = sources.files, sources.target.ros
    paths = dict.fromkeys(map(files.place, [*sources.behaviours, *files.marks]))
    return _COMPOSER.format(
        setup=f'. {shlex.quote(f"/opt/ros/{ros}/setup.sh")}\n' if ros else '',
        venv=_venv_name(sources.host, sources.wheels, sources.target),
        paths=':'.join(f'"$here"/{shlex.quote(_inside(place))}' for place in paths),
        variables=''.join(
            f'export {name}={shlex.quote(value)}\n' for name, value in sources.variables.items()
        ),
        folder=shlex.quote(_inside(files.place(files.folder))),
    )


def _render_part(sources: PartSources) -> str:
    file, *layers = sources.given
    more = [*sources.words, '--host', sources.host.name]
    return _PART.format(
        file=shlex.quote(file),
        words=shlex.join([file, *layers, *more]),
        plan=shlex.join([file, *(f'--layer={layer}' for layer in layers), *more]),
        build=_BUILD.format(file=shlex.quote(file)) if sources.spec.interfaces else '',
    )


def _render_unit(sources: PartSources) -> str:
    spec, host, read = sources.spec, sources.host, sorted(sources.read)
    root = folder_of(spec.name, host)
    # With other names it is another unit: the system must start again to have them.
    explained = [explain_environment_file(host.systemd, read)] if read else []
    return render_unit(
        ['/bin/sh', f'{root}/change', 'start'],
        description=f'{spec.name} on {host.name}',
        folder=root,
        stop_sec=spec.longest_stop_sec + _EXIT_SEC,
        scope=host.systemd,
        reload=['/bin/sh', f'{root}/live/composer', 'reload', f'{spec.name}@{host.name}'],
        lowest_nice=min((worker.nice or 0 for worker in spec.workers.values()), default=0),
        environment_file=f'-{environment_file_of(spec.name)}' if read else '',
        comments=['Written by Composer, which stops if somebody has edited it.', *explained],
    )


def _inside(place: str) -> str:
    return 'files' if place == '.' else f'files/{place}'


def _write(path: Path, data: bytes, mode: int = _MODE) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    path.chmod(mode)
