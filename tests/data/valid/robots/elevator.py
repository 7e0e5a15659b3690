from __future__ import annotations

import enum
from collections import deque


class Door(enum.Enum):
    OPEN = enum.auto()
    SHUT = enum.auto()


class Elevator:
    def __init__(self, node):
        self.calls: deque[int] = deque()
        self.at = 0
        self.door = Door.OPEN
        self.is_stopped = False
        self.since = node.now()

    def call(self, node, message):
        if not 0 <= message.data < node.parameters.floors:
            node.logger.warning(f'there is no floor {message.data}')
            return
        if message.data not in self.calls:
            self.calls.append(message.data)

    def stop(self, node, request):
        self.is_stopped = request.data
        if request.data:
            self.calls.clear()
        return {'success': True, 'message': f'at floor {self.at}'}

    def move(self, node):
        if self.is_stopped or not self.calls:
            return
        waited = (node.now() - self.since).nanoseconds / 1e9
        if waited < node.parameters.seconds_per_floor:
            return
        self.since = node.now()
        target = self.calls[0]
        if target == self.at:
            self.calls.popleft()
            self.turn(node, Door.OPEN)
            return
        self.turn(node, Door.SHUT)
        self.at += 1 if target > self.at else -1
        node.publish('floor', self.at)

    def turn(self, node, door: Door):
        if self.door is not door:
            self.door = door
            node.publish('door', door.name.lower())
