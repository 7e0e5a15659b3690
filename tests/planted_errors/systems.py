"""Valid systems of all kinds, with the modules of their behaviours, made by chance."""

import copy
from dataclasses import dataclass, field

from composer.interfaces.catalogue import InterfaceCatalogue

WORDS = ['arm', 'base', 'battery', 'brake', 'camera', 'claw', 'depth', 'drive', 'encoder', 'force', 'gripper', 'heading', 'horizon', 'imu', 'joint', 'kinematics', 'laser', 'lidar', 'map', 'motor', 'odometry', 'pedestal', 'planner', 'pressure', 'pump', 'radar', 'rotor', 'scanner', 'servo', 'sonar', 'steering', 'suspension', 'thermal', 'torque', 'tracker', 'turret', 'velocity', 'voltage', 'wheel', 'winch']  # fmt: skip
SIDES = ['left', 'right', 'front', 'rear', 'upper', 'lower', 'inner', 'outer']
MESSAGES = [
    'std_msgs/msg/String', 'std_msgs/msg/Int8', 'std_msgs/msg/UInt16', 'std_msgs/msg/Float64', 'std_msgs/msg/Bool', 'std_msgs/msg/ColorRGBA', 'std_msgs/msg/Int32MultiArray',
    'geometry_msgs/msg/Twist', 'geometry_msgs/msg/PoseStamped', 'geometry_msgs/msg/PoseWithCovariance', 'geometry_msgs/msg/Polygon', 'sensor_msgs/msg/Imu', 'sensor_msgs/msg/Joy',
    'sensor_msgs/msg/BatteryState', 'nav_msgs/msg/Odometry', 'diagnostic_msgs/msg/DiagnosticStatus', 'trajectory_msgs/msg/JointTrajectoryPoint',
]  # fmt: skip
SERVICES = ['std_srvs/srv/SetBool', 'std_srvs/srv/Trigger', 'std_srvs/srv/Empty']
ACTIONS = ['test_msgs/action/Fibonacci', 'test_msgs/action/NestedMessage']
RANGES = {f'{sign}int{bits}': (0 if sign else -(2 ** (bits - 1)), 2 ** (bits - (not sign)) - 1) for sign in ('', 'u') for bits in (8, 16, 32, 64)}  # fmt: skip


@dataclass
class Function:
    """A behaviour: how it is defined, and how often it is bound."""

    parameters: list
    keywords: list = field(default_factory=list)
    body: list = field(default_factory=list)
    bound: int = 0

    def source(self, name):
        keywords = [f'*, {", ".join(self.keywords)}'] if self.keywords else []
        body = self.body or ['...']
        lines = ''.join(f'    {line}\n' for line in body)
        return f'def {name}({", ".join(self.parameters + keywords)}):\n{lines}\n\n'


@dataclass
class System:
    """The data of a file, and its modules."""

    data: dict
    modules: dict


