"""Manifests for Kubernetes: the files of the system, and a workload for each part.

Source: https://kubernetes.io/docs/reference/kubernetes-api/
"""

from __future__ import annotations

import base64
import hashlib
import math
import os
import re
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError, UsageError
from composer.export.documents import literal, render_document
from composer.export.images import PROJECT
from composer.export.parts import keep_apart
from composer.input_limits import read_file

if TYPE_CHECKING:
    from pathlib import Path

    from composer.export.parts import Export, HostPart

FILE = 'kubernetes.yaml'
# A ConfigMap may have 1 MiB, with all that is around the files.
_MOST_BYTES = 1_000_000
# What is added to names of pods leaves 52 characters, and a digest may be added here.
_LONGEST_LABEL = 45
_NO_NAME = re.compile(r'[^a-z0-9-]+')
_NO_KEY = re.compile(r'[^A-Za-z0-9._-]')
_USER = 1000
_MARK = 'pyproject.toml'
# As a name of a node in the cluster can be none of a host here.
_HOST = 'composer/host'
_REMARKS = {
    'replicas': 'Never two at a time: a StatefulSet starts none before the last one has ended.',
    _HOST: f'The part of a host runs on the node with: kubectl label node NODE {_HOST}=HOST',
    'hostNetwork': 'ROS 2 finds others by multicast, which networks of pods do not carry.',
    'hostIPC': 'Pods on one computer exchange messages in shared memory, as one user.',
    'terminationGracePeriodSeconds': 'Composer stops its nodes, workers and processes first.',
    'add': 'A worker has a nice value below 0.',
    'securityContext': 'What drivers need is missing here: devices, groups, capabilities.',
    'startupProbe': 'They fail if the system does not answer.',
    'secretKeyRef': 'Values of the environment stand in no file.',
}


def render_files(export: Export) -> dict[str, str]:
    """Return the text of the manifests, by its name.

    Raises:
        UsageError: There is no image.
        ComposerError: The files are too large.
    """
    if not export.image:
        message = 'Kubernetes runs images, and none is given'
        advice = "name one with --image; 'composer export compose' says how one is built"
        raise UsageError(message, help=advice)
    files = _config_map(export)
    checksum = hashlib.sha256(repr(files).encode()).hexdigest()[:16]
    workloads = [_workload(export, part, files, checksum) for part in export.parts]
    documents = [render_document(workload, _REMARKS) for workload in workloads]
    return {FILE: '---\n'.join([render_document(files), *documents])}


def _object_name(text: str) -> str:
    """Return a name that Kubernetes takes for objects: a label of DNS, another for each text."""
    label = _NO_NAME.sub('-', text.lower())[:_LONGEST_LABEL].strip('-') or 'system'
    return keep_apart(text, label)


def _config_map(export: Export) -> dict[str, Any]:
    texts: dict[str, str] = {}
    others: dict[str, str] = {}
    for key, path in _keys(export).items():
        content = b'' if path.name == _MARK else read_file(path)
        try:
            texts[key] = content.decode()
        except UnicodeDecodeError:
            others[key] = base64.b64encode(content).decode()
    size = sum(len(each.encode()) for each in (*texts.values(), *others.values()))
    if size > _MOST_BYTES:
        message = f'the files of the system have {size} bytes, and a ConfigMap has at most 1 MiB'
        raise ComposerError(message, help='put large files into the image')
    return {
        'apiVersion': 'v1',
        'kind': 'ConfigMap',
        'metadata': _metadata(export, _object_name(export.name)),
        'data': texts,
        **({'binaryData': others} if others else {}),
    }


def _keys(export: Export) -> dict[str, Path]:
    """Return the files of a system by their keys in the ConfigMap, which have no slashes."""
    found: dict[str, Path] = {}
    # It marks the root of the project, where behaviours are searched.
    for path in sorted({*export.files, export.root / _MARK}):
        key = base = _NO_KEY.sub('_', str(path.relative_to(export.root)))
        count = 1
        while key in found:
            count += 1
            key = f'{base}-{count}'
        found[key] = path
    return found


