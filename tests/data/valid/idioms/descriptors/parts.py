class Param:
    """A parameter of the node as an attribute."""

    def __set_name__(self, owner, name):
        self.name = name

    def __get__(self, instance, owner=None):
        return self if instance is None else instance.node.parameters[self.name]


class State:
    def __init__(self, default):
        self.default = default

    def __set_name__(self, owner, name):
        self.name = f'{owner.__name__.lower()}_{name}'

    def __get__(self, instance, owner=None):
        return getattr(instance.node.state, self.name, self.default)

    def __set__(self, instance, value):
        setattr(instance.node.state, self.name, value)


class Meta(type):
    def __call__(cls, node):
        key = f'_{cls.__name__}'
        if key not in vars(node.state):
            setattr(node.state, key, super().__call__(node))
        return getattr(node.state, key)


class Processor(metaclass=Meta):
    gain, offset, name_prefix = Param(), Param(), Param()
    count = State(0)

    def __init__(self, node):
        self.node = node

    def __call__(self, message):
        self.count += 1
        return self.gain * message.data + self.offset

    def __format__(self, spec):
        return f'{self.name_prefix}{self.count:{spec or "d"}}'


def produce(node):
    return Processor(node).count / 10


def process(node, message):
    return Processor(node)(message)


def label(node):
    return f'{Processor(node):03d}'
