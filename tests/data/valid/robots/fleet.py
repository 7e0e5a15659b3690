import heapq
import itertools
from typing import NamedTuple

ORDERS = itertools.count()


class Order(NamedTuple):
    priority: int
    number: int
    text: str


def queue_of(node):
    if not hasattr(node.state, 'queue'):
        node.state.queue = []
        node.state.busy = {}
    return node.state.queue


def order(node, message):
    text, _, priority = message.data.partition('#')
    heapq.heappush(queue_of(node), Order(int(priority or 9), next(ORDERS), text.strip()))


def assign(node):
    waiting = queue_of(node)
    free = [name for name in node.parameters.robots if name not in node.state.busy]
    while waiting and free:
        robot, job = free.pop(), heapq.heappop(waiting)
        node.state.busy[robot] = job
        node.publish('assignments', {'key': robot, 'value': job.text})


def done(node, message):
    job = node.state.busy.pop(message.data, None)
    if job is None:
        node.logger.warning(f'{message.data} had no job')
    elif job.priority < node.parameters.retry:
        node.logger.info(f'urgent job {job.number} is done')


def pending(node, request):
    names = [each.text for each in queue_of(node)]
    return {'success': not names, 'message': ', '.join(names)}


def accept(node, message):
    if message.key == node.name:
        node.state.job = message.value


def work(node):
    if node.state.job is None:
        return
    node.logger.info(f'{node.state.job} at {node.parameters.speed} m/s')
    node.state.job = None
    node.publish('done', node.name)
