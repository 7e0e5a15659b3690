"""What one host is brought: a release, as a manifest and the files that it lists."""

from __future__ import annotations

import hashlib
import os
import shlex
from typing import TYPE_CHECKING, Any

from composer.export.systemd import (
    environment_file_of,
    explain_environment_file,
    render_unit,
    unit_name,
)
from composer.hosts.wheels import Wheel
from composer.language.specs import HostSpec
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from pathlib import Path

    from composer.hosts.project_files import ProjectFiles
    from composer.language.specs import SystemSpec

UNIT_COMMENT = "Written by 'composer deploy', which stops if somebody has edited it."
_REACHED_BY = ('address', 'user', 'port', 'python', 'identity_file', 'folder', 'systemd')
_MODE, _PROGRAM_MODE = 0o644, 0o755
# The stop of a system, and then its exit.
_EXIT_SEC = 15.0

_RUN = """#!/bin/sh
# Written by 'composer deploy'. Runs Composer as this release has it.
here=$(cd "$(dirname "$0")" && pwd) || exit
{setup}export PATH={venv}/bin:"$PATH" PYTHONUNBUFFERED=1
export PYTHONPATH={paths}:{composer}"${{PYTHONPATH:+:$PYTHONPATH}}"
{variables}cd "$here"/{folder} || exit
exec {venv}/bin/python -m composer "$@"
"""
_UP = """#!/bin/sh
# Written by 'composer deploy'. Runs the part of this host.
exec "$(dirname "$0")"/composer up {words} "$@"
"""
_START = """#!/bin/sh
# Written by 'composer deploy', for its unit. What it is given is there while a deployment holds
# the system; it is gone after a boot.
cd {root} || exit
if [ -L pending ] && [ ! -e "$1" ]; then
  # A deployment was cut off: back to the release before it.
  before=$(readlink pending)
  [ "$before" != none ] || exit 0
  cp -a "$before"/. live/ && ln -sfn "$before" current
fi
exec live/up --hold "$1"
"""


@record
class Part:
    """What a host is brought.

    Attributes:
        name: By which it is found on the ROS graph.
        manifest: As the host keeps it: `files` with digest and mode, by path, and the rest.
        blobs: The files, by their digests.
        wheels: Wheels of what is required, by the names of their files.
        composer: The wheel of Composer.
        sees_system: Whether the environment sees the packages of the host's Python.
        unit: The text of the unit.
        start: What it runs.
        build: The arguments by which Composer builds its interface packages; empty for none.
    """

    host: HostSpec
    name: str
    manifest: dict[str, Any]
    blobs: Mapping[str, bytes]
    wheels: Mapping[str, Path]
    composer: Wheel
    sees_system: bool
    unit: str
    start: str
    build: tuple[str, ...]


@record
class PartSources:
    """What a part is made of.

    Attributes:
        words: The files, arguments and settings of the command line, as the host is given them.
        wheels: Those of the behaviours, by the folder that they are unpacked in.
        required: Wheels of what is required, by what they are of.
        variables: What the environment says of ROS.
        start: What a system that runs starts again for, as `encode_snapshot` writes it.
        hosts: All that have a part of the system.
        read: Other variables of the environment, which the files read.
    """

    spec: SystemSpec
    host: HostSpec
    files: ProjectFiles
    words: Sequence[str]
    wheels: Mapping[Path, Wheel]
    required: Mapping[str, Path]
    composer: Wheel
    variables: Mapping[str, str]
    start: Mapping[str, Any]
    hosts: Sequence[HostSpec]
    read: Collection[str] = ()


def unit_of(system: str, host: HostSpec) -> str:
    """Return the name of the unit of a system's part."""
    return unit_name(system, host.name)


