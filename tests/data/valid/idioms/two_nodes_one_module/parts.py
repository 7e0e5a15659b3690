class Behaviour:
    """Each call makes an object, runs it, and returns nothing."""

    def __new__(cls, node, *args):
        self = super().__new__(cls)
        self.node = node
        return self.run(*args)

    @property
    def state(self):
        return self.node.state

    def run(self, *args):
        raise NotImplementedError


class Producer(Behaviour):
    def run(self):
        for _ in range(self.node.parameters.rate):
            self.state.sent += 1
            self.node.publish(self.node.parameters.topic, self.state.sent)


class Consumer(Behaviour):
    def run(self, message):
        self.state.received.append(message.data)


def report(node):
    for name in ('sent', 'received'):
        if (value := getattr(node.state, name, None)) is not None:
            node.logger.info(f'{name}: {value if isinstance(value, int) else len(value)}')
