"""Find installed ROS packages: which there are, and in which prefix.

A prefix is a folder with `share/`, `lib/` and `include/`. A sourced ROS lists its prefixes in
`AMENT_PREFIX_PATH`; wheels of ROS packages install into `sys.prefix`.
Source: https://github.com/ament/ament_cmake/blob/master/ament_cmake_core/doc/resource_index.md
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from composer.programs import shell_environment
from composer.spelling import count_edits, find_nearest

if TYPE_CHECKING:
    from collections.abc import Iterable

# Folders of a prefix with a file for each package, and for each package with interfaces.
PACKAGE_INDEX = 'share/ament_index/resource_index/packages'
INTERFACE_INDEX = 'share/ament_index/resource_index/rosidl_interfaces'
COMPONENT_INDEX = 'share/ament_index/resource_index/rclcpp_components'
# Packages whose names are close to those of others, and are meant nevertheless.
_ALIKE = frozenset(
    ('can_msgs', 'gps_msgs', 'map_msgs', 'mav_msgs', 'nav2_msgs', 'pcl_msgs', 'tf_msgs')
)
# More than that is another word.
_MOST_EDITS = 2
_REMAPS_ACTIONS = (9, 2, 8)
# The file in the prefix of a package that Composer built for a system, which installs nothing.
BUILD_MANIFEST = 'composer_build.json'


def ament_prefixes() -> list[Path]:
    """Return the prefixes in the order in which they are searched: sourced ones first.

    Those of packages that Composer built are left out: each system names its own.
    """
    entries = [*shell_environment().get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    prefixes = dict.fromkeys(Path(entry) for entry in entries if entry)
    return [each for each in prefixes if not os.path.exists(each / BUILD_MANIFEST)]


def find_package(package: str, prefixes: Iterable[Path], index: str) -> Path | None:
    """Return the first of the prefixes whose index lists a package, or `None`."""
    return next((each for each in prefixes if os.path.isfile(each / index / package)), None)


def find_path(relative: str, prefixes: Iterable[Path]) -> Path | None:
    """Return a file or folder in the first prefix that has it, or `None`."""
    candidates = (prefix / relative for prefix in prefixes)
    return next((path for path in candidates if os.path.exists(path)), None)


def find_share(package: str) -> Path | None:
    """Return the share folder of an installed package, or `None`."""
    prefix = find_package(package, ament_prefixes(), PACKAGE_INDEX)
    return prefix / 'share' / package if prefix else None


def find_source(share: Path) -> Path | None:
    """Return the folder that colcon built a package from and has linked, or `None`.

    With `--symlink-install`, `package.xml` is a link. Where a build without it has left a copy,
    the egg link of a Python package names its build folder, which has links to the source.
    """
    links = [share / 'package.xml']
    for egg_link in share.parents[1].glob('lib/python*/*-packages/*.egg-link'):
        if egg_link.stem.replace('-', '_') == share.name:
            with suppress(OSError, UnicodeDecodeError):
                build = egg_link.read_text(encoding='utf-8').partition('\n')[0]
                links.append(Path(build, 'setup.py'))
    return next((Path(os.path.realpath(link)).parent for link in links if link.is_symlink()), None)


def explain_missing_package(package: str, known: Iterable[str], otherwise: str = '') -> str:
    """Return the help for a package that is not installed: the nearest name, or how to get it.

    Args:
        known: The names that can have been meant.
        otherwise: What else can be done.
    """
    near = find_meant_package(package, known)
    if near:
        return f"did you mean '{near}'?"
    name = package.replace('_', '-')
    return (
        f'install it (apt install ros-$ROS_DISTRO-{name}, or its wheel with pip), '
        f'or source the workspace that has it{otherwise}'
    )


def find_meant_package(
    package: str, known: Iterable[str], most_edits: int = _MOST_EDITS
) -> str | None:
    """Return the package that a name is most likely a misspelling of."""
    near = None if package in _ALIKE else find_nearest(package, known)
    return near if near and count_edits(package, near) <= most_edits else None


def has_ros() -> bool:
    """Return whether ROS 2 is installed, by the package that no installation lacks for Python."""
    return find_share('rclpy') is not None


def list_packages() -> list[str]:
    """Return the names of all installed packages, sorted."""
    return sorted(locate_packages(ament_prefixes(), PACKAGE_INDEX))


def locate_packages(prefixes: Iterable[Path], index: str) -> dict[str, Path]:
    """Return the packages that the index of each prefix lists, with their first prefix."""
    located: dict[str, Path] = {}
    for prefix in prefixes:
        with suppress(OSError):
            for entry in (prefix / index).iterdir():
                located.setdefault(entry.name, prefix)
    return located


def list_executables(package: str) -> list[Path]:
    """Return the programs that a package has installed for `ros2 run`."""
    prefix = find_package(package, ament_prefixes(), PACKAGE_INDEX)
    folder = prefix / 'lib' / package if prefix else None
    if folder is None or not os.path.isdir(folder):
        return []
    return sorted(
        path for path in folder.iterdir() if os.path.isfile(path) and os.access(path, os.X_OK)
    )


def list_components(package: str) -> list[str]:
    """Return the classes that a package has for containers, as in `image_proc::RectifyNode`.

    Source: `get_component_resources` in rclcpp_components (`src/component_manager.cpp`).
    """
    prefix = find_package(package, ament_prefixes(), COMPONENT_INDEX)
    if prefix is None:
        return []
    with suppress(OSError):
        text = (prefix / COMPONENT_INDEX / package).read_text(encoding='utf-8')
        return [line.partition(';')[0] for line in text.splitlines() if line]
    return []


@cache
def has_content_filters() -> bool | None:
    """Return whether the installed rclpy filters by content, since Kilted; `None` without one."""
    spec = importlib.util.find_spec('rclpy')
    if spec is None or spec.origin is None:
        return None
    return (Path(spec.origin).parent / 'subscription_content_filter_options.py').is_file()


@cache
def remaps_actions() -> bool | None:
    """Return whether the installed ROS remaps the names of actions; `None` without ROS.

    Source: rcl_action does since 9.2.8 (https://github.com/ros2/rcl/pull/1170).
    """
    share = find_share('rcl_action')
    try:
        text = (share / 'package.xml').read_text(encoding='utf-8') if share else ''
    except OSError:
        return None
    found = re.search(r'<version>(\d+)\.(\d+)\.(\d+)</version>', text)
    return tuple(map(int, found.groups())) >= _REMAPS_ACTIONS if found else None
