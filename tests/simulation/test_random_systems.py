"""Random systems do the same each time, shuffled or not, and keep what ROS promises."""

import random
from collections import defaultdict

import pytest
import yaml

from composer.simulation.trace import render_event

pytestmark = pytest.mark.ros

CODE = """
import random
import threading
import time

def tick(node, name: str, pause: float):
    node.state.count = getattr(node.state, 'count', 0) + 1
    if pause:
        time.sleep(pause * random.random())
    return f'{node.name}.{name} {node.state.count}'

async def ask(node, name: str):
    try:
        answer = await node.call_async(name, timeout=1.0)
        node.logger.info(answer.message)
    except Exception as error:
        node.logger.info(type(error).__name__)

def answer(node, request, pause: float):
    time.sleep(pause)
    return {'success': True, 'message': f'{time.time()}'}

def hear(node, message, name: str, pause: float):
    node.logger.info(f'{name} heard {message.data}')
    time.sleep(pause)

def begin(node):
    node.state.lock = threading.Lock()
    for _ in range(2):
        threading.Thread(target=work, args=(node,), daemon=True).start()

def work(node):
    while True:
        with node.state.lock:
            time.sleep(0.11)
            node.logger.info(f'works {len({str(each) for each in range(9)})}')
"""


def _create_system(seed):
    """Return nodes with timers of equal periods, relays, services and threads."""
    chance = random.Random(seed)
    pauses, nodes = [0.0, 0.0, 0.05, 0.3], {}
    services = [f'/service{number}' for number in range(2)]
    for number in range(chance.randint(2, 5)):
        node = nodes[f'n{number}'] = defaultdict(dict)
        if chance.random() < 0.3:
            node['on_start'] = 'parts:begin'
        for each in range(chance.randint(1, 3)):
            topic = f'/topic{chance.randrange(3)}'
            node['publishers'][f'p{each}'] = {'type': 'std_msgs/msg/String', 'topic': topic}
            node['timers'][f't{each}'] = {
                'period': chance.choice([0.1, 0.2, 0.25]),
                'group': chance.choice([f'g{each}', 'reentrant', 'shared']),
                'behaviour': 'parts:tick',
                'with': {'name': f'p{each}', 'pause': chance.choice(pauses)},
                'publish': f'p{each}',
            }
        for each in range(chance.randint(0, 3)):
            name = f's{each}'
            node['subscriptions'][name] = {
                'type': 'std_msgs/msg/String',
                'topic': f'/topic{chance.randrange(3)}',
                'qos': {'depth': chance.choice([1, 3, 100])},
                'group': chance.choice([name, 'shared']),
                'behaviour': 'parts:hear',
                'with': {'name': f'n{number}.{name}', 'pause': chance.choice(pauses)},
            }
        if chance.random() < 0.5:
            service = chance.choice(services)
            node['service_clients'][service] = 'std_srvs/srv/Trigger'
            node['timers']['ask'] = {
                'period': 0.5, 'behaviour': 'parts:ask', 'with': {'name': service}
            }  # fmt: skip
    for number, service in enumerate(services):
        nodes[f'server{number}'] = {
            'services': {
                service: {
                    'type': 'std_srvs/srv/Trigger',
                    'behaviour': 'parts:answer',
                    'with': {'pause': chance.choice(pauses)},
                }
            }
        }
    return yaml.safe_dump({'nodes': {name: dict(node) for name, node in nodes.items()}})


def test_a_random_system_is_repeatable_and_keeps_orders(simulate):
    text = _create_system(0)
    for shuffle in (None, 1):
        first, again = (_run(simulate, text, shuffle) for _ in range(2))
        assert [render_event(each) for each in first] == [render_event(each) for each in again]
        assert [each.time_ns for each in first] == sorted(each.time_ns for each in first)
        _check_order(first)


def _run(simulate, text, shuffle):
    with simulate(text, CODE, is_shuffled=shuffle is not None, seed=shuffle or 0) as system:
        system.forward(1.2)
    assert not [each for each in system.events if each.kind == 'error']
    return system.events


def _check_order(events):
    """Check that each subscription heard what a publisher has published in that order."""
    heard = defaultdict(list)
    published = defaultdict(list)
    for event in events:
        if event.kind == 'log' and ' heard ' in event.value:
            name, text = event.value.split(' heard ')
            publisher, count = text.split()
            heard[name, publisher].append(int(count))
        elif event.kind == 'message' and event.name.startswith('/topic'):
            publisher, count = event.value.data.split()
            published[publisher].append(int(count))
    assert heard
    for (_, publisher), counts in heard.items():
        remaining = iter(published[publisher])
        assert all(count in remaining for count in counts)
