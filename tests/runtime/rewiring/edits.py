"""A system of every kind of entity, and random edits of it: of the file, and of its modules."""

import copy
import json
import random

MODULE = """
LEVEL = 1


def tick(node, text='x'):
    node.own_state['n'] = node.own_state.get('n', 0) + 1
    return text


def steps(node):
    while True:
        yield 'a'
        yield 'b'


def hear(node, message, prefix=''):
    return f'{prefix}{message.data}'


async def hear_later(node, message):
    return message.data


def answer(node, request):
    return {'success': True, 'message': 'yes'}


def count(node, goal):
    for number in range(goal.order):
        yield {'sequence': [number]}
    return {'sequence': [1]}


def accept(node, goal):
    return goal.order < 10


def follow(node, feedback):
    node.state.last = feedback


def begin(node):
    node.logger.debug('begun')


def decide(node, changes):
    return 'no' if changes.get('speed') == 99.0 else None
"""

PEER = """
def tick(node, text='y'):
    return text


def hear(node, message, prefix='p'):
    return None
"""

PARAMETERS = '/**:\n  ros__parameters:\n    limit: {limit}\n'

SYSTEM = {
    'version': 1,
    'qos': {'near': {'depth': 3}},
    'diagnostics': False,
    'nodes': {
        'talker': {
            'parameters': {
                'speed': {'default': 1.0, 'minimum': 0.0, 'maximum': 100.0},
                'name': 'Alice',
                'limit': 5,
            },
            'parameter_files': ['parameters.yaml'],
            'state': {'begun': False, 'last': None},
            'publishers': {
                'out': {'type': 'std_msgs/msg/String', 'external': True},
                'more': {'type': 'std_msgs/msg/String', 'topic': 'far', 'external': True},
            },
            'timers': {
                'tick': {'period': 0.5, 'behaviour': 'parts:tick', 'publish': 'out'},
                'steps': {'period': 0.7, 'behaviour': 'parts:steps', 'publish': 'more'},
                'constant': {'rate': 2.0, 'publish': 'out', 'message': 'hello'},
            },
            'on_start': 'parts:begin',
            'on_parameters': 'parts:decide',
        },
        'listener': {
            'publishers': {'echo': {'type': 'std_msgs/msg/String', 'external': True}},
            'subscriptions': {
                'hear': {
                    'type': 'std_msgs/msg/String',
                    'topic': 'out',
                    'behaviour': 'parts:hear',
                    'publish': 'echo',
                    'qos': 'near',
                },
                'later': {
                    'type': 'std_msgs/msg/String',
                    'topic': 'far',
                    'behaviour': 'parts:hear_later',
                    'publish': 'echo',
                },
            },
            'services': {
                'ask': {'type': 'std_srvs/srv/Trigger', 'behaviour': 'parts:answer'},
            },
            'actions': {
                'count': {'type': 'test_msgs/action/Fibonacci', 'behaviour': 'parts:count'},
            },
        },
        'user': {
            'namespace': '/inner',
            'service_clients': {'ask': {'type': 'std_srvs/srv/Trigger', 'service': '/ask'}},
            'action_clients': {
                'count': {
                    'type': 'test_msgs/action/Fibonacci',
                    'action': '/count',
                    'feedback': 'parts:follow',
                }
            },
        },
    },
    'processes': {'sleeper': {'command': ['sleep', '1000']}},
}

_TYPES = ['std_msgs/msg/String', 'std_msgs/msg/Header', 'nowhere/msg/Wrong']
_QOS = [None, 'near', 'sensor_data', {'depth': 7}, {'durability': 'transient_local'}, {'dept': 1}]
_BEHAVIOURS = ['parts:hear', 'parts:hear_later', 'peer:hear', 'parts:nothing']
_ON_ERROR = ['log', 'restart', 'shutdown']
# By section: the keys of an entity, and values for them; `None` removes the key.
_CHOICES = {
    'parameters': {
        'default': [0.5, 2.0, 99.0, 1000.0, 'fast'],
        'maximum': [50.0, 100.0],
        'description': ['how fast', None],
        'read_only': [True, None],
        'step': [0.5, None],
    },
    'publishers': {'type': _TYPES, 'topic': ['out', 'far', 'away', None], 'qos': _QOS},
    'timers': {
        'period': [0.1, 0.4, 3.0, -1.0],
        'behaviour': ['parts:tick', 'parts:steps', 'peer:tick'],
        'with': [{'text': 'z'}, {'txt': 'z'}, None],
        'publish': ['out', 'more', 'nothing', None],
        'clock': ['steady', 'system', None],
        'group': ['reentrant', 'own', None],
        'on_error': _ON_ERROR,
        'warn_after': [0.1, 2.0, None],
    },
    'subscriptions': {
        'type': _TYPES,
        'topic': ['out', 'far', 'away'],
        'behaviour': _BEHAVIOURS,
        'with': [{'prefix': 'z'}, None],
        'publish': ['echo', None],
        'qos': _QOS,
        'group': ['reentrant', 'own', None],
        'on_error': _ON_ERROR,
        'external': [True, None],
    },
    'services': {
        'service': ['ask', 'tell'],
        'behaviour': ['parts:answer', 'parts:anwser'],
        'group': ['reentrant', None],
        'warn_after': [0.2, None],
    },
    'service_clients': {'service': ['/ask', '/tell'], 'external': [True, None]},
    'actions': {
        'action': ['count', 'compute'],
        'accept': ['parts:accept', None],
        'concurrency': ['queue', 'reject', 'preempt', 'parallel'],
    },
    'action_clients': {
        'action': ['/count', '/compute'],
        'feedback': ['parts:follow', None],
        'external': [True, None],
    },
}
_NODE_CHOICES = {
    'log_level': ['debug', 'error', None],
    'use_sim_time': [True, None],
    'rosout': [False, None],
    'parameter_services': [False, None],
    'on_error': _ON_ERROR,
    'warn_after': [1.0, None],
    'remap': [{'far': 'further'}, None],
    'on_start': ['parts:begin', None],
    'on_stop': ['parts:begin', None],
    'on_parameters': ['parts:decide', None],
    'description': ['a node', None],
    'namespace': ['/inner', '/outer', None],
    'colour': ['red', None],
}
_PROCESS_CHOICES = {
    'command': [['sleep', '1000'], ['sleep', '2000'], ['slepe', '1']],
    'required': [True, None],
    'env': [{'A': 'b'}, None],
    'restart': ['always', None],
}


