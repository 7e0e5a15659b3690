"""The stubs of all interface packages that a system needs, as files."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package
from composer.input_limits import UnreadableFileError, read_file
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.descriptions import (
    ActionDescription,
    ConstantDescription,
    FieldType,
    ServiceDescription,
)
from composer.stubs.message_stubs import list_messages, write_interfaces, write_payloads

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from composer.interfaces.catalogue import InterfaceKind
    from composer.interfaces.declared_packages import DeclaredPackages
    from composer.interfaces.descriptions import InterfaceDescription

_KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')
# A constant's type and name; the value does not matter here.
_CONSTANT = re.compile(r'^[ \t]*(\w+)(?:<=\d+)?[ \t]+([A-Z]\w*)[ \t]*=', re.MULTILINE)
# What the classes of every service and every action refer to.
_OF_SERVICES = ('service_msgs', 'builtin_interfaces')
_OF_ACTIONS = (*_OF_SERVICES, 'action_msgs', 'unique_identifier_msgs')


def write_packages(
    packages: Iterable[str], declared: DeclaredPackages
) -> Iterator[tuple[str, list[str]]]:
    """Yield the path and the lines of each stub of packages, and of those that they use.

    Args:
        packages: Their names; those that do not exist are left out.
        declared: The packages that the system itself declares.
    """
    own = {each.package: each.interfaces for each in declared.definitions or ()}
    done: set[str] = set()
    pending = [*packages]
    while pending:
        package = pending.pop()
        if package in done:
            continue
        done.add(package)
        interfaces = own.get(package) or _describe_installed(package)
        if interfaces:
            pending += _used_packages(interfaces)
            yield from _write_package(package, interfaces)


def _write_package(
    package: str, interfaces: Mapping[str, InterfaceDescription | None]
) -> Iterator[tuple[str, list[str]]]:
    yield f'{package}/__init__.pyi', []
    for kind in _KINDS:
        of_kind = {
            name: interfaces[name] for name in interfaces if name.startswith(f'{package}/{kind}/')
        }
        if of_kind:
            lines = [*write_interfaces(f'{package}.{kind}', of_kind)]
            yield f'{package}/{kind}/__init__.pyi', lines
    messages = [
        message for each in interfaces.values() if each is not None for message in each.parts
    ]
    yield f'composer_stubs/payloads/{package}.pyi', [*write_payloads(package, messages)]


def _used_packages(interfaces: Mapping[str, InterfaceDescription | None]) -> Iterator[str]:
    for interface in interfaces.values():
        if interface is None:
            continue
        yield from {'srv': _OF_SERVICES, 'action': _OF_ACTIONS}.get(
            interface.name.split('/')[1], ()
        )
        for message in list_messages(interface):
            for field in message.fields:
                if field.type.nested is not None:
                    yield field.type.nested.partition('/')[0]


@cache
def _describe_installed(package: str) -> Mapping[str, InterfaceDescription | None]:
    """Describe an installed package; `None` stands for what nothing can describe."""
    prefix = find_package(package, ament_prefixes(), INTERFACE_INDEX)
    if prefix is None:
        return {}
    catalogue = InterfaceCatalogue([prefix])
    names = [name for kind in _KINDS for name in catalogue.names(kind, package)]
    share = prefix / 'share'
    return {name: _with_constants(catalogue.describe(name), share / name) for name in names}


def _with_constants(
    interface: InterfaceDescription | None, path: Path
) -> InterfaceDescription | None:
    """Add the constants, which only the definition file beside the type description has.

    To read its names takes a hundredth of the time of the real parser, and needs no ROS.
    """
    kind = path.parent.name
    try:
        text = read_file(path.with_suffix(f'.{kind}')).decode(errors='replace')
    except UnreadableFileError:
        return None
    if interface is None or '=' not in text:
        return interface
    sections = re.split('^---', text, flags=re.MULTILINE)
    parts = [
        replace(part, constants=tuple(_read_constants(section)))
        for part, section in zip(interface.parts, sections, strict=False)
    ]
    if isinstance(interface, ServiceDescription):
        return replace(interface, request=parts[0], response=parts[-1])
    if isinstance(interface, ActionDescription):
        goal, result, feedback = parts
        return replace(interface, goal=goal, result=result, feedback=feedback)
    return parts[0]


def _read_constants(text: str) -> Iterator[ConstantDescription]:
    for kind, name in _CONSTANT.findall(text):
        yield ConstantDescription(name, FieldType(kind), None)
