from __future__ import annotations

import typing
from collections.abc import Awaitable, Generator, Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, Protocol, Type, TypeVar, Union

import geometry_msgs.msg
import numpy as np
import std_msgs.msg as sm
from geometry_msgs.msg import Point, Point32, Twist as Velocity, Vector3

if typing.TYPE_CHECKING:
    from composer import Node as N
    from numpy.typing import NDArray

Message = TypeVar('Message', bound=Velocity)
Command = geometry_msgs.msg.Twist
MaybePoint = Union[Point, None]
Payload = Mapping[str, Any]


class HasLinear(Protocol):
    linear: Vector3


def aliased(node: N, message: Command) -> MaybePoint:
    return Point(x=message.linear.x) if message.linear.x else None


def protocol(node: 'N', message: HasLinear) -> bool:
    return bool(message.linear.x)


def generic(node: N, message: Message) -> Payload:
    kind: Type[Message] = type(message)
    return {'x': kind().linear.x}


def quoted(node: N, message: 'sm.Float64') -> np.bool_:
    return np.bool_(message.data > 0)


def objectish(node: N, message: object) -> Sequence[Mapping[str, float]] | None:
    value = getattr(message, 'data', None)
    return ({'x': value},) if isinstance(value, float) else None


def make(node: N) -> Annotated[Velocity, 'm/s']:
    return Velocity(linear=Vector3(x=1.0))


def numbers(node: N) -> Generator[float | np.floating | None, Any, None]:
    yield 1
    yield np.float32(2)
    yield None
    return None


def scalar(node: N) -> np.float64 | int:
    array: NDArray[np.float64] = np.ones(3)
    return array.sum()


def points(node: N) -> Iterator[Iterable[Point32]]:
    for n in range(3):
        yield [Point32(x=float(i)) for i in range(n)]
