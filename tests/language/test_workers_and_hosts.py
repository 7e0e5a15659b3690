"""Where nodes and processes run: workers, hosts and the network as files say it."""

import json
from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from composer.cli.main import run
from composer.language.pipeline import load_system, load_system_text

INVENTORY = """
    hosts:
      jetson: {address: 10.0.0.2, user: robot, port: 2222, identity_file: keys/robot}
      base: {}
    network: {discovery: discovery_server, server: base, peers: [10.0.0.9]}
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Read `robot.yaml` beside other files; there must be nothing wrong with them."""
    monkeypatch.chdir(tmp_path)

    def load(*set_values, layers=(), words=None, **texts):
        for name, text in texts.items():
            Path(f'{name}.yaml').write_text(dedent(text))
        paths = [Path(f'{each}.yaml') for each in layers]
        system = load_system(Path('robot.yaml'), words, layers=paths, set_values=set_values)
        assert [each.message for each in system.diagnostics] == []
        return system.spec

    return load


def places(spec):
    return {node.name: (node.worker, node.host) for node in spec.nodes.values()}


# What the file says, beside `arm.yaml` with its own words; where `here` and `inner` run.
PLACES = [
    ('nodes: {here: {}}', '', {'here': ('', '')}),
    ('nodes: {here: {worker: a, host: x}}', '', {'here': ('a', 'x')}),
    ('defaults: {worker: a}\nnodes: {here: {worker: ""}}', '', {'here': ('', '')}),
    ('workers: {a: {host: x}}\nnodes: {here: {worker: a}}', '', {'here': ('a', 'x')}),
    # The nodes of a worker are together: what one of them says holds for the others.
    # A worker's own host goes before those of defaults and includes.
    (
        'defaults: {host: y}\nworkers: {a: {host: x}}\nnodes: {here: {worker: a}, there: {}}',
        '',
        {'here': ('a', 'x'), 'there': ('', 'y')},
    ),
    ('include: {arm: {file: arm.yaml}}', '', {'inner': ('', '')}),
    ('include: {arm: {file: arm.yaml, worker: a, host: x}}', '', {'inner': ('a', 'x')}),
    (
        'include: {arm: {file: arm.yaml, worker: a, host: x}}\nworkers: {a: {host: z}}',
        '',
        {'inner': ('a', 'z')},
    ),
    (
        'include: {arm: {file: arm.yaml}}\nworkers: {b: {host: z}}',
        'defaults: {worker: b, host: y}',
        {'inner': ('b', 'z')},
    ),
    (
        'defaults: {worker: a, host: x}\ninclude: {arm: {file: arm.yaml, worker: "", host: y}}',
        '',
        {'inner': ('', 'y')},
    ),
    # An included file declares workers, too; the file around it goes first.
    (
        'include: {arm: {file: arm.yaml, worker: a}}\nworkers: {a: {host: x}}',
        'workers: {a: {host: y}}',
        {'inner': ('a', 'x')},
    ),
]


@pytest.mark.parametrize(('robot', 'arm', 'expected'), PLACES)
def test_a_node_runs_where_it_or_what_is_around_it_says(load, robot, arm, expected):
    spec = load(robot=f'version: 1\n{robot}\n', arm=f'version: 1\n{arm}\nnodes: {{inner: {{}}}}\n')
    assert places(spec) == expected
    assert set(spec.workers) == {worker for worker, _ in expected.values() if worker}


@pytest.mark.parametrize(('robot', 'arm', 'expected'), PLACES)
def test_the_system_that_show_prints_runs_in_the_same_places(load, capsys, robot, arm, expected):
    texts = (f'version: 1\n{robot}\n', f'version: 1\n{arm}\nnodes: {{inner: {{}}}}\n')
    before = load(robot=texts[0], arm=texts[1])
    assert run(['show', 'robot.yaml']) == 0
    after = load(robot=capsys.readouterr().out)
    assert places(after) == places(before) == expected
    plain = [
        {name: replace(each, path=()) for name, each in spec.workers.items()}
        for spec in (before, after)
    ]
    assert plain[0] == plain[1]


