"""Where in the installed ROS a package or a file is.

A prefix is a folder with `share/`, `lib/` and `include/`; `catalogue.default_prefixes` lists them.
"""

from collections.abc import Iterable
from pathlib import Path

INTERFACE_INDEX = 'share/ament_index/resource_index/rosidl_interfaces'


def find_package_prefix(package: str, prefixes: Iterable[Path]) -> Path | None:
    """Find the first prefix in which a package with interfaces is installed, or None."""
    for prefix in prefixes:
        if (prefix / INTERFACE_INDEX / package).is_file():
            return prefix
    return None


def find_path(relative: str, prefixes: Iterable[Path]) -> Path | None:
    """Find a file or folder in the first prefix that has it, or None."""
    candidates = (prefix / relative for prefix in prefixes)
    return next((path for path in candidates if path.exists()), None)
