"""Nodes with a lifecycle: their transitions are those of rclpy's, and so are services and events."""

from itertools import cycle, product

import pytest

pytest.importorskip('rclpy')

from lifecycle_msgs.msg import State, Transition, TransitionEvent
from lifecycle_msgs.srv import (
    ChangeState,
    GetAvailableStates,
    GetAvailableTransitions,
    GetState,
)
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

pytestmark = pytest.mark.ros

CODE = """
import time
from pathlib import Path

OUTCOMES = {'ok': lambda: None, 'true': lambda: True, 'failure': lambda: False}

def do(node, what):
    node.logger.info(f'{what} is called')
    outcome = getattr(node.parameters, what)
    if outcome == 'error':
        raise OSError('no such device')
    return OUTCOMES[outcome]()

async def do_later(node, what):
    return do(node, what)

def wait_long(node):
    node.logger.info('begins')
    while not Path('go').exists():
        time.sleep(0.01)

def tick(node):
    node.logger.info('tick')

def begin(node):
    node.logger.info('begins')
"""
BEHAVIOURS = ('on_configure', 'on_activate', 'on_deactivate', 'on_cleanup', 'on_error_state')
SYSTEM = """
version: 1
nodes:
  camera:
    lifecycle: true
    parameters: {%s}
%s
"""
CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE = (
    Transition.TRANSITION_CONFIGURE,
    Transition.TRANSITION_CLEANUP,
    Transition.TRANSITION_ACTIVATE,
    Transition.TRANSITION_DEACTIVATE,
)
# What leads to the state from which a transition begins.
BEFORE = {
    'on_configure': [],
    'on_activate': [CONFIGURE],
    'on_deactivate': [CONFIGURE, ACTIVATE],
    'on_cleanup': [CONFIGURE],
}
OWN = {
    'on_configure': CONFIGURE,
    'on_activate': ACTIVATE,
    'on_deactivate': DEACTIVATE,
    'on_cleanup': CLEANUP,
}
CASES = [
    ('on_configure', 'true', 'ok'),
    *product(OWN, ('failure', 'error'), ['ok']),
    ('on_cleanup', 'ok', 'ok'),
    # This one is final.
    ('on_deactivate', 'error', 'failure'),
]


class Reference(LifecycleNode):
    """A node of rclpy whose callbacks end as `outcomes` says."""

    outcomes: dict

    def _end(self, key):
        return {
            'failure': TransitionCallbackReturn.FAILURE,
            'error': TransitionCallbackReturn.ERROR,
        }.get(self.outcomes.get(key), TransitionCallbackReturn.SUCCESS)

    def on_configure(self, state):
        return self._end('on_configure')

    def on_activate(self, state):
        return self._end('on_activate')

    def on_deactivate(self, state):
        return self._end('on_deactivate')

    def on_cleanup(self, state):
        return self._end('on_cleanup')

    def on_error(self, state):
        # To raise there is to fail, and no error again.
        outcome = self._end('on_error_state')
        good = TransitionCallbackReturn.SUCCESS
        return outcome if outcome == good else TransitionCallbackReturn.FAILURE


def state_of(peer, node):
    return peer.call(GetState, f'{node}/get_state').current_state


def described(event):
    return event.start_state.label, event.goal_state.label


def declare():
    # Every other one is async.
    lines = [
        f"    {key}: {{behaviour: 'parts:{function}', with: {{what: {key}}}}}"
        for key, function in zip(BEHAVIOURS, cycle(('do', 'do_later')))
    ]
    return SYSTEM % (', '.join(f'{key}: ok' for key in BEHAVIOURS), '\n'.join(lines))


