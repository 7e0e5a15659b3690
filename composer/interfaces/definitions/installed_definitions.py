"""Describe installed interfaces in full: with the constants and comments of their definitions.

An `InterfaceCatalogue` reads type descriptions, which have neither; the definition files beside
them have both.
"""

from collections.abc import Sequence
from pathlib import Path

from composer.ament import INTERFACE_INDEX, find_package
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.package_folder import load_definitions
from composer.interfaces.descriptions import InterfaceDescription


def describe_interface(full_name: str, prefixes: Sequence[Path]) -> InterfaceDescription | None:
    """Describe one interface; None if there is none of that name.

    Args:
        full_name: such as `std_msgs/msg/Header`.
        prefixes: where to look for its package.

    Raises:
        ParserMissingError: `rosidl_adapter` is not installed.
    """
    package = full_name.partition('/')[0]
    prefix = find_package(package, prefixes, INTERFACE_INDEX)
    return None if prefix is None else describe_package(package, prefix).get(full_name)


def describe_package(package: str, prefix: Path) -> dict[str, InterfaceDescription]:
    """Describe all interfaces of a package; those without a definition by type descriptions.

    Args:
        package: its name.
        prefix: where it is installed.

    Raises:
        ParserMissingError: `rosidl_adapter` is not installed.
    """
    described = dict(load_definitions(package, prefix / 'share' / package).interfaces)
    catalogue = InterfaceCatalogue([prefix])
    for name in (
        *catalogue.names('msg', package),
        *catalogue.names('srv', package),
        *catalogue.names('action', package),
    ):
        if name not in described and (description := catalogue.describe(name)):
            described[name] = description
    return described