def _metadata(export: Export, name: str) -> dict[str, Any]:
    labels = {
        'app.kubernetes.io/name': _object_name(export.name),
        'app.kubernetes.io/managed-by': 'composer',
    }
    return {'name': name, 'labels': labels}


def _workload(
    export: Export, part: HostPart, files: dict[str, Any], checksum: str
) -> dict[str, Any]:
    name = _object_name('-'.join(filter(None, (part.system, part.host))))
    labels = {'app.kubernetes.io/instance': name}
    selector = {'nodeSelector': {_HOST: part.host}} if part.host else {}
    items = [
        {
            'key': key,
            'path': str(path.relative_to(export.root)),
            'mode': 0o555 if os.access(path, os.X_OK) else 0o444,
        }
        for key, path in _keys(export).items()
    ]
    metadata = _metadata(export, name)
    return {
        'apiVersion': 'apps/v1',
        'kind': 'StatefulSet',
        'metadata': metadata,
        'spec': {
            'serviceName': name,
            'replicas': 1,
            'selector': {'matchLabels': labels},
            'template': {
                'metadata': {
                    'labels': {**metadata['labels'], **labels},
                    # Other files make other pods.
                    'annotations': {'composer/files': checksum},
                },
                'spec': {
                    **selector,
                    'hostNetwork': True,
                    'dnsPolicy': 'ClusterFirstWithHostNet',
                    'hostIPC': True,
                    'terminationGracePeriodSeconds': math.ceil(part.stop_sec),
                    'automountServiceAccountToken': False,
                    'containers': [_container(export, part)],
                    'volumes': [
                        {
                            'name': 'project',
                            'configMap': {'name': files['metadata']['name'], 'items': items},
                        },
                        {'name': 'tmp', 'emptyDir': {}},
                    ],
                },
            },
        },
    }


def _container(export: Export, part: HostPart) -> dict[str, Any]:
    inner = PROJECT / export.folder.relative_to(export.root)
    words = export.arguments(part, PROJECT)
    needs_nice = part.lowest_nice < 0
    return {
        'name': 'composer',
        'image': export.image,
        'args': [literal(each) for each in ('composer', *words)],
        'workingDir': str(inner),
        'env': [*_environment(export, part)],
        **_probes(part),
        'securityContext': {
            # Capabilities are for root alone.
            'runAsNonRoot': not needs_nice,
            'runAsUser': 0 if needs_nice else _USER,
            'runAsGroup': 0 if needs_nice else _USER,
            'allowPrivilegeEscalation': False,
            'readOnlyRootFilesystem': True,
            'capabilities': {
                'drop': ['ALL'],
                **({'add': ['SYS_NICE']} if needs_nice else {}),
            },
            'seccompProfile': {'type': 'RuntimeDefault'},
        },
        'volumeMounts': [
            {'name': 'project', 'mountPath': str(PROJECT), 'readOnly': True},
            {'name': 'tmp', 'mountPath': '/tmp'},  # noqa: S108 - of the container
        ],
    }


def _probes(part: HostPart) -> dict[str, Any]:
    if not part.answers_alone:
        # It must not be killed because the host of the discovery server is away.
        return {}
    probe = {'exec': {'command': ['composer', 'ps', literal(part.name)]}, 'timeoutSeconds': 20}
    return {
        'startupProbe': {**probe, 'periodSeconds': 10, 'failureThreshold': 60},
        'livenessProbe': {**probe, 'periodSeconds': 30, 'failureThreshold': 3},
    }


def _environment(export: Export, part: HostPart) -> list[dict[str, Any]]:
    # The root file system cannot be written.
    variables = {**part.variables, 'HOME': '/tmp'}  # noqa: S108 - of the container
    entries: list[dict[str, Any]] = [
        {'name': name, 'value': literal(value)} for name, value in sorted(variables.items())
    ]
    for name, must_be_set in export.read.items():
        key = {'name': _object_name(export.name), 'key': name, 'optional': not must_be_set}
        entries.append({'name': name, 'valueFrom': {'secretKeyRef': key}})
    return entries
