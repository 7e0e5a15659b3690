from __future__ import annotations

from collections import OrderedDict, UserDict, namedtuple
from dataclasses import asdict, dataclass, field
from typing import NamedTuple, TypedDict

from composer import Node
from geometry_msgs.msg import PointStamped


class Vec(TypedDict, total=False):
    x: float
    y: float
    z: float


class TwistDict(TypedDict):
    linear: Vec
    angular: Vec


@dataclass
class XYZ:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass
class Stamped:
    header: dict = field(default_factory=dict)
    point: XYZ = field(default_factory=XYZ)


class RangeTuple(NamedTuple):
    min_range: float = 0.1
    max_range: float = 4
    range: float = 1.0


Pair = namedtuple('Pair', 'position orientation')


def twist(node: Node) -> TwistDict:
    linear: Vec = {'x': 1.0}
    linear['y'] = 0
    return TwistDict(linear=linear, angular=Vec())


def point(node: Node) -> dict:
    stamped = Stamped(point=XYZ(1, 2, z=3))
    stamped.header['frame_id'] = node.parameters.frame
    stamped.header.update(stamp=node.now().to_msg())
    return asdict(stamped) | {'header': stamped.header}


def ranger(node: Node) -> OrderedDict:
    reading = RangeTuple(range=0.5)._replace(min_range=0)
    return OrderedDict(reading._asdict(), header=UserDict(frame_id=node.parameters.frame))


def on_point(node: Node, message: PointStamped) -> dict:
    pair = Pair(position=message.point, orientation={'w': 1.0})
    return {'header': message.header, 'pose': pair._asdict()}
