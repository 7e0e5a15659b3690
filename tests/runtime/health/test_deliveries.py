"""Which way each publisher and client delivers, and why, as `composer top` and `/diagnostics` say."""

import json

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Int32

from composer.cli.main import run

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
diagnostics: {period: 0.2}
nodes:
  mouth:
    publishers:
      near: {type: std_msgs/msg/Int32, local_delivery: true}
      kept: {type: std_msgs/msg/Int32, qos: {durability: transient_local}}
      nowhere: {type: std_msgs/msg/Int32, external: true}
    service_clients:
      ask: std_srvs/srv/Trigger
      far: {type: std_srvs/srv/Trigger, external: true}
    action_clients: {go: test_msgs/action/Fibonacci}
    timers:
      say: {rate: 50, behaviour: parts:say}
      slow: {rate: 10, behaviour: parts:call}
  ear:
    subscriptions:
      near: {type: std_msgs/msg/Int32, behaviour: parts:hear}
      kept: {type: std_msgs/msg/Int32, behaviour: parts:hear}
    services:
      ask: {type: std_srvs/srv/Trigger, behaviour: parts:answer}
    actions: {go: {type: test_msgs/action/Fibonacci, behaviour: parts:go}}
"""
CODE = """
def say(node):
    node.publish('near', 1)
    node.publish('kept', 1)

async def call(node):
    await node.call_async('ask')
    node.send_goal('go', {'order': 1})

def hear(node, message):
    pass

def go(node, goal):
    return [1]

def answer(node, request):
    return {'success': True, 'message': ''}
"""


def test_the_way_and_the_rate_are_told_and_change_in_place(compose, peer, wait_for, capsys):
    child = compose(SYSTEM, CODE)
    child.wait_until_ready()
    heard = peer.listen(DiagnosticArray, '/diagnostics', 100)

    def deliveries():
        assert run(['top', '--once', '--format', 'json']) == 0
        entities = json.loads(capsys.readouterr()[0])['entities']
        return {
            each['name']: (each['delivery'], each['delivery_reason'])
            for each in entities
            if each['delivery'] is not None
        }

    def status(name):
        statuses = [each for message in list(heard) for each in message.status]
        return next((each.message for each in reversed(statuses) if each.name == name), '')

    assert deliveries() == {
        'near': ('local', ''),
        'kept': ('sent', 'durability: transient_local'),
        'nowhere': ('', ''),
        'ask': ('local', ''),
        'far': ('sent', 'its server is outside'),
        'go': ('local', ''),
    }

    def have_rates():
        assert run(['top', '--once', '--format', 'json']) == 0
        rates = {
            each['name']: each['rate_hz']
            for each in json.loads(capsys.readouterr()[0])['entities']
            if each['delivery'] is not None
        }
        none = {each for each, rate in rates.items() if rate == 0.0}
        return none == {'nowhere', 'far'} and min(rates['near'], rates['kept']) > rates['ask']

    wait_for(have_rates, 'the rates')
    near = '/mouth: publisher near'
    wait_for(lambda: status(near) == 'local', 'the way in diagnostics')
    assert status('/mouth: service client ask') == 'local'
    peer.listen(Int32, '/near', 10)
    wait_for(lambda: deliveries()['near'] == ('sent', '1 subscription outside'), 'the other way')
    wait_for(lambda: status(near) == 'sent, 1 subscription outside', 'it in diagnostics')
    assert run(['top', '--once']) == 0
    assert '  sent, 1 subscription outside\n' in capsys.readouterr()[0]
    path = compose.folder / 'system.yaml'
    path.write_text(path.read_text().replace('local_delivery: true', 'local_delivery: false'))
    assert run(['reload']) == 0
    assert '~1 publisher' in capsys.readouterr()[0]
    assert deliveries()['near'] == ('sent', 'local_delivery: false')


def test_how_long_messages_were_on_their_way_is_told_while_somebody_looks(
    compose, wait_for, capsys
):
    # Those of either way wait for a callback that takes longer than the period.
    slow = CODE.replace('    pass\n', '    time.sleep(0.05)\n')
    child = compose(SYSTEM, 'import time\n' + slow)
    child.wait_until_ready()

    def times():
        assert run(['top', '--once', '--format', 'json']) == 0
        return {
            (each['kind'], each['name']): (each['delivery_p50_ms'], each['delivery_p99_ms'])
            for each in json.loads(capsys.readouterr()[0])['entities']
        }

    def are_known():
        near, kept = (times()['subscription', name] for name in ('near', 'kept'))
        return None not in near + kept and near[1] >= near[0] > 20 and kept[1] >= kept[0] > 20

    wait_for(are_known, 'the times')
    assert times()['timer', 'say'] == times()['publisher', 'near'] == (None, None)