def build_part(sources: PartSources, facts: Mapping[str, Any]) -> Part:
    """Return what a host is brought.

    Args:
        facts: What the host says of itself.
    """
    host, files, spec = sources.host, sources.files, sources.spec
    required = sorted(sources.required)
    ros = next(iter(facts['ros'][::-1]), '')
    venv = hashlib.sha256('\n'.join([host.python, ros, *required]).encode()).hexdigest()[:16]
    composer = sources.composer.digest[:16]
    blobs: dict[str, bytes] = {}
    listed: dict[str, dict[str, Any]] = {}

    def add(name: str, data: bytes, mode: int = _MODE) -> None:
        digest = hashlib.sha256(data).hexdigest()
        blobs[digest] = data
        listed[name] = {'digest': digest, 'mode': mode}

    for path in files.paths:
        add(f'files/{files.place(path)}', path.read_bytes(), _mode_of(path))
    unpack = {}
    for folder, wheel in sources.wheels.items():
        add(f'wheels/{wheel.name}', wheel.data)
        unpack[f'wheels/{wheel.name}'] = _join('files', _place(files, folder))
    name = f'{spec.name}@{host.name}'
    run = _render_run(sources, facts, ros, venv, list(unpack.values()))
    add('composer', run.encode(), _PROGRAM_MODE)
    up = _UP.format(words=shlex.join([*sources.words, '--host', host.name]))
    add('up', up.encode(), _PROGRAM_MODE)
    unit = _render_unit(sources, facts)
    manifest = {
        'system': spec.name,
        'part': name,
        'files': listed,
        'unpack': unpack,
        'contents': {
            _join(folder, inner): digest
            for wheel_name, folder in unpack.items()
            for wheel in sources.wheels.values()
            if wheel_name == f'wheels/{wheel.name}'
            for inner, digest in wheel.files.items()
        },
        'venv': venv,
        'packages': required,
        'composer': composer,
        'interfaces': sorted(spec.interfaces),
        'start': sources.start,
        'hosts': {each.name: _keep_host(each) for each in sources.hosts},
        'runs': sorted([*spec.nodes, *(f'process {each}' for each in spec.processes)]),
        'unit_digest': hashlib.sha256(unit.encode()).hexdigest(),
    }
    return Part(
        host=host,
        name=name,
        manifest=manifest,
        blobs=blobs,
        wheels={path.name: path for path in sources.required.values()},
        composer=sources.composer,
        sees_system=bool(ros),
        unit=unit,
        start=_START.format(root=shlex.quote(facts['root'])),
        build=('interfaces', 'build', sources.words[0]) if spec.interfaces else (),
    )


def part_of_nothing(host: HostSpec, name: str) -> Part:
    """Return what a host has that is to run nothing any more."""
    nothing = Wheel('', b'', {})
    return Part(host, name, {}, {}, {}, nothing, sees_system=False, unit='', start='', build=())


def _keep_host(host: HostSpec) -> dict[str, Any]:
    """Return how a host is reached, as `read_hosts` reads it."""
    return {each: getattr(host, each) for each in _REACHED_BY}


def read_hosts(manifest: Mapping[str, Any] | None) -> dict[str, HostSpec]:
    """Return the hosts that had a part of the system when a release was brought."""
    kept = (manifest or {}).get('hosts', {})
    return {
        name: HostSpec(name=name, description='', path=(), **entry) for name, entry in kept.items()
    }


def _render_run(
    sources: PartSources,
    facts: Mapping[str, Any],
    ros: str,
    venv: str,
    unpacked: Sequence[str],
) -> str:
    folder = facts['folder']
    paths = [_join('files', _place(sources.files, each)) for each in sources.files.marks]
    found = dict.fromkeys([*unpacked, *paths])
    setup = f'. {shlex.quote(f"/opt/ros/{ros}/setup.sh")}\n' if ros else ''
    variables = ''.join(
        f'export {name}={shlex.quote(value)}\n' for name, value in sources.variables.items()
    )
    return _RUN.format(
        setup=setup,
        venv=shlex.quote(f'{folder}/venvs/{venv}'),
        paths=':'.join(f'"$here"/{shlex.quote(each)}' for each in found),
        composer=shlex.quote(f'{folder}/composer/{sources.composer.digest[:16]}'),
        variables=variables,
        folder=shlex.quote(_join('files', _place(sources.files, sources.files.folder))),
    )


def _render_unit(sources: PartSources, facts: Mapping[str, Any]) -> str:
    spec, host = sources.spec, sources.host
    root = facts['root']
    # With other names it is another unit: the system must start again to have them.
    explained = [explain_environment_file(host.systemd, sorted(sources.read))]
    return render_unit(
        ['/bin/sh', f'{root}/start', facts['hold']],
        description=f'{spec.name} on {host.name}',
        folder=root,
        stop_sec=spec.longest_stop_sec + _EXIT_SEC,
        scope=host.systemd,
        reload=[f'{root}/live/composer', 'reload', f'{spec.name}@{host.name}'],
        lowest_nice=min((each.nice or 0 for each in spec.workers.values()), default=0),
        environment_file=f'-{environment_file_of(spec.name)}' if sources.read else '',
        comments=[UNIT_COMMENT, *(explained if sources.read else [])],
    )


def _place(files: ProjectFiles, folder: Path) -> str:
    """Return where a folder is on the host; one beside the project gets a place of its own."""
    if folder.is_relative_to(files.root):
        return files.place(folder)
    return f'.beside/{"/".join(folder.parts[1:])}'


def _join(folder: str, name: str) -> str:
    return os.path.normpath(f'{folder}/{name}')


def _mode_of(path: Path) -> int:
    return _PROGRAM_MODE if path.stat().st_mode & 0o100 else _MODE