class Project:
    """The files of a system, and edits of them that a seed decides.

    Attributes:
        data: What the system's file says.
    """

    def __init__(self, folder, seed):
        self._folder = folder
        self._random = random.Random(seed)
        self.data = copy.deepcopy(SYSTEM)
        self._texts = {'parts.py': MODULE, 'peer.py': PEER}
        self._texts['parameters.yaml'] = PARAMETERS.format(limit=7)
        self._count = 0
        self._valid = None
        self._write()

    @property
    def path(self):
        return self._folder / 'system.yaml'

    def edit(self):
        """Make one to three edits; return what they are."""
        done = [
            self._random.choice(self._edits())() for _ in range(self._random.choice([1, 1, 2, 3]))
        ]
        self._write()
        return done

    def keep(self):
        """Remember the files as they are: they are valid."""
        self._valid = copy.deepcopy((self.data, self._texts))

    def go_back(self):
        """Make the files what they were when they were valid."""
        self.data, self._texts = copy.deepcopy(self._valid)
        self._write()

    def _write(self):
        # JSON is YAML.
        self.path.write_text(json.dumps(self.data, indent=1))
        for name, text in self._texts.items():
            (self._folder / name).write_text(text)

    def _edits(self):
        edits = [self._edit_entity] * 10 + [self._edit_node, self._edit_module, self._edit_process]
        return [*edits, self._edit_state, self._edit_limit, self._add_or_remove, self._rename]

    def _choose(self, mapping):
        return self._random.choice(sorted(mapping)) if mapping else None

    def _set(self, entry, choices):
        key = self._choose(choices)
        value = self._random.choice(choices[key])
        entry.pop(key, None)
        if value is not None:
            entry[key] = copy.deepcopy(value)
        return f'{key}={value}'

    def _edit_entity(self):
        node = self._choose(self.data['nodes'])
        section = self._choose(set(self.data['nodes'][node]) & set(_CHOICES))
        entries = self.data['nodes'][node].get(section)
        name = self._choose(entries)
        if name is None or not isinstance(entries[name], dict):
            return 'nothing'
        return f'{node}.{section}.{name}.{self._set(entries[name], _CHOICES[section])}'

    def _edit_node(self):
        node = self._choose(self.data['nodes'])
        return f'{node}.{self._set(self.data["nodes"][node], _NODE_CHOICES)}'

    def _edit_process(self):
        processes = self.data.setdefault('processes', {})
        name = self._random.choice(['sleeper', 'other'])
        if name in processes and self._random.random() < 0.3:
            del processes[name]
            return f'no process {name}'
        entry = processes.setdefault(name, {'command': ['sleep', '1000']})
        return f'process {name}.{self._set(entry, _PROCESS_CHOICES)}'

    def _edit_module(self):
        name = self._random.choice(['parts.py', 'peer.py'])
        self._count += 1
        line = self._random.choice(['LEVEL = {}', 'import nothing_{}', 'def broken(:', '# {}'])
        self._texts[name] += line.format(self._count) + '\n'
        return f'{name}: {line}'

    def _edit_state(self):
        node = self._choose(self.data['nodes'])
        state = self.data['nodes'][node].setdefault('state', {})
        return (
            f'{node}.state.{self._set(state, {"begun": [False, None], "extra": [1, [2], None]})}'
        )

    def _edit_limit(self):
        limit = self._random.choice(['5', '8', '1.5', 'many'])
        self._texts['parameters.yaml'] = PARAMETERS.format(limit=limit)
        return f'parameters.yaml: {limit}'

    def _add_or_remove(self):
        node = self._choose(self.data['nodes'])
        section = self._choose(set(self.data['nodes'][node]) & set(_CHOICES))
        entries = self.data['nodes'][node].get(section)
        name = self._choose(entries)
        if name is not None and self._random.random() < 0.5:
            del entries[name]
            return f'no {node}.{section}.{name}'
        origin = self._choose(SYSTEM['nodes'])
        section = self._choose(set(SYSTEM['nodes'][origin]) & set(_CHOICES))
        name = self._choose(SYSTEM['nodes'][origin][section])
        self._count += 1
        target = self.data['nodes'][node].setdefault(section, {})
        target[name] = copy.deepcopy(SYSTEM['nodes'][origin][section][name])
        return f'{node}.{section}.{name} as of {origin}'

    def _rename(self):
        nodes = self.data['nodes']
        node = self._choose(nodes)
        name = self._random.choice(['talker', 'listener', 'user', 'fourth', 'fifth'])
        if self._random.random() < 0.5 and len(nodes) > 1:
            del nodes[node]
            return f'no node {node}'
        nodes[name] = copy.deepcopy(nodes[node])
        return f'node {name} as {node}'
