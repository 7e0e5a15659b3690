"""Behaviours that the invalid files name."""

DEPTH = 10


def tick(node):
    return None


def steer(node, speed=1.0, *, heading):
    return None


def hear(node, message):
    return message


def count(node):
    yield 1


def count_messages(node, message):
    yield message


def decide(node, changes):
    return None
