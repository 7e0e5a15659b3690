"""Methods of rclpy that behaviours may not call, because they would end parts of the system.

A behaviour can reach the rclpy node, its executor and its context. Each has methods that end what
other nodes need, or what only the system itself may end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Callable

_HELP = 'to end the system call node.shutdown()'


class ReservedMethodError(ComposerError):
    """A behaviour calls a method that only the system may call."""


def reserve(thing: Any, name: str, *methods: str) -> None:
    """Let methods of an object raise `ReservedMethodError` until `release`.

    Args:
        name: The object in words, as in `the node`.
    """
    for method in methods:
        setattr(thing, method, _refusal(name, method))


def release(thing: Any) -> None:
    """Give an object its own methods back."""
    for method, value in list(vars(thing).items()):
        if getattr(value, 'is_refusal', False):
            delattr(thing, method)


def _refusal(name: str, method: str) -> Callable[..., NoReturn]:
    def refuse(*_arguments: Any, **_options: Any) -> NoReturn:
        message = f'{name} belongs to the system, so a behaviour cannot call {method}()'
        raise ReservedMethodError(message, help=_HELP)

    refuse.is_refusal = True  # type: ignore[attr-defined]
    return refuse
