"""A host that was cut off is in the graph again, by its names, too."""

import pytest

from tests.network.test_across_hosts import CODE, SYSTEM
from tests.network_namespaces import needs_namespaces, takes_long

# Fast DDS takes a participant for gone after 20 s.
LONGER_SEC = 30
NAMES = """
    import json, rclpy, time
    rclpy.init()
    node = rclpy.create_node('observer')
    time.sleep(2)
    print(json.dumps(node.get_node_names()))
"""

pytestmark = [pytest.mark.ros, needs_namespaces, takes_long]


@pytest.mark.parametrize('how', [('cut', 'mend'), ('take_down', 'bring_up')])
@pytest.mark.parametrize(
    'network',
    [{'discovery': 'peers'}, {'discovery': 'discovery_server', 'server': 'base'}],
    ids=['peers', 'discovery_server'],
)
def test_a_host_that_was_gone_is_found_again(create_hosts, network, how):
    hosts = create_hosts('base', 'jetson')
    hosts.write(SYSTEM, CODE, **network)
    base, jetson = hosts.up('base'), hosts.up('jetson')
    base.wait_for('saw', times=3)
    getattr(hosts['jetson'], how[0])()
    base.wait_for("host 'jetson' is gone: '/image' has no publisher")
    getattr(hosts['jetson'], how[1])()
    base.wait_for("host 'jetson' is there again")
    heard = base.count('saw')
    base.wait_for('saw', times=heard + 3)
    for part in (base, jetson):
        assert part.count(' ready in ') == 1
        assert part.stop() == 0
