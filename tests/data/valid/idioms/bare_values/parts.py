from geometry_msgs.msg import Point32
from sensor_msgs.msg import JoyFeedback
from visualization_msgs.msg import Marker


def markers(node):
    return [Marker(id=0, type=Marker.CUBE), {'id': 1, 'scale': {'x': 1}}]


def polygon(node):
    return tuple(Point32(x=float(x), y=float(y)) for x, y in ((0, 0), (2, 0), (2, 1), (0, 1)))


def area(node, message):
    points = message.points
    return 0.5 * abs(sum(a.x * b.y - b.x * a.y for a, b in zip(points, points[1:] + points[:1])))


def feedback(node):
    return {'array': (JoyFeedback(id=i, intensity=i / 4) for i in ())} if False else [JoyFeedback(id=i, intensity=i / 4) for i in range(4)]


def clock(node):
    return node.now().to_msg()


def empty(node):
    return {}


def on_empty(node, message):
    node.state.beats = getattr(node.state, 'beats', 0) + 1


def flag(node, request):
    return {'success': not request.data}


def stop(node, request):
    return None


def calls(node):
    node.call('flag', True)
    node.call('stop', {})
