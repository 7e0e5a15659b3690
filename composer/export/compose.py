"""A Compose file, for `docker compose` and others that read it: a service for each part.

Source: https://github.com/compose-spec/compose-spec/blob/main/spec.md
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.export.documents import literal, render_document
from composer.export.images import PROJECT, render_dockerfile
from composer.export.parts import keep_apart

if TYPE_CHECKING:
    from composer.export.parts import Export, HostPart

FILE = 'compose.yaml'
_NO_NAME = re.compile(r'[^a-z0-9_-]+')
_VARIABLE = re.compile(r'[A-Za-z_]\w*', re.ASCII)
_REMARKS = {
    'network_mode': 'ROS 2 finds others by multicast, and talks on ports that it chooses itself.',
    'ipc': 'Programs on one computer exchange messages in shared memory.',
    'stop_grace_period': 'Composer stops its nodes, workers and processes first.',
    'restart': "After a crash and a reboot, until 'docker compose stop'.",
    'profiles': 'Each host starts its own part, and nobody else does.',
    'volumes': 'The project; what drivers need is missing here: devices, groups, other files.',
    'cap_add': 'A worker has a nice value below 0.',
    'healthcheck': 'It fails if the system does not answer.',
}


def render_files(export: Export) -> dict[str, str]:
    """Return the text of the Compose file, by its name.

    Raises:
        ComposerError: Two hosts have almost the same name.
    """
    build = None if export.image else _build(export)
    services: dict[str, Any] = {}
    for part in export.parts:
        name = service_name(part.host or part.system)
        if name in services:
            message = f"the service of host '{part.host}' has the name of another: '{name}'"
            raise ComposerError(message)
        services[name] = _service(export, part, build)
    data = {'name': project_name(export.name), 'services': services}
    return {FILE: render_document(data, _REMARKS)}


def project_name(text: str) -> str:
    """Return a name that Compose takes for projects; that of another system is another one."""
    return keep_apart(text, service_name(text))


def service_name(text: str) -> str:
    """Return a name that Compose takes for services."""
    return _NO_NAME.sub('-', text.lower()).strip('-_') or 'system'


def _build(export: Export) -> dict[str, Any]:
    text = render_dockerfile(export.root, has_interfaces=export.has_interfaces)
    return {'context': literal(export.source), 'dockerfile_inline': literal(text)}


def _service(export: Export, part: HostPart, build: dict[str, Any] | None) -> dict[str, Any]:
    inner = PROJECT / export.folder.relative_to(export.root)
    words = ['composer', *export.arguments(part, PROJECT)]
    # Docker would take an image without a tag for one of its own registry.
    name = f'composer-{project_name(export.name)}:latest'
    service: dict[str, Any] = {'image': literal(export.image or name)}
    service |= {'build': build} if build else {}
    service |= {'profiles': [service_name(part.host)]} if part.host else {}
    return service | {
        'command': [literal(each) for each in words],
        'working_dir': literal(str(inner)),
        'init': True,
        'network_mode': 'host',
        'ipc': 'host',
        **({'cap_add': ['SYS_NICE']} if part.lowest_nice < 0 else {}),
        **_environment(export, part),
        'volumes': [
            {
                'type': 'bind',
                'source': literal(export.source),
                'target': str(PROJECT),
                'read_only': True,
            }
        ],
        'healthcheck': {
            'test': ['CMD', 'composer', 'ps', literal(part.name)],
            'interval': '30s',
            'timeout': '20s',
            'start_period': '60s',
        },
        'stop_grace_period': f'{math.ceil(part.stop_sec)}s',
        'restart': 'unless-stopped',
    }


def _environment(export: Export, part: HostPart) -> dict[str, Any]:
    entries = [literal(f'{name}={value}') for name, value in sorted(part.variables.items())]
    for name, must_be_set in export.read.items():
        # Values of the environment stand in no file: Compose takes them from its own.
        advice = 'set it in the environment, or in a file .env beside this one'
        is_required = must_be_set and _VARIABLE.fullmatch(name)
        entries.append(f'{name}=${{{name}?{advice}}}' if is_required else literal(name))
    return {'environment': entries} if entries else {}
