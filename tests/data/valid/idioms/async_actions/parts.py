import collections

from composer import GoalRejectedError


async def check(node, goal):
    return None if goal.order < 50 else 'too many'


async def count(node, goal):
    sequence = collections.deque([0])
    while len(sequence) < goal.order:
        response = await node.call_async('increment', {'int32_value': sequence[-1]})
        sequence.append(response.int32_value)
        yield list(sequence)
    yield {'sequence': tuple(sequence)}


async def double(node, goal):
    return [2 * n for n in range(goal.order)]


def increment(node, request):
    return dict(int32_value=request.int32_value + 1)


def run(node):
    for name, order in {'count': 4, 'double': 3}.items():
        goal = node.send_goal(name, {'order': order})
        partial = [len(f.sequence) for f in goal.feedback]
        result = goal.result(timeout=3.0)
        node.logger.info(f'{name}: {partial} {result.sequence.tolist()} {goal.status}')
        yield
    try:
        node.send_goal('count', {'order': 99})
    except GoalRejectedError:
        node.state.rejected = True
    yield
    node.logger.info(f'{node.state.rejected} {node.state.sequences}')


async def keep(node, result):
    node.state.sequences += [list(result.sequence)]


def show(node, feedback):
    node.logger.info(f'{feedback.sequence}')
