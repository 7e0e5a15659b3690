"""Which ROS interfaces there are, and what they consist of, without importing any of them.

The ament resource index lists each package's interfaces, and type descriptions beside the
definition files say what is in them. Both are plain files, so this works without rclpy, costs a
few file reads, and cannot run anyone's code.
"""

import json
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import Any, Final, Literal, TypeAlias, cast

from composer.interfaces.descriptions import InterfaceDescription
from composer.interfaces.type_descriptions import (
    TypeDescriptionError,
    find_type_hash,
    parse_type_description,
)

InterfaceKind: TypeAlias = Literal['msg', 'srv', 'action']

_INDEX: Final = 'share/ament_index/resource_index/rosidl_interfaces'
# 'package/kind/Name'
_NAME_PARTS: Final = 3


def default_prefixes() -> list[Path]:
    """Get the folders that ROS packages are installed in: sourced ones first, then Python's own.

    The wheels of ROS packages install into `sys.prefix` and set no `AMENT_PREFIX_PATH`.
    """
    sourced = os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)
    return [*(Path(prefix) for prefix in sourced if prefix), Path(sys.prefix)]


class InterfaceCatalogue:
    """The interfaces that are installed, and those added by hand.

    Files are read when they are first asked for, and once. Where a package is in several prefixes
    the first counts, as for ROS itself; added descriptions count before all.
    """

    def __init__(self, prefixes: Sequence[Path] | None = None) -> None:
        """Look for interfaces in these prefixes, or in the default ones."""
        self._prefixes = default_prefixes() if prefixes is None else list(prefixes)
        self._added: dict[str, InterfaceDescription] = {}
        self._documents: dict[str, dict[str, Any] | None] = {}
        self._descriptions: dict[str, InterfaceDescription | None] = {}
        self._packages: dict[str, Path] | None = None
        self._entries: dict[tuple[str, InterfaceKind], frozenset[str]] = {}

    @property
    def available(self) -> bool:
        """Whether there is any interface package, so that a missing type means something."""
        return bool(self._added) or bool(self._installed())

    def add(self, description: InterfaceDescription) -> None:
        """Add an interface that is not installed, or put another in an installed one's place."""
        self._added[description.name] = description

    def packages(self) -> list[str]:
        """List the packages that have interfaces, in order of their names."""
        return sorted({*self._installed(), *(name.split('/')[0] for name in self._added)})

    def names(self, kind: InterfaceKind, package: str | None = None) -> list[str]:
        """List the full names of the interfaces of a kind, of one package or of all."""
        packages = self._installed() if package is None else [package]
        found = {name for each in packages for name in self._indexed(each, kind)}
        for name in self._added:
            owner, added_kind, _ = name.split('/')
            if added_kind == kind and package in {None, owner}:
                found.add(name)
        return sorted(found)

    def has(self, full_name: str) -> bool:
        """Whether there is an interface of this name, `std_msgs/msg/String` say."""
        package, kind, _ = full_name.split('/')
        return full_name in self._added or full_name in self._indexed(
            package, cast('InterfaceKind', kind)
        )

    def describe(self, full_name: str) -> InterfaceDescription | None:
        """Describe an interface, such as `std_msgs/msg/String`.

        Returns:
            None where there is no such interface, or no readable description of it: packages
            built before ROS 2 Iron, or without `rosidl_generator_type_description`, carry none,
            and types that only IDL can express have no place in a description. `names` tells
            these cases apart.
        """
        if full_name in self._added:
            return self._added[full_name]
        if full_name not in self._descriptions:
            self._descriptions[full_name] = self._read(full_name)
        return self._descriptions[full_name]

    def type_hash(self, full_name: str) -> str | None:
        """Get the hash by which peers know that they mean the same type (`RIHS01_…`).

        Returns:
            None where the interface has no installed description, or was added by hand.
        """
        document = None if full_name in self._added else self._document(full_name)
        if document is None:
            return None
        try:
            return find_type_hash(document)
        except TypeDescriptionError:
            return None

    def _read(self, full_name: str) -> InterfaceDescription | None:
        document = self._document(full_name)
        if document is None:
            return None
        try:
            return parse_type_description(document)
        except TypeDescriptionError:
            return None

    def _document(self, full_name: str) -> dict[str, Any] | None:
        if full_name not in self._documents:
            self._documents[full_name] = self._load(full_name)
        return self._documents[full_name]

    def _load(self, full_name: str) -> dict[str, Any] | None:
        parts = full_name.split('/')
        if len(parts) != _NAME_PARTS or parts[1] not in {'msg', 'srv', 'action'}:
            return None
        prefix = self._prefix_of(parts[0])
        if prefix is None:
            return None
        path = prefix.joinpath('share', *parts[:2], f'{parts[2]}.json')
        try:
            document = json.loads(path.read_bytes())
        except (OSError, ValueError):
            return None
        return document if isinstance(document, dict) else None

    def _prefix_of(self, package: str) -> Path | None:
        if self._packages is not None:
            return self._packages.get(package)
        candidates = (each for each in self._prefixes if (each / _INDEX / package).is_file())
        return next(candidates, None)

    def _installed(self) -> dict[str, Path]:
        if self._packages is None:
            self._packages = {}
            for prefix in reversed(self._prefixes):
                self._packages.update(dict.fromkeys(_list_names(prefix / _INDEX), prefix))
        return self._packages

    def _indexed(self, package: str, kind: InterfaceKind) -> frozenset[str]:
        if (package, kind) not in self._entries:
            self._entries[package, kind] = frozenset(self._read_index(package, kind))
        return self._entries[package, kind]

    def _read_index(self, package: str, kind: InterfaceKind) -> Iterator[str]:
        prefix = self._prefix_of(package)
        if prefix is None:
            return
        for line in (prefix / _INDEX / package).read_text(encoding='utf-8').splitlines():
            entry = PurePosixPath(line)
            if entry.parent.name == kind and entry.suffix in {'.idl', f'.{kind}'}:
                yield f'{package}/{kind}/{entry.stem}'


def _list_names(folder: Path) -> list[str]:
    try:
        return [path.name for path in folder.iterdir()]
    except OSError:
        return []
