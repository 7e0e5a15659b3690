from __future__ import annotations

from collections import deque

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue


class DiagnosticStatusWrapper(DiagnosticStatus):
    def summary(self, *args):
        if len(args) == 1:
            self.level, self.message = args[0].level, args[0].message
        else:
            self.level, self.message = args

    def add(self, key, value):
        self.values.append(KeyValue(key=str(key), value=str(value)))

    def plain(self):
        return DiagnosticStatus(**{n: getattr(self, n) for n in self.get_fields_and_field_types()})


class Task:
    def __init__(self, name):
        self.name = name

    def run(self, stat):
        raise NotImplementedError


class Frequency(Task):
    def __init__(self, low, high):
        super().__init__('Frequency Status')
        self.low, self.high, self.times = low, high, deque(maxlen=100)

    def tick(self, t):
        self.times.append(t)

    def run(self, stat):
        span = self.times[-1] - self.times[0] if len(self.times) > 1 else 0
        freq = (len(self.times) - 1) / span if span else 0.0
        ok = self.low <= freq <= self.high
        stat.summary(DiagnosticStatus.OK if ok else DiagnosticStatus.WARN, 'as desired' if ok else 'off')
        stat.add('Actual frequency (Hz)', freq)
        return stat


class Function(Task):
    def __init__(self, name, function):
        super().__init__(name)
        self.run = function


def _alive(stat):
    stat.summary(DiagnosticStatus(level=DiagnosticStatus.OK, message='alive'))
    return stat


def _tasks(node):
    if 'tasks' not in vars(node.state):
        p = node.parameters
        node.state.frequency = Frequency(p.min_freq, p.max_freq)
        node.state.tasks = [node.state.frequency, Function('alive', _alive)]
    return node.state.tasks


def data(node):
    return 1


def tick(node, message):
    _tasks(node)
    node.state.frequency.tick(node.now().nanoseconds * 1e-9)


def update(node) -> DiagnosticArray:
    array = DiagnosticArray()
    array.header.stamp = node.now().to_msg()
    for task in _tasks(node):
        stat = DiagnosticStatusWrapper(name=f'{node.name}: {task.name}', hardware_id=node.parameters.hardware_id)
        array.status.append(task.run(stat).plain())
    return array
