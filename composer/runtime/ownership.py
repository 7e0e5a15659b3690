"""What belongs to the whole system is not ended by a behaviour of one node.

A behaviour reaches the rclpy node, its executor and its context; each has methods that would end
what others need, or what the system itself ends when it stops.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from composer.errors import ComposerError

if TYPE_CHECKING:
    from collections.abc import Callable

_HELP = 'to end the system call node.shutdown()'


class NotYoursError(ComposerError):
    """A behaviour ends something that belongs to the whole system."""


def reserve(thing: Any, name: str, *methods: str) -> None:
    """Have methods of an object refused until `release`.

    Args:
        name: What it is, in words, as in `the node`.
    """
    for method in methods:
        setattr(thing, method, _refusal(name, method))


def release(thing: Any) -> None:
    """Let the methods do again what their class says."""
    for method, value in list(vars(thing).items()):
        if getattr(value, 'is_refusal', False):
            delattr(thing, method)


def _refusal(name: str, method: str) -> Callable[..., NoReturn]:
    def refuse(*_arguments: Any, **_options: Any) -> NoReturn:
        message = f'{name} belongs to the system, so a behaviour cannot call {method}()'
        raise NotYoursError(message, help=_HELP)

    refuse.is_refusal = True  # type: ignore[attr-defined]
    return refuse
