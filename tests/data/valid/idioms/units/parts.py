import enum
import math
from decimal import Decimal
from fractions import Fraction

from geometry_msgs.msg import Twist
from sensor_msgs.msg import Range


class Unit(float, enum.Enum):
    KMH = 1 / 3.6
    DEG = math.pi / 180

    def __rmatmul__(self, value):
        return float(value) * self.value


class Metres(float):
    def __new__(cls, value, factor=1):
        return super().__new__(cls, value * factor)

    @property
    def millimetres(self):
        return int(self * 1000)


class Kind(enum.IntEnum):
    SONAR = Range.ULTRASOUND
    LASER = Range.INFRARED


def twist(node):
    cmd = Twist()
    cmd.linear.x = node.parameters.speed_kmh @ Unit.KMH
    cmd.angular.z = node.parameters.angle_deg @ Unit.DEG
    cmd.linear.y = Metres(5, factor=0.001)
    return cmd


def to_kmh(node, cmd):
    return float(Fraction(cmd.linear.x).limit_denominator(1000) * Fraction(36, 10)) + float(Decimal('0.0'))


def ranger(node):
    msg = Range(radiation_type=Kind.LASER, max_range=Metres(4), min_range=float(Decimal('0.05')))
    msg.field_of_view = float.fromhex('0x1.8p+0')
    msg.range = [msg.min_range, msg.max_range][round(node.now().nanoseconds / 1e9) % 2]
    return msg


def vector(node):
    z = 3 + 4j
    return {'x': z.real, 'y': abs(z), 'z': Metres(2).millimetres}