def test_paths_and_values_of_an_inventory_hold_in_what_show_prints(load, capsys, tmp_path):
    load(robot='version: 1\nnodes: {here: {host: jetson}}\n', inventory=INVENTORY)
    assert run(['show', 'robot.yaml', 'inventory.yaml']) == 0
    printed = capsys.readouterr().out
    (tmp_path / 'elsewhere').mkdir()
    spec = load(robot=printed)
    assert spec.hosts['jetson'].identity_file == str(tmp_path / 'keys/robot')
    assert spec.network.peers == ('10.0.0.9',)


NAMES = st.sampled_from(['', 'a', 'b'])
ENTRIES = st.fixed_dictionaries({}, optional={'worker': NAMES, 'host': NAMES})


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    nodes=st.dictionaries(st.sampled_from('wxyz'), ENTRIES, min_size=1),
    workers=st.dictionaries(
        st.sampled_from('ab'), st.fixed_dictionaries({}, optional={'host': NAMES})
    ),
    defaults=ENTRIES,
)
def test_each_node_is_in_one_part(nodes, workers, defaults):
    data = {'version': 1, 'nodes': nodes, 'workers': workers, 'defaults': defaults}
    spec = load_system_text(json.dumps(data)).spec
    hosts, names = {each.host for each in spec.nodes.values()}, {'', *spec.workers}
    by_host = [name for host in hosts for name in spec.on_host(host).nodes]
    by_worker = [name for worker in names for name in spec.in_worker(worker).nodes]
    assert sorted(by_host) == sorted(by_worker) == sorted(nodes)
    for key, node in spec.nodes.items():
        # What a node says itself holds.
        assert node.worker == nodes[key].get('worker', defaults.get('worker', ''))
        if nodes[key].get('host'):
            assert node.host == nodes[key]['host']
        elif node.worker:
            assert node.host in (spec.workers[node.worker].host, defaults.get('host', ''))


def test_an_include_in_an_include_hands_on_where_its_nodes_run(load):
    spec = load(
        robot='version: 1\ninclude: {arm: {file: arm.yaml, host: x}}\nworkers: {a: {host: z}}\n',
        arm='version: 1\ninclude: {hand: {file: hand.yaml, worker: a}}\nnodes: {inner: {}}\n',
        hand='version: 1\nnodes: {finger: {}}\nprocesses: {driver: {command: [sleep]}}\n',
    )
    assert places(spec) == {'inner': ('', 'x'), 'finger': ('a', 'z')}
    assert spec.processes['driver'].host == 'x'


def test_what_files_say_of_one_worker_is_merged_key_by_key(load):
    spec = load(
        robot="""
            version: 1
            include: {left: {file: arm.yaml}, right: {file: arm.yaml, namespace: right}}
            workers: {arms: {cpus: [1], environment: {A: 1}}}
        """,
        arm="""
            version: 1
            workers: {arms: {cpus: [0], nice: 5}}
            nodes: {arm: {worker: arms}}
        """,
    )
    arms = spec.workers['arms']
    assert (arms.cpus, arms.nice, dict(arms.environment)) == ((1,), 5, {'A': '1'})
    system = load_system(Path('robot.yaml'))
    places = system.positions.values
    assert places['workers', 'arms', 'cpus'].source.name == 'robot.yaml'
    assert places['workers', 'arms', 'nice'].source.name == 'arm.yaml'


def test_processes_and_containers_run_on_the_host_of_the_defaults(load):
    spec = load(
        robot="""
            version: 1
            defaults: {host: base, worker: ignored}
            processes:
              plain: {command: [sleep, 1]}
              driver: {package: vendor, executable: camera, host: jetson}
            containers:
              images: {components: {rectify: {package: image_proc, plugin: X}}}
        """
    )
    hosts = {name: each.host for name, each in spec.processes.items()}
    assert hosts == {'plain': 'base', 'driver': 'jetson', 'images': 'base'}


