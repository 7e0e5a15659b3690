"""A message belongs to who has it, whatever the others do with theirs."""

import json
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from tests.runtime.messages import mutating_behaviours
from tests.runtime.messages.mutating_behaviours import AUDIENCES, CASES

pytestmark = pytest.mark.ros

READERS = {'read', 'read_on'}


def create_node(name, message_class, audience):
    """Return a node that publishes the messages of a case, and subscribes to them."""
    package, _, _ = message_class.__module__.partition('.')
    entity = {'type': f'{package}/msg/{message_class.__name__}', 'topic': '~/out'}
    relayed = entity | {'topic': '~/relayed'}
    subscriptions = {
        who: (relayed if who == 'write_relayed' else entity)
        | {'behaviour': f'parts:{who}', 'read_only': who in READERS}
        | ({'publish': 'relayed'} if who == 'read_on' else {})
        for who in audience
    }
    subscriptions['go'] = {
        'type': 'std_msgs/msg/Float64',
        'topic': '/go',
        'behaviour': f'parts:{name}',
        'publish': 'out',
    }
    publishers = {'out': entity, 'other': entity | {'topic': '~/other'}, 'relayed': relayed}
    return {'publishers': publishers, 'subscriptions': subscriptions}


def test_nobody_sees_the_changes_of_others(compose):
    nodes = {
        f'{name}_{number}': create_node(name, message_class, audience)
        for name, message_class in CASES.items()
        for number, audience in enumerate(AUDIENCES)
    }
    nodes['conductor'] = {
        'publishers': {'go': 'std_msgs/msg/Float64'},
        'timers': {'conduct': {'rate': 100, 'behaviour': 'parts:conduct', 'publish': 'go'}},
    }
    defaults = {'parameter_services': False, 'rosout': False}
    system = {'version': 1, 'defaults': defaults, 'nodes': nodes}
    code = Path(mutating_behaviours.__file__).read_text()

    child = compose(json.dumps(system), code)
    # To create so many nodes takes a while of its own.
    child.wait_until_ready()

    told = child.wait_for_line('[conductor]: ')
    assert told.endswith(': found []')
    assert child.stop() == 0
