"""Import the generated Python class of a ROS interface by its full name.

Each failure has its own message: the package, its interfaces of that kind, or the name is missing,
or the compiled type support does not load. rclpy loads type support with the first entity of the
type, and does not report why it fails; here it is loaded at once.
"""

import re
from importlib import import_module
from types import ModuleType
from typing import Any, Final, cast

from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue, InterfaceKind
from composer.spelling import did_you_mean, find_nearest, suggest

_FULL_NAME: Final = re.compile(r'([A-Za-z]\w*)/(msg|srv|action)/([A-Za-z]\w*)', re.ASCII)
_KIND_WORDS: Final[dict[InterfaceKind, str]] = {
    'msg': 'messages',
    'srv': 'services',
    'action': 'actions',
}


class InterfaceNotFoundError(ComposerError):
    """An interface does not exist, or cannot be loaded."""


def import_interface(full_name: str) -> type:
    """Import the class of a message, service or action, ready for use with rclpy.

    Args:
        full_name: such as `std_msgs/msg/String`, `std_srvs/srv/SetBool_Request` or
            `example_interfaces/action/Fibonacci`.

    Raises:
        InterfaceNotFoundError: it does not exist, or cannot be loaded.
    """
    match = _FULL_NAME.fullmatch(full_name)
    if match is None:
        raise _malformed(full_name)
    package, name = match[1], match[3]
    kind = cast('InterfaceKind', match[2])
    module = _import_kind(package, kind, full_name)
    interface = getattr(module, name, None)
    if not isinstance(interface, type):
        raise _name_missing(package, kind, full_name)
    _load_type_support(interface, full_name)
    return interface


def interface_name(interface: type) -> str:
    """Return the full name of a generated class, such as `std_msgs/msg/String`.

    A part of a service or an action has the name of its description:
    `std_srvs/srv/SetBool_Request`.
    """
    package, kind, *_ = interface.__module__.split('.')
    return f'{package}/{kind}/{interface.__name__}'


def is_message_class(interface: type) -> bool:
    """Return whether a class was generated for a message."""
    return hasattr(interface, 'get_fields_and_field_types')


def _import_kind(package: str, kind: InterfaceKind, full_name: str) -> ModuleType:
    try:
        return import_module(f'{package}.{kind}')
    except ModuleNotFoundError as error:
        if error.name == package:
            raise _package_missing(package, full_name) from None
        if error.name == f'{package}.{kind}':
            raise _kind_missing(package, kind, full_name) from None
        raise _broken(full_name, error) from error
    except Exception as error:
        raise _broken(full_name, error) from error


def _load_type_support(interface: type, full_name: str) -> None:
    metaclass: Any = type(interface)
    if not hasattr(metaclass, '__import_type_support__'):
        message = f'{full_name} is a class, but not a ROS interface'
        raise InterfaceNotFoundError(message)
    if metaclass._TYPE_SUPPORT is not None:  # noqa: SLF001
        return
    try:
        metaclass.__import_type_support__()
    except Exception as error:
        # rosidl_generator_py hides the reason behind an exception of its own.
        raise _broken(full_name, error.__context__ or error) from error


def _malformed(full_name: str) -> InterfaceNotFoundError:
    message = f'{full_name!r} is not the name of an interface'
    words = re.split(r'[/.:]+', full_name)
    package = words[0] if len(words) > 1 else ''
    catalogue = InterfaceCatalogue()
    meant = [
        name
        for kind in _KIND_WORDS
        for name in catalogue.names(kind)
        if name.startswith(package) and name.endswith(f'/{words[-1]}')
    ]
    return InterfaceNotFoundError(
        message,
        help=did_you_mean(
            meant[0] if meant else None, otherwise='write it in full: std_msgs/msg/String'
        ),
    )


def _package_missing(package: str, full_name: str) -> InterfaceNotFoundError:
    packages = InterfaceCatalogue().packages()
    if package in packages:
        message = (
            f'{full_name}: the package {package!r} is installed, but Python finds no module of it'
        )
        return InterfaceNotFoundError(
            message, help='source the setup file of its workspace, which sets PYTHONPATH'
        )
    message = f'{full_name}: the package {package!r} is not installed'
    install = "install it, or name the folder of its definitions under 'interfaces:'"
    return InterfaceNotFoundError(
        message,
        help=suggest(package, packages, otherwise=install),
    )


def _kind_missing(package: str, kind: InterfaceKind, full_name: str) -> InterfaceNotFoundError:
    message = f'{full_name}: the package {package!r} has no {_KIND_WORDS[kind]}'
    return InterfaceNotFoundError(message, help=_find_meant(package, full_name))


def _name_missing(package: str, kind: InterfaceKind, full_name: str) -> InterfaceNotFoundError:
    name = full_name.rpartition('/')[-1]
    message = f'{full_name}: {name!r} is not one of the {_KIND_WORDS[kind]} of {package!r}'
    return InterfaceNotFoundError(message, help=_find_meant(package, full_name))


def _find_meant(package: str, full_name: str) -> str | None:
    """Return help with the interface of the nearest name, of any kind, in a package."""
    catalogue = InterfaceCatalogue()
    by_name = {
        interface.rpartition('/')[-1]: interface
        for kind in _KIND_WORDS
        for interface in catalogue.names(kind, package)
    }
    nearest = find_nearest(full_name.rpartition('/')[-1], by_name)
    return did_you_mean(nearest and by_name[nearest])


def _broken(full_name: str, error: BaseException) -> InterfaceNotFoundError:
    return InterfaceNotFoundError(
        f'{full_name} is installed but cannot be loaded: {error}',
        help='its compiled type support, or a library that it needs, is missing or was built for '
        'another Python or ROS: install or build the package again',
    )
