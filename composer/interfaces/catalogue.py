"""Find ROS interfaces and describe them, without importing any of them.

The ament resource index lists the interfaces of each package, and type descriptions beside the
definition files describe them. Both are plain files: to read them takes no rclpy and runs no code.
"""

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Final, Literal, TypeAlias, cast

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package, locate_packages
from composer.input_limits import UnreadableFileError, read_file
from composer.interfaces.descriptions import (
    ActionDescription,
    ConstantDescription,
    FieldType,
    InterfaceDescription,
    ServiceDescription,
)
from composer.interfaces.type_descriptions import TypeDescriptionError, parse_type_description

InterfaceKind: TypeAlias = Literal['msg', 'srv', 'action']

# A line such as `uint8 OK = 0`.
_CONSTANT: Final = re.compile(
    r'^[ \t]*(\w+)(?:<=\d+)?[ \t]+([A-Z][A-Z0-9_]*)[ \t]*=', re.MULTILINE
)
# 'package/kind/Name'
_NAME_PARTS: Final = 3


class InterfaceCatalogue:
    """The installed interfaces, and those added by `add`.

    Each file is read once, when it is first needed. If a package is in several prefixes, the first
    one counts, as for ROS itself; added descriptions count before installed ones.
    """

    def __init__(self, prefixes: Sequence[Path] | None = None) -> None:
        """Look for interfaces in these prefixes, by default in those of `ament_prefixes`."""
        self._prefixes = ament_prefixes() if prefixes is None else list(prefixes)
        self._added: dict[str, InterfaceDescription] = {}
        self._descriptions: dict[str, InterfaceDescription | None] = {}
        self._packages: dict[str, Path] | None = None
        self._defined: set[str] = set()
        self._entries: dict[tuple[str, InterfaceKind], frozenset[str]] = {}

    @property
    def available(self) -> bool:
        """Whether any interface package is known: without one, missing types are no errors."""
        return bool(self._added) or bool(self._installed())

    def add(self, description: InterfaceDescription) -> None:
        """Add an interface, or replace an installed one."""
        self._added[description.name] = description

    def packages(self) -> list[str]:
        """Return the names of the packages with interfaces, sorted."""
        return sorted({*self._installed(), *(name.split('/')[0] for name in self._added)})

    def names(self, kind: InterfaceKind, package: str | None = None) -> list[str]:
        """Return the full names of the interfaces of a kind, of one package or of all, sorted."""
        packages = self._installed() if package is None else [package]
        found = {name for each in packages for name in self._indexed(each, kind)}
        for name in self._added:
            owner, added_kind, _ = name.split('/')
            if added_kind == kind and package in {None, owner}:
                found.add(name)
        return sorted(found)

    def has(self, full_name: str) -> bool:
        """Return whether an interface exists, by its full name: `std_msgs/msg/String`."""
        if full_name in self._added:
            return True
        package, kind, _ = full_name.split('/')
        return full_name in self._indexed(package, cast('InterfaceKind', kind))

    def describe(self, full_name: str) -> InterfaceDescription | None:
        """Describe an interface, such as `std_msgs/msg/String`.

        Returns:
            None if there is no such interface, or no description that can be read: packages built
            before ROS 2 Iron, or without `rosidl_generator_type_description`, have none, and types
            that only IDL can express have no description. `has` tells the two cases apart.
        """
        if full_name in self._added:
            return self._added[full_name]
        if full_name not in self._descriptions:
            self._descriptions[full_name] = self._load(full_name)
        return self._descriptions[full_name]

    def knows_constants(self, full_name: str) -> bool:
        """Return whether the description of an interface has its constants, or there are none.

        Type descriptions lack them: the definition file beside one has their names.
        """
        return self.describe(full_name) is not None and full_name in self._defined

    def _load(self, full_name: str) -> InterfaceDescription | None:
        parts = full_name.split('/')
        if len(parts) != _NAME_PARTS or parts[1] not in {'msg', 'srv', 'action'}:
            return None
        prefix = self._prefix_of(parts[0])
        if prefix is None:
            return None
        path = prefix.joinpath('share', *parts[:2], f'{parts[2]}.json')
        try:
            description = parse_type_description(json.loads(read_file(path)))
        except (UnreadableFileError, ValueError, RecursionError, TypeDescriptionError):
            return None
        with suppress(UnreadableFileError):
            text = read_file(path.with_suffix(f'.{parts[1]}')).decode(errors='replace')
            self._defined.add(full_name)
            return _with_constants(description, text)
        return description

    def _prefix_of(self, package: str) -> Path | None:
        if self._packages is not None:
            return self._packages.get(package)
        return find_package(package, self._prefixes, INTERFACE_INDEX)

    def _installed(self) -> dict[str, Path]:
        if self._packages is None:
            self._packages = locate_packages(self._prefixes, INTERFACE_INDEX)
        return self._packages

    def _indexed(self, package: str, kind: InterfaceKind) -> frozenset[str]:
        if (package, kind) not in self._entries:
            self._entries[package, kind] = frozenset(self._read_index(package, kind))
        return self._entries[package, kind]

    def _read_index(self, package: str, kind: InterfaceKind) -> Iterator[str]:
        prefix = self._prefix_of(package)
        if prefix is None:
            return
        for line in read_file(prefix / INTERFACE_INDEX / package).splitlines():
            entry = PurePosixPath(line.decode(errors='replace'))
            if entry.parent.name == kind and entry.suffix in {'.idl', f'.{kind}'}:
                yield f'{package}/{kind}/{entry.stem}'


def _with_constants(interface: InterfaceDescription, text: str) -> InterfaceDescription:
    """Add the constants of a definition file; their values do not matter.

    To read the names takes a hundredth of the time of the real parser, and needs no ROS.
    """
    if '=' not in text:
        return interface
    parts = [
        replace(
            part,
            constants=tuple(
                ConstantDescription(name, FieldType(kind), None)
                for kind, name in _CONSTANT.findall(section)
            ),
        )
        for part, section in zip(interface.parts, re.split('(?m)^---', text), strict=False)
    ]
    if isinstance(interface, ServiceDescription):
        return replace(interface, request=parts[0], response=parts[-1])
    if isinstance(interface, ActionDescription):
        goal, result, feedback = parts
        return replace(interface, goal=goal, result=result, feedback=feedback)
    return parts[0]