class Generator:
    """Makes one system; what is named twice is named alike, so nothing hangs in the air."""

    def __init__(self, chance):
        self.chance = chance
        self.catalogue = InterfaceCatalogue()
        self.modules = {}
        self.names = [f'{side}_{word}' for side in SIDES for word in WORDS]
        chance.shuffle(self.names)

    def name(self):
        return self.names.pop()

    def system(self):
        chance = self.chance
        data = {'version': 1}
        self.profiles = [self.name() for _ in range(chance.randint(0, 3))]
        if self.profiles:
            data['qos'] = {name: self._profile() for name in self.profiles}
        if chance.random() < 0.5:
            data['executor'] = {'threads': chance.randint(2, 16), 'shutdown_timeout': 2.5}
        if chance.random() < 0.5:
            data['defaults'] = {'log_level': 'debug', 'on_error': 'restart', 'namespace': '/fleet'}
        data['nodes'] = {self.name(): self._begin_node() for _ in range(chance.randint(2, 5))}
        for node in data['nodes'].values():
            self._connect(node, data)
        for node in data['nodes'].values():
            self._use_all(node)
        return System(data, self.modules)

    def _profile(self):
        chance = self.chance
        return {
            'depth': chance.randint(1, 50),
            'reliability': 'reliable',
            'durability': chance.choice(('volatile', 'transient_local')),
            'history': 'keep_last',
        }

    def _begin_node(self):
        chance = self.chance
        node = {}
        if chance.random() < 0.3:
            node['namespace'] = chance.choice(('robot', '/fleet/robot'))
        if chance.random() < 0.3:
            node['log_level'] = chance.choice(('debug', 'info', 'warn', 'error'))
        if chance.random() < 0.3:
            # Nothing publishes `/clock`.
            node['use_sim_time'] = False
        if chance.random() < 0.3:
            node['on_error'] = chance.choice(('log', 'restart', 'shutdown'))
        node['parameters'] = {self.name(): self._parameter() for _ in range(chance.randint(0, 4))}
        return node

    def _parameter(self):
        chance = self.chance
        low, high = chance.randint(-50, 0), chance.randint(10, 90)
        return chance.choice(
            (
                chance.randint(low, high),
                chance.random(),
                chance.random() < 0.5,
                'steady',
                [1, 2, 3],
                ['a', 'b'],
                [0.5, 2],
                {'default': chance.randint(low, high), 'minimum': low, 'maximum': high},
                {'default': 0.5, 'type': 'double', 'description': 'm/s', 'read_only': True},
                {'default': 'slow', 'choices': ['slow', 'fast'], 'description': 'how'},
                {'default': low + 10, 'minimum': low, 'maximum': low + 20, 'step': 5},
                {'type': 'integer_array', 'default': [1, 2]},
                {'type': 'string'},
            )
        )

    def _connect(self, node, data):
        chance = self.chance
        for _ in range(chance.randint(1, 3)):
            self._add_topic(node, chance.choice(list(data['nodes'].values())))
        if chance.random() < 0.6:
            self._add_service(node, chance.choice(list(data['nodes'].values())))
        if chance.random() < 0.4:
            self._add_action(node, chance.choice(list(data['nodes'].values())))

    def _add_topic(self, node, other):
        chance = self.chance
        topic = '/' + self.name()
        kind = chance.choice(MESSAGES)
        publisher, subscription, timer = self.name(), self.name(), self.name()
        entity = {'type': kind, 'topic': topic}
        if self.profiles and chance.random() < 0.6:
            entity['qos'] = chance.choice([*self.profiles, 'sensor_data', 7])
        elif chance.random() < 0.3:
            entity['qos'] = {'depth': 3, 'deadline': 2.0, 'reliability': 'reliable'}
        node.setdefault('publishers', {})[publisher] = copy.deepcopy(entity)
        ticking = {'period': round(chance.uniform(0.1, 9), 2)}
        if chance.random() < 0.3:
            ticking = {'rate': chance.randint(1, 90)}
        ticking['publish'] = publisher
        if chance.random() < 0.5:
            ticking['message'] = self.payload(kind)
        else:
            ticking |= self._behaviour(['node'], may_take_more=True)
            ticking['clock'] = chance.choice(('ros', 'steady', 'system'))
        node.setdefault('timers', {})[timer] = ticking
        heard = copy.deepcopy(entity) | self._behaviour(['node', 'message'], may_take_more=True)
        if chance.random() < 0.3:
            heard['group'] = chance.choice(('reentrant', 'slow_group'))
        if chance.random() < 0.3:
            heard['on_error'] = 'shutdown'
        other.setdefault('subscriptions', {})[subscription] = heard

    def _add_service(self, node, other):
        kind, service = self.chance.choice(SERVICES), '/' + self.name()
        served = {'type': kind, 'service': service} | self._behaviour(['node', 'request'])
        node.setdefault('services', {})[self.name()] = served
        client = {'type': kind, 'service': service}
        other.setdefault('service_clients', {})[self.name()] = client

    def _add_action(self, node, other):
        kind, action = self.chance.choice(ACTIONS), '/' + self.name()
        served = {'type': kind, 'action': action} | self._behaviour(['node', 'goal'])
        served['concurrency'] = self.chance.choice(('parallel', 'queue', 'reject', 'preempt'))
        node.setdefault('actions', {})[self.name()] = served
        client = {'type': kind, 'action': action}
        client['result'] = self._behaviour(['node', 'result'])['behaviour']
        other.setdefault('action_clients', {})[self.name()] = client

    def _behaviour(self, parameters, *, may_take_more=False):
        chance = self.chance
        if not self.modules or (len(self.modules) < 3 and chance.random() < 0.2):
            self.modules[f'{self.name()}_behaviours'] = {}
        module = chance.choice(list(self.modules))
        name = f'{chance.choice(("read", "move", "watch", "steer"))}_{self.name()}'
        function = Function(list(parameters), bound=1)
        self.modules[module][name] = function
        bound = {'behaviour': f'{module}:{name}'}
        if may_take_more and chance.random() < 0.4:
            function.keywords = [self.name(), self.name()]
            bound['with'] = {function.keywords[0]: 1.5, function.keywords[1]: 'gentle'}
        return bound

    def _use_all(self, node):
        bound = self._behaviour(['node'])
        module, _, name = bound['behaviour'].partition(':')
        body = [f'node.parameters.{each}' for each in node['parameters']]
        body += [f'node.publish({each!r}, {{}})' for each in node.get('publishers', ())]
        asks = [f'node.call({each!r}, {{}})' for each in node.get('service_clients', ())]
        asks += [f'node.send_goal({each!r}, {{}})' for each in node.get('action_clients', ())]
        if asks:
            # Other nodes may start later: here it would wait for them in vain.
            body += ['def ask():', *(f'    {each}' for each in asks)]
            body += ['import threading', 'threading.Thread(target=ask).start()']
        self.modules[module][name].body = body
        node['on_start'] = self.chance.choice((bound, bound['behaviour']))
        if not node['parameters']:
            del node['parameters']

    def payload(self, full_name):
        """Return a payload that is right, with some of the fields of a message."""
        description = self.catalogue.describe(full_name)
        fields = self.chance.sample(
            description.fields, self.chance.randint(1, len(description.fields))
        )
        return {each.name: self._value(each.type) for each in fields}

    def _value(self, kind):
        if kind.array is None:
            return self._scalar(kind)
        length = kind.array_bound if kind.array == 'fixed' else min(kind.array_bound or 3, 3)
        return [self._scalar(kind) for _ in range(length)]

    def _scalar(self, kind):
        chance = self.chance
        if kind.nested:
            return self.payload(kind.nested)
        if kind.kind in RANGES or kind.kind in ('byte', 'char'):
            return chance.randint(*RANGES.get(kind.kind, (0, 255)))
        if kind.kind == 'bool':
            return chance.random() < 0.5
        if kind.kind in ('string', 'wstring'):
            return 'text'
        return round(chance.uniform(-9, 9), 3)
