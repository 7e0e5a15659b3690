"""The files of a system with every kind of entity, from which random edits begin.

The nodes `witness` and `witness_afar`, which is in a worker, are never edited themselves: what
they do must pass through all edits of others.
"""

PARTS = """
import helper
from pack import inner

TAG = 0


def tick(node, text='x'):
    return text


def steps(node, text='a'):
    while True:
        yield text


def few_steps(node):
    for number in range(3):
        yield str(number)


async def tick_later(node):
    return 'later'


async def steps_later(node):
    while True:
        yield 'b'


class Ticking:
    def __call__(self, node):
        return 'c'


ticking = Ticking()


class Kept:
    def __init__(self, node):
        self.node = node

    def tick(self, node, text='k'):
        return text

    async def tick_later(self, node):
        return 'k'


def notice(node, event):
    node.logger.debug(str(event))


async def notice_later(node, event):
    node.logger.debug(str(event))


def adjust(node, changes):
    node.logger.debug(f"changed {sorted(changes)}")


def hear(node, message, prefix=''):
    return f'{prefix}{getattr(message, "data", "raw")}'


async def hear_later(node, message):
    return getattr(message, 'data', 'raw')


def answer(node, request, text='yes'):
    return {'success': True, 'message': text}


async def answer_later(node, request):
    return {'success': True, 'message': 'later'}


def count(node, goal, first=0):
    for number in range(goal.order):
        yield {'sequence': [number]}
    return {'sequence': [first]}


def count_at_once(node, goal):
    return {'sequence': [2]}


async def count_later(node, goal):
    return {'sequence': [3]}


def accept(node, goal):
    return goal.order < 10


def follow(node, feedback):
    node.logger.debug(f'{feedback}')


def begin(node, text=''):
    node.logger.debug(f'begun {text}')


def ended(process, exit_code, text=''):
    process.logger.debug(f'ended {text}')


def fail_to_begin(node):
    raise OSError('no such device')


def end(node):
    node.logger.debug('ended')


def decide(node, changes, most=50.0):
    return 'no' if changes.get('speed', 0.0) > most else None


async def decide_later(node, changes):
    return 'no' if changes.get('speed') == 7.0 else None
"""

PEER = """
from helper import WORD

TAG = 0


def tick(node, text='y'):
    return text


def hear(node, message, prefix='p'):
    return None
"""

WITNESS = """
import time

TAG = 0


def count(node):
    node.state.count += 1
    return node.state.count


def hear(node, message):
    node.state.heard.append(message.data)


def hear_afar(node, message):
    node.state.heard_afar.append(message.data)


def hold(node, message):
    while not node.state.released:
        time.sleep(0.005)
    node.state.held.append(message.data)


def answer(node, request):
    while not node.state.released:
        time.sleep(0.005)
    return {'success': True, 'message': 'released'}


def run(node, goal):
    while not node.state.released:
        time.sleep(0.005)
        yield {'sequence': [1]}
    return {'sequence': [goal.order]}
"""

PARAMETERS = '/**:\n  ros__parameters:\n    limit: {limit}\n'

MODULES = {
    'parts.py': PARTS,
    'peer.py': PEER,
    'helper.py': "WORD = 'w'\nTAG = 0\n",
    'pack/__init__.py': 'TAG = 0\n',
    'pack/inner.py': 'from .low import LOW\n\nTAG = 0\n',
    'pack/low.py': 'LOW = 1\nTAG = 0\n',
    'witness_parts.py': WITNESS,
}

# An installed package, as processes name one.
SHARE = 'prefix/share/ament_index/resource_index/packages/sleeping'
PROGRAM = 'prefix/lib/sleeping/sleeper'

_STRING = 'std_msgs/msg/String'
_FIBONACCI = 'test_msgs/action/Fibonacci'
_TRIGGER = 'std_srvs/srv/Trigger'
_OWN = {
    'namespace': '/',
    'log_level': 'info',
    'use_sim_time': False,
    'parameter_services': True,
    'rosout': True,
    'type_description_service': False,
    'logger_services': False,
    'on_error': 'log',
    'warn_after': None,
    'local_delivery': True,
    'worker': '',
}
_COUNTING = {
    'publishers': {'counts': {'type': 'std_msgs/msg/Int64', 'qos': 1000}},
    'timers': {
        'count': {
            'period': 0.02,
            'behaviour': 'witness_parts:count',
            'publish': 'counts',
            'warn_after': None,
        }
    },
}

WITNESS_NODE = {
    **_OWN,
    'parameters': {'level': 1},
    'state': {'count': 0, 'heard': [], 'heard_afar': [], 'held': [], 'released': False},
    **_COUNTING,
    'subscriptions': {
        'counts_afar': {
            'type': 'std_msgs/msg/Int64',
            'behaviour': 'witness_parts:hear_afar',
            'qos': 1000,
        },
        'counts': {
            'type': 'std_msgs/msg/Int64',
            'behaviour': 'witness_parts:hear',
            'qos': 1000,
        },
        'held': {
            'type': 'std_msgs/msg/Int64',
            'behaviour': 'witness_parts:hold',
            'group': 'held',
            'qos': 1000,
            'external': True,
        },
    },
    'services': {
        'slow': {'type': _TRIGGER, 'behaviour': 'witness_parts:answer', 'group': 'reentrant'}
    },
    'actions': {'long': {'type': _FIBONACCI, 'behaviour': 'witness_parts:run'}},
}
_AFAR = {
    **_OWN,
    'worker': 'still',
    'remap': {'counts': 'counts_afar'},
    'state': {'count': 0},
    **_COUNTING,
}
WITNESS_NODES = {'witness': WITNESS_NODE, 'witness_afar': _AFAR}
WITNESSES = tuple(f'/{each}' for each in WITNESS_NODES)

