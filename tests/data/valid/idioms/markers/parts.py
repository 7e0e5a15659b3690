import enum
import math

from geometry_msgs.msg import Point, Pose, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray


class Colour(enum.Enum):
    RED = (1, 0, 0)
    GREEN = (0, 1, 0)
    BLUE = (0, 0, 1)

    def msg(self, alpha=1.0):
        r, g, b = map(float, self.value)
        return ColorRGBA(r=r, g=g, b=b, a=alpha)


class Builder:
    def __init__(self, frame, stamp):
        self.array = MarkerArray()
        self.frame, self.stamp = frame, stamp

    def add(self, kind, **fields):
        marker = Marker(type=kind, id=len(self.array.markers), **fields)
        marker.header.frame_id, marker.header.stamp = self.frame, self.stamp
        self.array.markers.append(marker)
        return self

    def arrow(self, start, end, colour):
        return self.add(Marker.ARROW, points=[start, end], scale=Vector3(x=0.05, y=0.1), color=colour)

    def text(self, text, z=1.0):
        pose = Pose(position=Point(z=z))
        pose.orientation.w = math.cos(0)
        return self.add(Marker.TEXT_VIEW_FACING, text=text, pose=pose, scale=Vector3(z=0.2), color=Colour.RED.msg(0.5))

    def build(self):
        return self.array


def draw(node):
    builder = Builder(node.parameters.frame, node.now().to_msg())
    for i, name in enumerate(node.parameters.colours):
        builder.arrow(Point(), Point(x=float(i), y=1.0), Colour[name].msg())
    return builder.text(f'{len(builder.array.markers)}').build()


def clear(node):
    return MarkerArray(markers=[Marker(action=Marker.DELETEALL)])


def count(node, message):
    if any(m.action == m.DELETEALL for m in message.markers):
        return 0
    return len([m for m in message.markers if m.action in (Marker.ADD, Marker.MODIFY)])
