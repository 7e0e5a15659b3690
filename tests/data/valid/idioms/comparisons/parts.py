import copy
import math
import random
from bisect import insort
from functools import cmp_to_key, total_ordering

from geometry_msgs.msg import Point, Pose, Quaternion

ORIGIN = Pose()


def wander(node):
    pose = copy.copy(ORIGIN)
    pose = copy.deepcopy(pose)
    pose.position.x += random.choice((-1.0, 0.0, 1.0))
    pose.position.y += random.gauss(0, 1)
    assert ORIGIN == Pose() and ORIGIN.position != pose.position
    return pose


def _distance(pose):
    return math.hypot(pose.position.x, pose.position.y)


@total_ordering
class Scored:
    def __init__(self, pose):
        self.pose, self.score = pose, _distance(pose)

    def __eq__(self, other):
        return self.score == other.score

    def __lt__(self, other):
        return self.score < other.score


def keep_best(node, pose):
    ranking = vars(node.state).setdefault('ranking', [])
    insort(ranking, Scored(pose))
    del ranking[node.parameters.count:]
    best, *_ = ranking
    return best.pose if best.pose == pose else None


def changed(node, pose):
    before, node.own_state['before'] = node.own_state.get('before'), pose
    return before is None or before.position != pose.position or pose.orientation == Quaternion()


def prune(node):
    ranking = getattr(node.state, 'ranking', [])
    ranking.sort(key=cmp_to_key(lambda a, b: (a > b) - (a < b)))
    unique = {(p.x, p.y, p.z): p for p in (s.pose.position for s in ranking)}
    assert all(isinstance(p, Point) for p in unique.values())
    node.state.span = max(unique, default=(0.0,) * 3)
