"""What `network:` sets in the environment of each host."""

from dataclasses import replace

import pytest
import yaml

from composer.language.pipeline import load_system
from composer.network.servers import used_hosts, with_servers
from composer.network.variables import clear_others, drop_unknown_peers, ros_variables

INVENTORY = {
    'base': {'address': '10.0.0.1'},
    'jetson': {'address': '10.0.0.2'},
    'arm': {'address': 'arm.local'},
}
OF_SERVER = {'ROS_SUPER_CLIENT': 'TRUE'}


@pytest.fixture
def load(tmp_path):
    def load(network, **more):
        path = tmp_path / 'robot.yaml'
        path.write_text(
            yaml.safe_dump(
                {'version': 1, 'network': network, 'nodes': {}, **more}, sort_keys=False
            )
        )
        system = load_system(path)
        assert not system.diagnostics
        return system.spec

    return load


@pytest.mark.parametrize(
    ('network', 'host', 'expected'),
    [
        ('multicast', 'base', {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}),
        (
            {'peers': ['10.9.9.9']},
            'base',
            {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'ROS_STATIC_PEERS': '10.9.9.9'},
        ),
        (
            'peers',
            'base',
            {
                'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
                'ROS_STATIC_PEERS': '10.0.0.2;arm.local',
            },
        ),
        (
            {'discovery': 'peers', 'peers': ['10.9.9.9', 'arm.local'], 'domain_id': 7},
            'jetson',
            {
                'ROS_DOMAIN_ID': '7',
                'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
                'ROS_STATIC_PEERS': '10.0.0.1;arm.local;10.9.9.9',
            },
        ),
        (
            {'discovery': 'discovery_server', 'server': 'base'},
            'jetson',
            {'ROS_DISCOVERY_SERVER': '10.0.0.1:11811', **OF_SERVER},
        ),
        (
            {'discovery': 'discovery_server', 'server': 'base', 'port': 9000},
            'base',
            {'ROS_DISCOVERY_SERVER': '127.0.0.1:9000', **OF_SERVER},
        ),
        (
            {'discovery': 'zenoh', 'server': 'base'},
            'jetson',
            {'RMW_IMPLEMENTATION': 'rmw_zenoh_cpp'},
        ),
        (
            {'discovery': 'zenoh', 'server': 'base', 'port': 9000},
            'jetson',
            {
                'RMW_IMPLEMENTATION': 'rmw_zenoh_cpp',
                'ZENOH_CONFIG_OVERRIDE': 'connect/endpoints=["tcp/localhost:9000"]',
            },
        ),
    ],
)
def test_each_kind_of_discovery_has_its_variables(load, network, host, expected):
    spec = load(network, hosts=INVENTORY)
    assert ros_variables(spec.on_host(host)) == expected


@pytest.mark.parametrize('kind', ['multicast', 'peers', 'discovery_server', 'zenoh'])
def test_a_whole_system_on_one_computer_needs_its_domain_alone(load, kind):
    network = {'discovery': kind, 'server': 'base', 'domain_id': 7}
    spec = load(network, hosts=INVENTORY)
    assert ros_variables(spec) == {'ROS_DOMAIN_ID': '7'}
    assert with_servers(spec).processes == {}


def test_the_environment_of_the_file_comes_first(load):
    spec = load({'domain_id': 7}, environment={'ROS_DOMAIN_ID': 5, 'MINE': 'x'})
    assert ros_variables(spec) == {'ROS_DOMAIN_ID': '5', 'MINE': 'x'}


def test_what_the_shell_says_of_discovery_counts_no_more():
    shell = {'ROS_DISCOVERY_SERVER': 'elsewhere:1', 'ROS_LOCALHOST_ONLY': '1', 'HOME': '/root'}
    variables = {'ROS_DISCOVERY_SERVER': 'here:2'}
    assert clear_others(variables, shell) == {
        'ROS_DISCOVERY_SERVER': 'here:2',
        'ROS_LOCALHOST_ONLY': '',
    }


def test_peers_whose_names_are_unknown_are_left_out():
    peers = {'ROS_STATIC_PEERS': '127.0.0.1;no-such-host.invalid;localhost'}
    assert drop_unknown_peers(peers) == (
        {'ROS_STATIC_PEERS': '127.0.0.1;localhost'},
        ['no-such-host.invalid'],
    )
    assert drop_unknown_peers({'MINE': 'x'}) == ({'MINE': 'x'}, [])


def test_the_server_runs_on_its_host_alone_and_always_again(load):
    spec = load({'discovery': 'discovery_server', 'server': 'base', 'port': 9}, hosts=INVENTORY)
    parts = {name: with_servers(spec.on_host(name)).processes for name in INVENTORY}
    assert {name: list(each) for name, each in parts.items()} == {
        'base': ['discovery_server'],
        'jetson': [],
        'arm': [],
    }
    server = parts['base']['discovery_server']
    assert server.command[1:] == ('-m', 'composer.network.discovery_server', '9')
    assert (server.restart, server.most_restarts, server.host) == ('always', None, 'base')


@pytest.mark.parametrize(
    ('kind', 'expected'), [('discovery_server', {'base', 'arm'}), ('multicast', {'arm'})]
)
def test_a_host_with_a_server_alone_is_used(load, kind, expected):
    processes = {'drive': {'command': ['true'], 'host': 'arm'}}
    network = {'discovery': kind, 'server': 'base'}
    assert used_hosts(load(network, hosts=INVENTORY, processes=processes)) == expected


def test_each_host_has_a_router_of_zenoh_that_connects_to_the_one_of_the_server(load):
    spec = load({'discovery': 'zenoh', 'server': 'base'}, hosts=INVENTORY)
    routers = {
        name: with_servers(spec.on_host(name)).processes['zenoh_router'].env for name in INVENTORY
    }
    listens = 'listen/endpoints=["tcp/[::]:7447"]'
    connects = listens + ';connect/endpoints=["tcp/10.0.0.1:7447"]'
    assert routers == {
        'base': {'ZENOH_CONFIG_OVERRIDE': listens},
        'jetson': {'ZENOH_CONFIG_OVERRIDE': connects},
        'arm': {'ZENOH_CONFIG_OVERRIDE': connects},
    }


def test_a_process_of_the_file_keeps_its_name(load):
    own = {'discovery_server': {'command': ['true'], 'host': 'base'}}
    network = {'discovery': 'discovery_server', 'server': 'base'}
    spec = load(network, hosts=INVENTORY, processes=own).on_host('base')
    processes = with_servers(spec).processes
    assert processes['discovery_server'] == spec.processes['discovery_server']
    assert list(processes) == ['discovery_server_', 'discovery_server']


def test_a_part_without_a_network_stays_as_it_is(load):
    spec = replace(load('multicast', hosts=INVENTORY), network=None).on_host('base')
    assert with_servers(spec) is spec
    assert ros_variables(spec) == {}


def test_the_server_is_told_when_it_is_not_installed(monkeypatch, tmp_path):
    from composer.network import discovery_server

    monkeypatch.setattr(discovery_server, 'ament_prefixes', lambda: [tmp_path])
    assert discovery_server.main('11811') == (
        f'there is no fast-discovery-server of Fast DDS in {tmp_path}'
    )


def test_the_server_of_wheels_finds_its_libraries(tmp_path):
    from composer.network.discovery_server import find_variables

    variables = find_variables(tmp_path / 'bin/fast-discovery-server')
    assert variables['LD_LIBRARY_PATH'].split(':')[0] == f'{tmp_path}/lib'
