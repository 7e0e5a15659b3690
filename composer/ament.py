"""Which ROS packages are installed, and where: the prefixes of ament.

A prefix is a folder with `share/`, `lib/` and `include/`. A sourced ROS names its own in
`AMENT_PREFIX_PATH`; wheels of ROS lie in the prefix of Python.
Source: https://github.com/ament/ament_cmake/blob/master/ament_cmake_core/doc/resource_index.md
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

_PACKAGE_INDEX = Path('share/ament_index/resource_index/packages')


def ament_prefixes() -> list[Path]:
    """Return the prefixes, in the order in which they are searched."""
    sourced = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    return list(dict.fromkeys([*(Path(entry) for entry in sourced if entry), Path(sys.prefix)]))


def find_package(package: str) -> Path | None:
    """Return the prefix that a package is installed in, or `None`."""
    for prefix in ament_prefixes():
        if (prefix / _PACKAGE_INDEX / package).is_file():
            return prefix
    return None


def find_share(package: str) -> Path | None:
    """Return the share folder of a package, or `None`."""
    prefix = find_package(package)
    return prefix / 'share' / package if prefix else None


def list_packages() -> list[str]:
    """Return the names of all installed packages."""
    names: set[str] = set()
    for prefix in ament_prefixes():
        index = prefix / _PACKAGE_INDEX
        if index.is_dir():
            names |= {entry.name for entry in index.iterdir()}
    return sorted(names)


def list_executables(package: str) -> list[Path]:
    """Return the programs that a package has installed for `ros2 run`."""
    prefix = find_package(package)
    folder = prefix / 'lib' / package if prefix else None
    if folder is None or not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if path.is_file() and os.access(path, os.X_OK))
