from __future__ import annotations

import abc
import math
from typing import ClassVar, Protocol

from geometry_msgs.msg import Pose2D, Twist
from rcl_interfaces.msg import SetParametersResult


class Controller(abc.ABC):
    registry: ClassVar[dict[str, type[Controller]]] = {}

    def __init_subclass__(cls, name: str, **kwargs):
        super().__init_subclass__(**kwargs)
        cls.registry[name] = cls

    def __init__(self, node) -> None:
        self.node = node

    @property
    def parameters(self):
        return self.node.parameters

    @abc.abstractmethod
    def steer(self, x: float, y: float, theta: float) -> float: ...

    def command(self, pose: Pose2D) -> Twist:
        twist = Twist()
        twist.linear.x = 0.5
        twist.angular.z = self.steer(pose.x, pose.y, pose.theta)
        return twist


class PurePursuit(Controller, name='pure_pursuit'):
    def steer(self, x, y, theta):
        ahead = self.parameters.lookahead
        alpha = math.atan2(-y, ahead) - theta
        return 2 * 0.5 * math.sin(alpha) / math.hypot(y, ahead)


class Stanley(Controller, name='stanley'):
    def steer(self, x, y, theta):
        delta = -theta + math.atan2(-self.parameters.k * y, 0.5)
        return 0.5 * math.tan(max(-1.0, min(1.0, delta))) / self.parameters.wheelbase


def _controller(node) -> Controller:
    wanted = node.parameters.controller
    current = getattr(node.state, 'controller', None)
    cls = Controller.registry[wanted]
    if type(current) is not cls:
        node.state.controller = current = cls(node)
    return current


def control(node, pose):
    return _controller(node).command(pose)


def actuate(node, cmd):
    node.state.cmd = cmd


def simulate(node):
    pose = vars(node.state).setdefault('pose', Pose2D(y=0.5))
    cmd = getattr(node.state, 'cmd', None) or Twist()
    pose.theta += cmd.angular.z * 0.05
    pose.x += cmd.linear.x * math.cos(pose.theta) * 0.05
    pose.y += cmd.linear.x * math.sin(pose.theta) * 0.05
    return pose


def select(node, request):
    names = [p.value.string_value for p in request.parameters if p.name == 'controller']
    known = [n for n in names if n in Controller.registry]
    for name in known:
        node.set_parameters(node.name, {'controller': name})
    return [SetParametersResult(successful=n in known, reason='' if n in known else f'unknown {n}') for n in names]


def switch(node):
    for name in ('stanley', 'nonsense', 'pure_pursuit'):
        value = {'name': 'controller', 'value': {'type': 4, 'string_value': name}}
        for result in node.call('/vehicle/select', [value]).results:
            node.logger.info(f'{name}: {result.successful} {result.reason}')
        yield
