import random

from geometry_msgs.msg import Twist


class Machine:
    def __init__(self, model, transitions, initial):
        self.model, self.transitions = model, {}
        model.state = initial
        for trigger, source, dest in transitions:
            self.transitions.setdefault(trigger, {})[source] = dest
            setattr(model, trigger, lambda trigger=trigger: self.fire(trigger))
            setattr(model, f'may_{trigger}', lambda trigger=trigger: model.state in self.transitions[trigger] or '*' in self.transitions[trigger])

    def fire(self, trigger):
        table = self.transitions[trigger]
        dest = table.get(self.model.state, table.get('*'))
        if dest is None:
            return False
        getattr(self.model, f'on_exit_{self.model.state}', lambda: None)()
        self.model.state = dest
        getattr(self.model, f'on_enter_{dest}', lambda: None)()
        return True


class Dock:
    speed = 0.0

    def on_enter_searching(self):
        self.speed = 0.1

    def on_exit_searching(self):
        self.speed = 0

    def on_enter_docking(self):
        self.speed = -0.05


TRANSITIONS = [
    ('start', 'idle', 'searching'), ('found', 'searching', 'docking'), ('contact', 'docking', 'docked'), ('reset', '*', 'idle'),
]


def _dock(node):
    dock = getattr(node.state, 'dock', None)
    if dock is None:
        node.state.dock = dock = Dock()
        Machine(dock, TRANSITIONS, 'idle')
    return dock


def events(node):
    return random.choice([t[0] for t in TRANSITIONS])


def on_event(node, message):
    dock = _dock(node)
    before = dock.state
    if getattr(dock, f'may_{message.data}')():
        getattr(dock, message.data)()
    return dock.state if dock.state != before else None


def run(node):
    twist = Twist()
    twist.linear.x = float(_dock(node).speed)
    return twist
