import dataclasses
from typing import Any

from geometry_msgs.msg import Twist


@dataclasses.dataclass(order=True)
class Source:
    priority: int
    timeout: float = dataclasses.field(compare=False)
    stamp: float = dataclasses.field(compare=False, default=float('-inf'))
    last: Any = dataclasses.field(compare=False, default=None)

    def alive(self, now):
        return now - self.stamp < self.timeout


def _load(node):
    for name in node.parameters.topics:
        values = {f.name: node.parameters.get(f'topics.{name}.{f.name}') for f in dataclasses.fields(Source)[:2]}
        node.state.sources[name] = Source(**values)


def handle(node, message: Twist, source: str):
    if not node.state.sources:
        _load(node)
    now = node.now().nanoseconds / 1e9
    me = node.state.sources[source]
    me = node.state.sources[source] = dataclasses.replace(me, stamp=now, last=message)
    best = max(s for s in node.state.sources.values() if s.alive(now))
    if best is not me:
        return None
    return Twist() if node.state.locked else message


def lock(node, message):
    if message.data != node.state.locked:
        node.logger.info(('un' if node.state.locked else '') + 'locked')
    node.state.locked = message.data


def active(node):
    now = node.now().nanoseconds / 1e9
    alive = {n: s for n, s in node.state.sources.items() if s.alive(now)}
    return max(alive, key=alive.__getitem__, default='idle')
