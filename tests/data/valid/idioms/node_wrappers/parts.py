import functools


class Memo:
    """A logger that logs each text once."""

    def __init__(self, logger):
        self._logger, self._seen = logger, set()

    def __getattr__(self, level):
        method = getattr(self._logger, level)

        def log(text, *args, **options):
            text = text % args if args else text
            if text not in self._seen:
                self._seen.add(text)
                method(text, **options)
        return log


class Wrapper:
    """Everything of the node, and the methods of rclpy by their names."""

    def __init__(self, node):
        self._node = node

    def __getattr__(self, name):
        return getattr(self._node, name)

    @functools.cached_property
    def log(self):
        return Memo(self._node.logger)

    def get_logger(self):
        return self.log

    def get_parameter(self, name):
        return self._node.ros.get_parameter(name)

    def declare_state(self, **values):
        for name, value in values.items():
            if not hasattr(self.state, name):
                setattr(self.state, name, value)


def wrapped(function):
    def callback(node, *args):
        wrapper = node.own_state.get('wrapper')
        if wrapper is None:
            wrapper = node.own_state['wrapper'] = Wrapper(node)
        return function(wrapper, *args) if node.ros.context.ok() else None
    return callback


@wrapped
def tick(self):
    self.declare_state(total=0.0, history=[])
    self.state.n += 1
    self.publish(self.get_parameter('topic').value, self.state.n / 2)


@wrapped
def listen(self, msg):
    limit = self.get_parameter('limit').get_parameter_value().double_value
    self.state.total += min(msg.data, limit)
    self.state.history.append(msg.data)
    self.get_logger().info('%d values, of %s', 1 + len(self.state.history) // 100, self.name)


@wrapped
def reset(self, request):
    before, self.state.n = self.state.n, 0
    self.publish('log', f'reset at {before}')
    return {'success': before > 0, 'message': str(before)}


@wrapped
def use(self):
    self.log.debug(self.call('reset', {}).message)
