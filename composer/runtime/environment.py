"""The environment variables of a file: set before ROS is imported, and restored at the end."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING

from composer.errors import StartError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_MIDDLEWARE = 'RMW_IMPLEMENTATION'


@contextmanager
def environment_set(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables, and restore their old values at the end."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def check_middleware(variables: Mapping[str, str]) -> None:
    """Load the middleware that the variables name, if they name one.

    Raises:
        StartError: It cannot be loaded, or this process has loaded another one before.
    """
    wanted = variables.get(_MIDDLEWARE)
    if not wanted:
        return
    from rclpy.utilities import get_rmw_implementation_identifier

    try:
        loaded = get_rmw_implementation_identifier()
    except Exception as error:
        message = f"the middleware '{wanted}' cannot be loaded: {error}"
        raise StartError(message) from error
    if loaded != wanted:
        message = f"{_MIDDLEWARE} is '{wanted}', but this process has loaded '{loaded}' before"
        raise StartError(message, help='a process has one middleware: run this system in another')
