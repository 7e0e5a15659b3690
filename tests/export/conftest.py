"""A real service manager of systemd, as that of a user, in namespaces of its own."""

import os
import shutil
import subprocess
import textwrap
from pathlib import Path

import pytest

_MANAGER = '/usr/lib/systemd/systemd'
_NAMESPACES = ['unshare', '--mount', '--pid', '--fork', '--kill-child', '--mount-proc']
# systemd runs as a manager of a user only where it finds signs of one of the system.
_SCRIPT = f"""
mount -t tmpfs tmpfs /run
mkdir -p /run/systemd/system /run/user
export XDG_RUNTIME_DIR=/run/user XDG_CONFIG_HOME="$1" SYSTEMD_LOG_TARGET=console
{_MANAGER} --user --unit=basic.target </dev/null >"$1/manager.log" 2>&1 &
manager=$!
until systemctl --user is-active --quiet basic.target; do sleep 0.05; done
bash -c "$2"
code=$?
kill $manager
exit $code
"""


@pytest.fixture
def service_manager(tmp_path):
    """Return what starts a manager with units, runs a script beside it, and ends both.

    The units are texts by their names. The script is one of bash, whose output is returned.
    """
    if not Path(_MANAGER).exists() or shutil.which('unshare') is None:
        pytest.skip('needs systemd and unshare')
    probe = subprocess.run(
        [*_NAMESPACES, 'mount', '-t', 'tmpfs', 'tmpfs', '/run'], check=False, capture_output=True
    )
    if probe.returncode:
        pytest.skip('needs the right to make namespaces')

    def run(units, script, timeout_sec=60):
        folder = tmp_path / 'manager' / 'systemd' / 'user'
        folder.mkdir(parents=True)
        for name, text in units.items():
            (folder / name).write_text(text)
        words = ['bash', '-c', textwrap.dedent(_SCRIPT), 'bash', tmp_path / 'manager', script]
        result = subprocess.run(
            [*_NAMESPACES, *words],
            check=False,
            capture_output=True,
            text=True,
            timeout=timeout_sec,
        )
        log = (tmp_path / 'manager' / 'manager.log').read_text()
        assert result.returncode == 0, f'{result.stdout}\n{result.stderr}\n{log}'
        return result.stdout

    return run


@pytest.fixture
def verify_unit(tmp_path):
    """Return what checks the text of a unit with `systemd-analyze verify`, and what it says."""
    if shutil.which('systemd-analyze') is None:
        pytest.skip('needs systemd-analyze')

    def verify(name, text, scope):
        (tmp_path / name).write_text(text)
        result = subprocess.run(
            ['systemd-analyze', f'--{scope}', 'verify', tmp_path / name],
            check=False,
            capture_output=True,
            text=True,
            env={**os.environ, 'XDG_RUNTIME_DIR': str(tmp_path)},
        )
        return result.returncode, result.stderr

    return verify
