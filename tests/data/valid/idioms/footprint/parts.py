import ast
import copy
import random

from geometry_msgs.msg import Point32, Polygon, PolygonStamped


def _points(node):
    padding = node.parameters.padding
    for x, y in ast.literal_eval(node.parameters.footprint):
        yield Point32(x=x + padding * (1 if x > 0 else -1), y=y + padding * (1 if y > 0 else -1))


def footprint(node):
    return list(_points(node))


def obstacle(node):
    return {a: random.uniform(-0.5, 0.5) for a in 'xy'}


def _inside(polygon: Polygon, p) -> bool:
    inside, points = False, polygon.points
    for a, b in zip(points, [*points[1:], points[0]]):
        if (a.y > p.y) != (b.y > p.y) and p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x:
            inside = not inside
    return inside


def collide(node, point):
    return _inside(Polygon(points=footprint(node)), point)


def stamp(node, polygon):
    out = PolygonStamped(polygon=copy.deepcopy(polygon))
    out.header.stamp, out.header.frame_id = node.now().to_msg(), 'base_footprint'
    out.polygon.points.reverse()
    return out
