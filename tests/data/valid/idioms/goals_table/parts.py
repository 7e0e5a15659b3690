import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Task:
    action: str
    order: int

    @classmethod
    def parse(cls, text):
        action, order = text.split(':')
        return cls(action, int(order))

    def start(self, node):
        return node.send_goal(self.action, {'order': self.order})


def execute(node, goal, name):
    for i in range(goal.order):
        time.sleep(0.01)
        node.logger.debug(f'{name} {i}')
        yield list(range(i + 1))
    return list(range(goal.order))


def mission(node):
    for task in map(Task.parse, node.parameters.plan):
        goal = task.start(node)
        while True:
            try:
                goal.result(timeout=0.5)
            except TimeoutError:
                yield
            else:
                break
        node.state.done[task] = node.state.done.get(task, 0) + 1
        yield
    node.logger.info(f'{len(node.state.done)} kinds of tasks')


def progress(node, feedback):
    node.publish('progress', len(feedback.sequence))


def finished(node, result):
    total = getattr(node.state, 'total', 0)
    node.state.total = total + len(result.sequence)
