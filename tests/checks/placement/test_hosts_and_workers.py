"""Names of workers and hosts that nobody has, and things that cannot be where they are put."""

from pathlib import Path

import pytest

from composer.checks.checker import check_system, create_context
from composer.checks.placement.hosts_and_workers import find_unplaced
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

HOSTS = 'hosts: {base: {}, jetson: {address: 10.0.0.2}}\n'

# What the file says, beside `arm.yaml` with a node `finger`; the line and column of each finding,
# its rule and its help.
CASES = [
    (HOSTS + 'nodes: {a: {host: base}}', []),
    # Without an inventory, names are labels.
    ('nodes: {a: {host: anywhere}}', []),
    (HOSTS + 'nodes: {a: {host: bas}}', [('3:19', 'unknown-host', "did you mean 'base'?")]),
    (HOSTS + 'defaults: {host: x}\nnodes: {a: {}}', [('3:18', 'unknown-host', 'there are: base, jetson')]),
    (HOSTS + 'nodes: {}\nprocesses: {p: {command: [sleep], host: x}}', [('4:41', 'unknown-host', 'there are: base, jetson')]),
    (HOSTS + 'network: {discovery: discovery_server, server: x}\nnodes: {a: {host: base}}', [('3:48', 'unknown-host', 'there are: base, jetson')]),
    # What is wrong with a host itself is said once.
    ('hosts: {base: {adress: x}}\nnodes: {a: {host: base}}', [('2:16', 'unknown-key', "did you mean 'address'?")]),
    ('hosts: {base: 3, jetson: {}}\nnodes: {a: {host: base}}', [('2:15', 'wrong-type', None)]),
    (
        'hosts: {a: {address: x}, b: {address: x}}\nnodes: {n: {host: a}}',
        [('2:26', 'duplicate-host', 'give one of them another folder, or use one name for both')],
    ),
    # A worker is on one host.
    ('workers: {w: {host: x}}\nnodes: {a: {worker: w, host: x}}', []),
    (
        'workers: {w: {host: x}}\nnodes: {a: {worker: w, host: y}}',
        [('3:30', 'conflicting-hosts', "give the node another worker, or the worker one host under 'workers:'")],
    ),
    ('defaults: {host: y}\nworkers: {w: {host: x}}\nnodes: {a: {worker: w}, b: {}}', []),
    # Each host has its own processes.
    ('defaults: {host: x}\nnodes: {a: {wait_for: {process: p}}}\nprocesses: {p: {command: [sleep]}}', []),
    (
        'nodes: {a: {host: x, wait_for: {process: p}}}\nprocesses: {p: {command: [sleep], host: y}}',
        [('2:42', 'process-elsewhere', 'wait for a node, topic, service or action of it')],
    ),
    (
        'nodes: {}\nprocesses: {p: {command: [sleep], host: y}, q: {command: [sleep], host: x, wait_for: {process: p}}}',
        [('3:96', 'process-elsewhere', 'wait for a node, topic, service or action of it')],
    ),
    ('nodes: {a: {wait_for: {process: p}}}\nprocesses: {p: {command: [sleep], host: y}}', []),
    # The nodes of a worker find the others.
    (
        'workers: {w: {environment: {ROS_DOMAIN_ID: 7}}}\nnodes: {a: {worker: w}}',
        [('2:44', 'bad-environment', "set it for all, under 'environment:'")],
    ),
    ('environment: {ROS_DOMAIN_ID: 7}\nworkers: {w: {environment: {ROS_DOMAIN_ID: 7}}}\nnodes: {a: {worker: w}}', []),
    (
        'workers: {w: {environment: {ROS_DOMIAN_ID: 7}}}\nnodes: {a: {worker: w}}',
        [('2:29', 'likely-misspelling', "did you mean 'ROS_DOMAIN_ID'?")],
    ),
    # A worker is there for nodes.
    ('workers: {w: {}}\nnodes: {a: {}}', [('2:11', 'unused-worker', 'remove it, or name it in a node')]),
    ('workers: {vision: {}}\nnodes: {a: {worker: vison}}', [('2:11', 'unused-worker', "did you mean 'vison'?")]),
    ('workers: {w: {when: false}}\nnodes: {a: {}}', []),
    ('workers: {w: {}}\ninclude: {arm: {file: absent.yaml, worker: w}}', [('3:23', 'missing-include', 'there are: arm.yaml, robot.yaml')]),
    (
        'workers: {vision: {}}\nnodes: {a: {worker: vision}, b: {worker: visoin}}',
        [('3:42', 'likely-misspelling', "did you mean 'vision'?")],
    ),
]  # fmt: skip


@pytest.mark.parametrize(('text', 'expected'), CASES)
def test_a_place_that_cannot_be_meant_is_found_once(tmp_path, monkeypatch, text, expected):
    monkeypatch.chdir(tmp_path)
    Path('arm.yaml').write_text('version: 1\nnodes: {finger: {}}\n')
    Path('robot.yaml').write_text(f'version: 1\n{text}\n')
    found = check_system(load_system(Path('robot.yaml')), InterfaceCatalogue())
    assert [(f'{each.span.line}:{each.span.column}', each.rule, each.help) for each in found] == expected  # fmt: skip


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('nodes: {a: {host: x}, b: {worker: w}}\nworkers: {w: {host: y}}', []),
        ('nodes: {a: {host: x}, b: {worker: w}}', ["the node 'b' has no host to run on"]),
        ('defaults: {host: x}\nnodes: {a: {}}\nprocesses: {p: {command: [sleep]}}', []),
        (
            'nodes: {a: {host: x}}\nprocesses: {p: {command: [sleep]}}',
            ["the process 'p' has no host to run on"],
        ),
    ],
)
def test_a_system_that_is_deployed_has_a_host_for_everything(tmp_path, text, expected):
    path = tmp_path / 'robot.yaml'
    path.write_text(f'version: 1\n{text}\n')
    context = create_context(load_system(path), InterfaceCatalogue())
    found = [*find_unplaced(context)]
    assert [each.message for each in found] == expected
    assert {each.rule for each in found} <= {'no-host'}
