"""Own classes that are called as messages are."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import geometry_msgs.msg as g


@dataclass
class Point:
    x: float
    y: float
    label: str = ''

    def scaled(self, factor):
        return Point(self.x * factor, self.y * factor, self.label)

    def message(self):
        return g.Point(x=self.x, y=self.y)


class String(Mapping):
    def __init__(self, text):
        self.text = text

    def __getitem__(self, key):
        return {'data': self.text}[key]

    def __iter__(self):
        return iter(('data',))

    def __len__(self):
        return 1


def make(node):
    point = Point(1.0, 2.0, label='start')
    point.label += '!'
    return point.scaled(node.parameters.scale).message()


def on_point(node, message):
    point = Point(message.x, message.y)
    point.label = 'received'
    node.state.point = point
    message = point.message()
    message.z = 1.0
    return message


def text(node):
    point = getattr(node.state, 'point', None)
    return String(point.label) if point else String('none')
