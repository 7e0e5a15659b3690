from __future__ import annotations

from collections.abc import Callable
from typing import (TYPE_CHECKING, Annotated, Any, Final, Generic, Literal, NewType, Optional, ParamSpec, Protocol, TypeVar, Union, cast, overload,
                    runtime_checkable)

if TYPE_CHECKING:
    import std_msgs.msg
    from composer import Node
    from std_srvs.srv import SetBool as SB

    Number = Union[int, float]
    Clamp = Callable[['Number', 'Number', 'Number'], 'Number']

P = ParamSpec('P')
R = TypeVar('R')
T = TypeVar('T', bound=float)
Metres = NewType('Metres', float)
MODES: Final = ('slow', 'fast')
Mode = Literal['slow', 'fast']


@runtime_checkable
class HasData(Protocol):
    data: Any


class Box(Generic[T]):
    def __init__(self, value: T) -> None:
        self.value = value

    def map(self, function: Callable[[T], T]) -> Box[T]:
        return Box(function(self.value))


def traced(function: Callable[P, R]) -> Callable[P, R]:
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        return function(*args, **kwargs)
    inner.__wrapped__ = function  # type: ignore[attr-defined]
    return inner


@overload
def _clamp(value: int, limit: int) -> int: ...
@overload
def _clamp(value: float, limit: float) -> float: ...
def _clamp(value, limit):
    return max(-limit, min(limit, value))


def value(node: Node) -> Annotated[Optional[float], 'metres']:
    step = cast('int', node.own_state.setdefault('step', 0))
    node.own_state['step'] += 1
    return Metres(step) if step else None


@traced
def limit(node: Node, message: std_msgs.msg.Float64) -> float:
    assert isinstance(message, HasData)
    return Box(message.data).map(lambda v: _clamp(v, node.parameters.limit)).value


def text(node: Node, mode: Mode = 'fast') -> str:
    names: list[str] = node.parameters.names  # type: ignore
    reveal: dict[Mode, int] = {m: i for i, m in enumerate(MODES)}
    return ''.join(names[: reveal[mode] + 1])


def flag(node: Node, request: SB.Request) -> 'SB.Response | dict[str, Any]':
    return {'success': request.data, 'message': str(request.data).lower()}


def ask(node: Node) -> None:
    response: SB.Response = node.call('flag', {'data': True})
    if not response.success:
        raise AssertionError(response.message)
