import itertools
import queue
import random
from contextlib import suppress


def setup(node):
    node.state.queue = queue.PriorityQueue(maxsize=node.parameters.capacity)
    node.state.order = itertools.count()


def make(node):
    return f'{random.choice("abc")}:{random.random():.2f}'


def enqueue(node, message):
    name, _, priority = message.data.partition(':')
    q = node.state.queue
    try:
        q.put_nowait((float(priority), next(node.state.order), name))
    except queue.Full:
        return None
    return q.qsize()


def work(node):
    with suppress(queue.Empty):
        *_, name = node.state.queue.get_nowait()
        return name