def test_every_outcome_leads_where_it_does_with_rclpy(compose, peer, wait_for):
    child = compose(declare(), CODE)
    child.wait_until_ready()
    reference = peer.run(Reference, 'reference', context=peer.context, use_global_arguments=False)
    peer.run(peer._executor.add_node, reference)
    for kind, service in (
        (GetAvailableStates, 'get_available_states'),
        (GetAvailableTransitions, 'get_available_transitions'),
        (GetAvailableTransitions, 'get_transition_graph'),
    ):
        ours, theirs = (peer.call(kind, f'{node}/{service}') for node in ('camera', 'reference'))
        assert ours == theirs
    events = [
        peer.listen(TransitionEvent, f'/{node}/transition_event')
        for node in ('camera', 'reference')
    ]
    for key, outcome, handled in CASES:
        outcomes = {key: outcome, 'on_error_state': handled}
        _set(peer, outcomes)
        reference.outcomes = outcomes
        for transition in [*BEFORE[key], OWN[key]]:
            ours, theirs = (peer.transition(node, transition) for node in ('camera', 'reference'))
            assert ours == theirs, (key, outcome)
            assert state_of(peer, 'camera') == state_of(peer, 'reference'), (key, outcome)
        _set(peer, dict.fromkeys(outcomes, 'ok'))
        reference.outcomes = {}
        _lead_back(peer)
    wait_for(lambda: len(events[0]) == len(events[1]) > 0, 'the last event')
    assert [*map(described, events[0])] == [*map(described, events[1])]
    peer.run(peer._executor.remove_node, reference)
    peer.run(reference.destroy_node)
    assert child.stop() == 0


def _set(peer, values):
    from rcl_interfaces.srv import SetParameters
    from rclpy.parameter import Parameter

    changes = [Parameter(key, value=value).to_parameter_msg() for key, value in values.items()]
    peer.call(SetParameters, 'camera/set_parameters', parameters=changes)


def _lead_back(peer):
    """Bring both nodes back to unconfigured, unless they are finalized."""
    ways = {State.PRIMARY_STATE_ACTIVE: DEACTIVATE, State.PRIMARY_STATE_INACTIVE: CLEANUP}
    for node in ('camera', 'reference'):
        while (state := state_of(peer, node).id) in ways:
            assert peer.transition(node, ways[state])


def test_a_transition_may_take_long_and_another_is_refused_meanwhile(compose, peer, wait_for):
    text = """
        version: 1
        nodes:
          camera:
            lifecycle: true
            on_configure: parts:wait_long
            on_deactivate: parts:begin
            warn_after: null
          other:
            timers: {tick: {period: 0.02, behaviour: 'parts:tick'}}
    """
    child = compose(text, CODE)
    child.wait_until_ready()
    client = peer.run(peer.node.create_client, ChangeState, 'camera/change_state')
    assert client.wait_for_service(20.0)
    wait_for(lambda: state_of(peer, 'camera').label == 'unconfigured', 'the state')
    pending = client.call_async(ChangeState.Request(transition=Transition(label='configure')))
    child.wait_for_line('[camera]: begins')
    assert state_of(peer, 'camera').label == 'configuring'
    assert not peer.transition('camera', CONFIGURE)
    child.wait_for_line('is configuring: no other transition begins until that ends')
    child.wait_for_line('[other]: tick', times=len(child.matching('[other]: tick')) + 5)
    assert not pending.done()
    (compose.folder / 'go').touch()
    wait_for(pending.done, 'the response')
    assert pending.result().success
    # From inactive nothing is deactivated, and whoever asks is told so.
    assert not peer.transition('camera', DEACTIVATE)
    assert not child.matching('[INFO] [camera]: begins')[1:]
    assert state_of(peer, 'camera').label == 'inactive'


def test_the_stop_leads_the_way_down(compose):
    lines = '\n'.join(
        f"            {key}: {{behaviour: 'parts:do', with: {{what: {key}}}}}"
        for key in (*BEHAVIOURS, 'on_stop')
    )
    text = f"""
        version: 1
        nodes:
          camera:
            lifecycle: {{start: active}}
            parameters: {{{', '.join(f'{key}: ok' for key in (*BEHAVIOURS, 'on_stop'))}}}
{lines}
    """
    child = compose(text, CODE)
    child.wait_until_ready()
    assert child.stop() == 0
    called = [line.split()[-3] for line in child.matching('is called')]
    assert called == ['on_configure', 'on_activate', 'on_deactivate', 'on_cleanup', 'on_stop']


def test_a_node_that_cannot_start_active_ends_the_start(compose):
    text = """
        version: 1
        nodes:
          camera:
            lifecycle: {start: active}
            parameters: {on_activate: failure, on_cleanup: ok}
            on_activate: {behaviour: 'parts:do', with: {what: on_activate}}
            on_cleanup: {behaviour: 'parts:do', with: {what: on_cleanup}}
    """
    child = compose(text, CODE)
    assert child.wait() == 1
    assert "error: node 'camera': on_activate returned False" in child.output
    assert child.matching('on_cleanup is called')