def test_a_worker_says_how_its_process_runs(load):
    spec = load(
        robot="""
            version: 1
            workers:
              "eye{{ i }}":
                foreach: {i: [0, 1]}
                cpus: ["{{ i }}"]
              brain:
                {nice: 5, threads: 2, environment: {OMP: 1}, required: true, log_level: debug,
                 restart: {when: always, delay: 3, max: 2}}
            nodes:
              left: {worker: eye0}
              right: {worker: eye1}
              mind: {worker: brain}
              body: {worker: undeclared}
        """
    )
    assert {name: each.cpus for name, each in spec.workers.items() if each.cpus} == {
        'eye0': (0,),
        'eye1': (1,),
    }
    brain = spec.workers['brain']
    assert (brain.nice, brain.threads, dict(brain.environment)) == (5, 2, {'OMP': '1'})
    assert (brain.required, brain.log_level) == (True, 'debug')
    assert (brain.restart, brain.restart_delay_sec, brain.most_restarts) == ('always', 3.0, 2)
    undeclared = spec.workers['undeclared']
    assert (undeclared.restart, undeclared.most_restarts, undeclared.required) == (
        'on_failure',
        None,
        False,
    )
    assert undeclared.path == ('nodes', 'body', 'worker')


def test_an_inventory_is_a_layer_of_its_own(load):
    spec = load(
        robot='version: 1\nnodes: {here: {host: jetson}}\n',
        inventory=INVENTORY,
        layers=['inventory'],
    )
    jetson, base = spec.hosts['jetson'], spec.hosts['base']
    assert (jetson.address, jetson.user, jetson.port) == ('10.0.0.2', 'robot', 2222)
    assert jetson.identity_file == 'keys/robot'
    assert (base.address, base.user, base.port, base.python) == ('base', '', None, 'python3')
    assert (base.folder, base.systemd) == ('~/.local/share/composer', 'user')
    network = spec.network
    assert (network.discovery, network.server, network.port) == ('discovery_server', 'base', 11811)
    assert (network.peers, network.domain_id) == (('10.0.0.9',), None)


def test_a_system_has_a_part_for_each_host_and_each_worker(load):
    spec = load(
        robot="""
            version: 1
            defaults: {host: base}
            workers: {eyes: {host: jetson}, legs: {}}
            nodes: {camera: {worker: eyes}, walk: {worker: legs}, think: {}}
            processes: {driver: {command: [sleep], host: jetson}, recorder: {command: [sleep]}}
        """,
        inventory=INVENTORY,
        layers=['inventory'],
    )
    jetson, base = spec.on_host('jetson'), spec.on_host('base')
    assert (spec.host, jetson.host, base.host) == ('', 'jetson', 'base')
    assert ([*jetson.nodes], [*jetson.processes], [*jetson.workers]) == (
        ['camera'],
        ['driver'],
        ['eyes'],
    )
    assert ([*base.nodes], [*base.processes], [*base.workers]) == (
        ['walk', 'think'],
        ['recorder'],
        ['legs'],
    )
    assert jetson.hosts == base.hosts == spec.hosts
    own, legs = base.in_worker(''), base.in_worker('legs')
    assert ([*own.nodes], [*own.processes], [*own.workers]) == (['think'], ['recorder'], ['legs'])
    assert ([*legs.nodes], [*legs.processes], [*legs.workers]) == (['walk'], [], ['legs'])


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (
            'nodes: {here: {worker: a b}}',
            "expected the name of a worker: letters, digits and underscores; got 'a b'",
        ),
        ('hosts: {a-b: {}}\nnodes: {here: {}}', "'a-b' is not the name of a host: letters"),
        ('workers: {a: {cpus: []}}\nnodes: {here: {worker: a}}', 'expected at least 1 item'),
        ('network: broadcast\nnodes: {here: {}}', 'broadcast'),
    ],
)
def test_a_value_that_cannot_be_meant_is_reported(tmp_path, text, message):
    path = tmp_path / 'robot.yaml'
    path.write_text(f'version: 1\n{text}\n')
    found = [each.message for each in load_system(path).diagnostics]
    assert len(found) == 1
    assert message in found[0]