SYSTEM = {
    'version': 1,
    'args': {'speed': {'default': 1.0, 'type': 'double'}, 'where': 'far'},
    'vars': {'half': '{{ speed / 2 }}'},
    'check': {'other': {'args': {'speed': 2.0}}},
    'qos': {'near': {'depth': 3}},
    'defaults': {'log_level': 'info'},
    'workers': {'left': {'restart': {'when': 'never'}}, 'right': {'nice': 1}},
    'include': {
        'wheels_{{ side }}': {
            'file': 'part.yaml',
            'namespace': '/wheels/{{ side }}',
            'foreach': {'side': ['left']},
            'args': {'size': 2},
            'worker': 'right',
        }
    },
    'nodes': {
        **WITNESS_NODES,
        'talker': {
            'parameters': {
                'speed': {'default': '{{ speed }}', 'minimum': 0.0, 'maximum': 100.0},
                'name': 'Alice',
                'limit': 5,
                'mode': {'default': 'slow', 'choices': ['slow', 'fast']},
                'marks': {'type': 'integer_array', 'default': [1, 2]},
                'said': {'command': ['echo', 'one']},
                'read': {'file': 'others.yaml', 'key': 'talker.ros__parameters.name'},
            },
            'parameter_files': ['parameters.yaml'],
            'state': {'begun': False, 'last': None},
            'publishers': {
                'out': {'type': _STRING, 'external': True},
                'more': {'type': _STRING, 'topic': '{{ where }}', 'external': True},
            },
            'timers': {
                'tick': {'period': 0.05, 'behaviour': 'parts:tick', 'publish': 'out'},
                'steps': {'period': 0.06, 'behaviour': 'parts:steps', 'publish': 'more'},
                'later': {'period': 0.08, 'behaviour': 'parts:tick_later'},
                'steps_later': {'period': 0.07, 'behaviour': 'parts:steps_later'},
                'constant': {'rate': 10.0, 'publish': 'out', 'message': 'hello'},
                'rare': {'period': 100.0, 'behaviour': 'parts:ticking'},
            },
            'on_start': 'parts:begin',
            'on_parameters': 'parts:decide',
        },
        'listener': {
            'worker': 'left',
            'publishers': {'echo': {'type': _STRING, 'external': True}},
            'subscriptions': {
                'hear': {
                    'type': _STRING,
                    'topic': 'out',
                    'behaviour': 'parts:hear',
                    'publish': 'echo',
                    'qos': 'near',
                },
                'later': {
                    'type': _STRING,
                    'topic': 'far',
                    'behaviour': 'parts:hear_later',
                    'publish': 'echo',
                },
                'pass_on': {'type': _STRING, 'topic': 'far', 'publish': 'echo'},
            },
            'services': {'ask': {'type': _TRIGGER, 'behaviour': 'parts:answer'}},
            'actions': {'count': {'type': _FIBONACCI, 'behaviour': 'parts:count'}},
        },
        'managed': {
            'lifecycle': {'start': 'active'},
            'bond': False,
            'subscriptions': {
                'kept': {
                    'type': _STRING,
                    'topic': 'far',
                    'behaviour': 'parts:hear',
                    'while_inactive': 'keep',
                },
            },
            'services': {
                'managed_ask': {
                    'type': _TRIGGER,
                    'behaviour': 'parts:answer',
                    'while_inactive': 'drop',
                },
            },
            'timers': {'tick': {'period': 0.1, 'behaviour': 'parts:ticking'}},
            'on_activate': 'parts:end',
        },
        'user': {
            'namespace': '/inner',
            'parameter_files': [{'file': 'others.yaml', 'expressions': True, 'root': 'x'}],
            'service_clients': {'ask': {'type': _TRIGGER, 'service': '/ask'}},
            'action_clients': {
                'count': {'type': _FIBONACCI, 'action': '/count', 'feedback': 'parts:follow'}
            },
        },
    },
    'processes': {
        'sleeper': {
            'command': ['sh', '-c', 'exec sleep 1000'],
            'env': {'SAID': {'command': ['echo', 'one']}, 'READ': {'file': 'others.yaml'}},
            'on_exit': ['parts:ended'],
        },
        'packaged': {'package': 'sleeping', 'executable': 'sleeper', 'name': 'dreamer'},
    },
}

PART = {
    'version': 1,
    'args': {'size': {'type': 'integer', 'default': 1}},
    'nodes': {
        'wheel_{{ i }}': {
            'foreach': {'i': [1]},
            'parameters': {'size': '{{ size * i }}'},
            'publishers': {'turn': {'type': _STRING, 'topic': 'turns'}},
            'timers': {'turn': {'period': 0.1, 'behaviour': 'peer:tick', 'publish': 'turn'}},
        },
        'hub': {
            'subscriptions': {
                'turns': {'type': _STRING, 'behaviour': 'peer:hear', 'group': 'own'}
            },
        },
    },
}

LAYER = {'version': 1, 'nodes': {'talker': {'parameters': {'name': 'Bob'}}}}

DOCUMENTS = {'system.yaml': SYSTEM, 'part.yaml': PART, 'layer.yaml': LAYER}
