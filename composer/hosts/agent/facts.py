"""What a host says of itself: its Python, its disk, its ROS, and what was deployed there."""

from __future__ import annotations

import os
import platform
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.hosts.agent.files_there import digest_file, read_link

if TYPE_CHECKING:
    from composer.hosts.agent.changeover import Transaction
    from composer.hosts.agent.host_unit import Service
    from composer.hosts.agent.store import Store

_ROS = Path('/opt/ros')


def collect_facts(store: Store, service: Service, transaction: Transaction) -> dict[str, Any]:
    """Return what decides what must be brought, and what stands against that."""
    manifest = store.manifest()
    return {
        'python': list(sys.version_info[:3]),
        'machine': platform.machine(),
        'libc': platform.libc_ver()[1],
        'has_venv': _has_venv(),
        'folder': str(store.folder),
        'root': str(store.root),
        'hold': str(transaction.hold),
        'user': os.getuid(),
        'free_bytes': store.free_bytes(),
        'may_run': store.may_run(),
        'ros': sorted(path.parent.name for path in _ROS.glob('*/setup.sh')),
        'systemd_problem': service.why_unusable(),
        'lingers': service.lingers(),
        'manifest': manifest,
        'release': read_link(store.current),
        'is_foreign': manifest is None and store.root.exists() and not _is_own(store),
        'is_pending': transaction.is_pending,
        'edited': store.list_edited(),
        'missing': store.list_missing(),
        'wheels': [path.name for path in (store.folder / 'wheels').glob('*.whl')],
        'venvs': [path.parent.name for path in (store.folder / 'venvs').glob('*/ready')],
        'composers': [path.name for path in (store.folder / 'composer').glob('*')],
        **_unit_facts(service),
    }


def _has_venv() -> bool:
    try:
        from venv import EnvBuilder
    except ImportError:
        return False
    return callable(EnvBuilder)


def _unit_facts(service: Service) -> dict[str, Any]:
    environment = {'environment_file': str(service.environment_file), 'variables': []}
    if service.why_unusable():
        return environment | {
            'unit': None,
            'unit_path': str(service.path),
            'unit_digest': None,
            'state': {},
        }
    return {
        **environment,
        'variables': sorted(service.variables()),
        'unit': service.read(),
        'unit_path': str(service.path),
        'unit_digest': digest_file(service.path),
        'state': service.state(),
    }


def _is_own(store: Store) -> bool:
    """Return whether a folder without a release is what a deployment has left that was cut off."""
    names = {each.name for each in store.root.iterdir()}
    return names <= {'incoming', 'pending', 'releases', 'before.json', 'current', 'start', 'live'}
