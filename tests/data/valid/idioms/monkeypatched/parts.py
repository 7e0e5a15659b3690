import math

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist, Vector3

Vector3.norm = property(lambda self: math.sqrt(self.x ** 2 + self.y ** 2 + self.z ** 2))
Vector3.__add__ = lambda a, b: Vector3(x=a.x + b.x, y=a.y + b.y, z=a.z + b.z)
Vector3.__iter__ = lambda self: iter((self.x, self.y, self.z))
Vector3.of = classmethod(lambda cls, *xyz: cls(**dict(zip('xyz', map(float, xyz)))))
setattr(Time, 'seconds', property(lambda self: self.sec + self.nanosec * 1e-9))


def twist(node):
    return Twist(linear=Vector3.of(1, 2, 2))


def norm(node, message):
    node.state.seen = node.state.seen + message.linear if hasattr(node.state, 'seen') else message.linear
    return message.linear.norm


def total(node):
    seen = getattr(node.state, 'seen', Vector3())
    x, y, *rest = seen
    node.state.flat = (x, y, *rest)
    return seen + Vector3.of(*rest)


def stamp(node):
    return node.now().to_msg().seconds
