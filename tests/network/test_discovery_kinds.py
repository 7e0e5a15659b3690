"""Systems on two hosts find each other by each kind of discovery."""

import pytest

from tests.network_namespaces import needs_namespaces

SYSTEM = """
    version: 1
    nodes:
      camera:
        host: jetson
        publishers: {image: std_msgs/msg/Int32}
        timers: {take: {period: 0.1, behaviour: parts:take, publish: image}}
        services: {focus: {type: std_srvs/srv/Trigger, behaviour: parts:focus}}
      viewer:
        host: base
        wait_for: [{node: camera}, {topic: /image}, {service: /focus}]
        subscriptions: {image: {type: std_msgs/msg/Int32, behaviour: parts:see}}
"""
CODE = """
    def take(node):
        node.state.count = getattr(node.state, 'count', 0) + 1
        return node.state.count


    def focus(node, request):
        return {'success': True, 'message': ''}


    def see(node, message):
        node.logger.info(f'saw {message.data}')
"""
# What this network does not carry.
OTHERS = {
    'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
    'ROS_DISCOVERY_SERVER': '10.99.99.99:11811',
}

pytestmark = [pytest.mark.ros, needs_namespaces]


@pytest.mark.parametrize(
    ('network', 'forwards_multicast'),
    [
        ({'discovery': 'multicast', 'domain_id': 141}, True),
        ({'discovery': 'discovery_server', 'server': 'base'}, False),
    ],
    ids=['multicast', 'discovery_server'],
)
def test_a_node_waits_for_one_on_another_host_and_hears_it(
    create_hosts, network, forwards_multicast
):
    hosts = create_hosts('base', 'jetson', forwards_multicast=forwards_multicast)
    hosts.write(SYSTEM, CODE, **network)
    base, jetson = hosts.up('base', **OTHERS), hosts.up('jetson', **OTHERS)
    base.wait_for('saw', times=3)
    assert (jetson.stop(), base.stop()) == (0, 0)


@pytest.mark.long
def test_a_discovery_server_that_was_killed_is_there_again(create_hosts):
    """Who is there already, and who comes then, find each other by it."""
    hosts = create_hosts('base', 'jetson')
    hosts.write(SYSTEM, CODE, discovery='discovery_server', server='base')
    base, jetson = hosts.up('base'), hosts.up('jetson')
    base.wait_for('saw', times=3)
    hosts['base'].kill('fast-discovery-server')
    base.wait_for('Server is running', times=2)
    assert jetson.stop() == 0
    jetson = hosts.up('jetson')
    jetson.wait_for(' ready in ')
    heard = base.count('saw')
    base.wait_for('saw', times=heard + 3)


@pytest.mark.long
@pytest.mark.parametrize('kind', ['peers', 'discovery_server'])
def test_three_hosts_hear_all_others(create_hosts, kind):
    names = ['base', 'jetson', 'arm']
    hosts = create_hosts(*names)
    nodes = ''.join(
        f"""
      node_{name}:
        host: {name}
        publishers: {{said: {{type: std_msgs/msg/String, topic: /said}}}}
        timers: {{speak: {{period: 0.5, behaviour: parts:speak, publish: said}}}}
        subscriptions: {{heard: {{type: std_msgs/msg/String, topic: /said, behaviour: parts:hear}}}}"""
        for name in names
    )
    code = """
    def speak(node):
        return node.name


    def hear(node, message):
        node.logger.info(f'heard {message.data}.')
    """
    hosts.write(f'\n    version: 1\n    nodes:{nodes}\n', code, discovery=kind, server='base')
    parts = [hosts.up(name) for name in names]
    for part in parts:
        for name in names:
            part.wait_for(f'heard node_{name}.')
    assert [part.stop() for part in parts] == [0] * len(parts)
