"""Hosts that cannot find each other are found; all other networks are left alone."""

from textwrap import dedent

import pytest
import yaml

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

RULES = ('no-network-path', 'conflicting-domains', 'ephemeral-ports')
NODES = """
    camera:
      host: jetson
      publishers: {image: std_msgs/msg/String}
      timers: {take: {period: 1, publish: image, message: {data: seen}}}
    viewer: {host: base, subscriptions: {image: {type: std_msgs/msg/String}}}
"""
HOSTS = {'base': {'address': '10.0.0.1'}, 'jetson': {'address': '10.0.0.2'}}
LOCAL = {'base': {'address': '127.0.0.1'}, 'jetson': {'address': '10.0.0.2'}}
SERVED = {'discovery': 'discovery_server', 'server': 'base'}


@pytest.fixture
def find(tmp_path):
    def find(network, hosts, environment, *, nodes=NODES):
        system = {'version': 1, 'nodes': yaml.safe_load(dedent(nodes)), 'hosts': hosts}
        system |= {'network': network} if network else {}
        system |= {'environment': environment} if environment else {}
        path = tmp_path / 'robot.yaml'
        path.write_text(yaml.safe_dump(system, sort_keys=False))
        found = check_system(load_system(path), InterfaceCatalogue())
        return [
            (each.rule, each.message.partition(',')[0]) for each in found if each.rule in RULES
        ]

    return find


@pytest.mark.parametrize(
    ('network', 'hosts', 'environment', 'message'),
    [
        (None, HOSTS, {'ROS_LOCALHOST_ONLY': '1'}, 'with ROS_LOCALHOST_ONLY=1 no host finds'),
        ('multicast', HOSTS, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}, 'with ROS_AUTO'),
        ('peers', HOSTS, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF'}, 'with ROS_AUTOMATIC'),
        ('peers', LOCAL, {}, "'127.0.0.1' is another computer on each host"),
        (SERVED, LOCAL, {}, "'127.0.0.1' is another computer on each host"),
        ('discovery_server', HOSTS, {}, "no host is named for the server of 'discovery_server'"),
        (SERVED, HOSTS, {'RMW_IMPLEMENTATION': 'rmw_zenoh_cpp'}, "'discovery_server' is of rmw_f"),
        ({'discovery': 'zenoh'}, HOSTS, {}, "no host is named for the server of 'zenoh'"),
    ],
)
def test_hosts_that_cannot_find_each_other_are_found(find, network, hosts, environment, message):
    ((rule, found),) = find(network, hosts, environment)
    assert rule == 'no-network-path'
    assert found.startswith(message)


@pytest.mark.parametrize(
    ('network', 'hosts', 'environment'),
    [
        (None, HOSTS, {}),
        ('multicast', LOCAL, {}),
        ('peers', HOSTS, {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}),
        (SERVED, HOSTS, {'RMW_IMPLEMENTATION': 'rmw_fastrtps_cpp', 'ROS_LOCALHOST_ONLY': '0'}),
        ({'discovery': 'discovery_server', 'server': 'jetson'}, LOCAL, {}),
        ({'domain_id': 101}, HOSTS, {'ROS_DOMAIN_ID': '101'}),
        ({'domain_id': 230}, HOSTS, {}),
    ],
)
def test_networks_that_work_are_left_alone(find, network, hosts, environment):
    assert find(network, hosts, environment) == []


def test_nothing_is_said_where_nothing_crosses(find):
    nodes = NODES.replace('jetson', 'base')
    assert find('peers', LOCAL, {'ROS_LOCALHOST_ONLY': '1'}, nodes=nodes) == []


def test_one_domain_is_said_once(find):
    assert [rule for rule, _ in find({'domain_id': 120}, HOSTS, {'ROS_DOMAIN_ID': '7'})] == [
        'conflicting-domains',
        'ephemeral-ports',
    ]
