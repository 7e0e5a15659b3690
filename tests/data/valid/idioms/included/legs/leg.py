from math import sin

from .common import now


def step(node):
    return max(0.0, sin(5 * now(node) + node.parameters.phase))
