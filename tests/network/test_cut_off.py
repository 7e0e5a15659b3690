"""A host that was cut off is in the graph again, by its names, too."""

import pytest

from tests.network.test_discovery_kinds import CODE, OTHERS, SYSTEM
from tests.network_namespaces import needs_namespaces

# With these, Fast DDS takes a participant for gone after 4 s instead of 20.
SHORT_LEASE = """<?xml version="1.0" encoding="UTF-8"?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <participant profile_name="short_lease" is_default_profile="true">
    <rtps><builtin><discovery_config>
      <leaseDuration><sec>4</sec></leaseDuration>
      <leaseAnnouncement><sec>1</sec></leaseAnnouncement>
    </discovery_config></builtin></rtps>
  </participant>
</profiles>
"""

pytestmark = [pytest.mark.ros, needs_namespaces]


def check_return(hosts, how, base, jetson):
    """Cut a host off until the other says that it is gone; check that all is as it was then."""
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


def test_a_part_waits_for_a_network_and_is_found_again_when_it_was_gone(create_hosts, tmp_path):
    hosts = create_hosts('base', 'jetson')
    hosts.write(SYSTEM, CODE, discovery='peers')
    profiles = tmp_path / 'short_lease.xml'
    profiles.write_text(SHORT_LEASE)
    environment = {**OTHERS, 'FASTRTPS_DEFAULT_PROFILES_FILE': str(profiles)}
    hosts['jetson'].take_down()
    base, jetson = hosts.up('base', **environment), hosts.up('jetson', **environment)
    jetson.wait_for('network: no interface is up; the start waits for one')
    assert not jetson.count(' ready in ')
    hosts['jetson'].bring_up()
    check_return(hosts, ('cut', 'mend'), base, jetson)


@pytest.mark.long
@pytest.mark.parametrize(
    ('network', 'how'),
    [
        ({'discovery': 'peers'}, ('cut', 'mend')),
        ({'discovery': 'discovery_server', 'server': 'base'}, ('take_down', 'bring_up')),
    ],
    ids=['peers', 'discovery_server'],
)
def test_a_host_is_found_again_with_the_usual_leases(create_hosts, network, how):
    hosts = create_hosts('base', 'jetson')
    hosts.write(SYSTEM, CODE, **network)
    check_return(hosts, how, hosts.up('base'), hosts.up('jetson'))
