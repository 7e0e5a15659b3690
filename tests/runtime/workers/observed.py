"""Systems in workers, and what their processes are."""

from tests.running import is_there, wait_for

# Each behaviour tells the process that it runs in.
CODE = """
    import os
    import time

    from composer import Node

    def begin(node):
        print(f'{node.name} begins in {os.getpid()}', flush=True)

    def end(node):
        print(f'{node.name} ends in {os.getpid()}', flush=True)

    def fail(node):
        raise ValueError('no camera')

    def fail_when_told(node):
        while not os.path.exists('fail'):
            time.sleep(0.01)
        fail(node)

    def count(node):
        node.state.count += 1
        return {'data': f'{node.state.count} of {os.getpid()}'}

    def hear(node, message):
        print(f'{node.name} hears {message.data} in {os.getpid()}', flush=True)

    def serve(node, request):
        return None

    def end_system(node):
        node.shutdown(3)
"""


def node(worker, *parts):
    """Return a node of a file, in flow style."""
    hooks = 'on_start: {behaviour: parts:begin}, on_stop: {behaviour: parts:end}'
    place = f'worker: {worker}, ' if worker else ''
    return '{' + ', '.join([f'{place}{hooks}', *parts]) + '}'


TALKS = (
    'state: {count: 0}',
    'publishers: {out: {type: std_msgs/msg/String, topic: numbers}}',
    'timers: {tick: {period: 0.05, behaviour: parts:count, publish: out}}',
)
HEARS = (
    'subscriptions: {numbers: {type: std_msgs/msg/String, topic: numbers, behaviour: parts:hear}}',
)


def system(nodes, more=''):
    """Return a file of nodes in flow style, by name."""
    lines = ''.join(f'  {name}: {text}\n' for name, text in nodes.items())
    return f'version: 1\n{more}nodes:\n{lines}'


def pid_of(child, name, *, times=1):
    """Return the process in which a node has begun."""
    return int(child.wait_for_line(f'{name} begins in', times=times).split()[-1])


def wait_until_gone(pids):
    """Wait until none of these processes runs."""
    wait_for(lambda: not any(map(is_there, pids)), f'the end of {pids}')
