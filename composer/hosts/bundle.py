"""A system as a folder for Ansible: inventory, playbooks, and what each host is brought."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from importlib.resources import files as resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError, UsageError
from composer.export import ANSIBLE
from composer.export.documents import render_document
from composer.export.written_files import mark, write_files
from composer.hosts.host_parts import PartSources, folder_of, write_change, write_part
from composer.hosts.project_files import collect_files, read_behaviours
from composer.hosts.requirements import (
    PlatformSpec,
    composer_requirements,
    pin,
    project_requirements,
    provide_wheels,
)
from composer.hosts.wheels import write_composer_wheel
from composer.network.servers import used_hosts
from composer.network.variables import ros_variables
from composer.planning.snapshot_taking import take_snapshot
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from composer.checks.context import CheckContext
    from composer.language.specs import HostSpec, SystemSpec

PLAYBOOKS = ('deploy.yaml', 'remove.yaml', 'ask.yaml')
_SETTINGS, _FOLDERS = 'ansible.cfg', ('hosts', 'wheels')
_KEYS = {
    'address': 'ansible_host',
    'user': 'ansible_user',
    'port': 'ansible_port',
    'identity_file': 'ansible_ssh_private_key_file',
    'python': 'ansible_python_interpreter',
}


class Bundle:
    """What the hosts of a system are brought.

    Args:
        context: The system, without errors.
        given: The file and its layers.
        named: All files that were read.
        words: The arguments of the command line that come after the files.
        read: The variables of the environment that the files read.
    """

    def __init__(
        self,
        context: CheckContext,
        given: Sequence[Path],
        named: Iterable[Path],
        words: Sequence[str],
        read: Collection[str],
    ) -> None:
        self._context, self._words, self._read = context, words, read
        modules = set(context.modules.list_files())
        others = [path for path in named if path not in modules]
        self._files = collect_files(given, others, context.spec)
        self._given = [os.path.relpath(path, self._files.folder) for path in given]

    def write(
        self,
        folder: Path,
        hosts: Sequence[HostSpec],
        targets: Mapping[str, PlatformSpec] | None = None,
    ) -> list[Path]:
        """Write all into a folder; return the paths of what people may change.

        Args:
            targets: What the hosts are, by their names; without, they are as this computer.

        Raises:
            ComposerError: Something that a host needs is not there, or a file was edited.
        """
        for name in _FOLDERS:
            if (folder / name).exists() and not (folder / PLAYBOOKS[0]).exists():
                message = f"{folder / name} is there, and was not written by 'composer export'"
                raise ComposerError(message, help='write to another folder')
        paths = write_playbooks(folder, self._context.spec, hosts)
        for name in _FOLDERS:
            shutil.rmtree(folder / name, ignore_errors=True)
            (folder / name).mkdir()
        composer = write_composer_wheel(folder / 'wheels')
        used = used_hosts(self._context.spec)
        for host in hosts:
            part = folder / 'hosts' / host.name
            if host.name not in used:
                # Whatever it runs is stopped and removed.
                write_change(self._context.spec.name, host, part)
                continue
            target = (targets or {}).get(host.name) or PlatformSpec.own()
            sources = self._collect(host, target, composer)
            for wheel in sources.wheels:
                if wheel != composer:
                    shutil.copy2(wheel, folder / 'wheels')
            write_part(sources, part)
        return [*paths, *(folder / name for name in _FOLDERS)]

    def _collect(self, host: HostSpec, target: PlatformSpec, composer: Path) -> PartSources:
        spec = self._context.spec.on_host(host.name)
        # A copy asks for the part; what was read stays read.
        snapshot = take_snapshot(replace(self._context, spec=spec))
        required = [
            *composer_requirements(
                has_ros=bool(target.ros), builds_interfaces=bool(spec.interfaces)
            ),
            *project_requirements(self._files.marks),
        ]
        return PartSources(
            spec=spec,
            host=host,
            files=self._files,
            given=self._given,
            words=self._words,
            behaviours=read_behaviours(self._context, snapshot),
            wheels=[composer, *provide_wheels(pin(required, target), target).values()],
            target=target,
            variables=ros_variables(spec),
            read=self._read,
        )


def write_playbooks(folder: Path, spec: SystemSpec, hosts: Sequence[HostSpec]) -> list[Path]:
    """Write inventory, playbooks and settings of Ansible into a folder; return their paths.

    Raises:
        ComposerError: One is there that was edited.
    """
    source = resources('composer.hosts') / 'ansible'
    texts = {name: (source / name).read_text(encoding='utf-8') for name in (*PLAYBOOKS, _SETTINGS)}
    texts['inventory.yaml'] = render_document(_describe(spec, hosts))
    return write_files(folder, {name: mark(ANSIBLE, text) for name, text in texts.items()})


def _describe(spec: SystemSpec, hosts: Sequence[HostSpec]) -> dict[str, Any]:
    entries = {}
    for host in hosts:
        given = {name: getattr(host, key) for key, name in _KEYS.items()}
        if host.identity_file:
            path = Path(host.identity_file).expanduser()
            given['ansible_ssh_private_key_file'] = str(path)
        entries[host.name] = {
            **{name: value for name, value in given.items() if value},
            'composer_root': folder_of(spec.name, host),
        }
    # How long a host waits for the next step, before it goes back.
    variables = {'composer_rollback_sec': 90}
    return {'composer': {'vars': variables, 'hosts': entries}}


def choose_hosts(spec: SystemSpec, wanted: Sequence[str] = ()) -> list[HostSpec]:
    """Return the hosts of a system: those that run a part, and that may have run one.

    Args:
        wanted: Those that were asked for; empty for all.

    Raises:
        UsageError: The system declares no hosts, or not one of those that were asked for.
    """
    if not spec.hosts:
        message = f"'{spec.name}' declares no hosts"
        raise UsageError(message, help="give the layer that has 'hosts:'")
    for name in wanted:
        if name not in spec.hosts:
            advice = suggest(name, spec.hosts, 'there are')
            message = f"'{spec.name}' has no host '{name}'"
            raise UsageError(message, help=advice)
    return [host for name, host in spec.hosts.items() if not wanted or name in wanted]
