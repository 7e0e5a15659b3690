"""The container image that a system runs in: ROS 2, Composer, and what the project asks for."""

from __future__ import annotations

import shlex
import sys
import tomllib
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from composer.input_limits import UnreadableFileError, read_file
from composer.version import find_version

if TYPE_CHECKING:
    from pathlib import Path

# Where the files of the project lie in a container.
PROJECT = PurePosixPath('/project')
_REQUIREMENTS = 'requirements.txt'


def render_dockerfile(root: Path, *, has_interfaces: bool) -> str:
    """Return the Dockerfile of an image that runs the systems of a project.

    The project itself is not in it: its files are mounted.

    Args:
        root: The project; it is the build context.
        has_interfaces: Whether interface packages are built, which needs a compiler.
    """
    version = find_version()
    pinned = f'=={version}' if version[:1].isdigit() else ''
    extras = 'ros,interfaces' if has_interfaces else 'ros'
    lines = [f'FROM python:{sys.version_info.major}.{sys.version_info.minor}-slim']
    if has_interfaces:
        lines += [
            'RUN apt-get update && apt-get install -y --no-install-recommends gcc g++ \\',
            '    && rm -rf /var/lib/apt/lists/*',
        ]
    lines += [
        f'ARG COMPOSER="rclpy-composer[{extras}]{pinned}"',
        'RUN pip install --no-cache-dir "$COMPOSER"',
    ]
    if (root / _REQUIREMENTS).is_file():
        lines += [
            f'COPY {_REQUIREMENTS} /tmp/',
            f'RUN pip install --no-cache-dir -r /tmp/{_REQUIREMENTS}',
        ]
    if dependencies := _find_dependencies(root):
        lines += [f'RUN pip install --no-cache-dir {shlex.join(dependencies)}']
    lines += [
        '# Any user may run it: logs and caches go where all can write.',
        'ENV HOME=/tmp PYTHONUNBUFFERED=1',
        f'WORKDIR {PROJECT}',
    ]
    return '\n'.join([*lines, ''])


def _find_dependencies(root: Path) -> list[str]:
    """Return the dependencies that the project declares, but for Composer itself."""
    try:
        data = tomllib.loads(read_file(root / 'pyproject.toml').decode())
    except (UnreadableFileError, ValueError):
        return []
    project = data.get('project')
    found = project.get('dependencies') if isinstance(project, dict) else None
    names = found if isinstance(found, list) else []
    return [
        each
        for each in names
        if isinstance(each, str) and not each.startswith('rclpy-composer') and '\n' not in each
    ]
