"""Containers: components are loaded, again after a restart, and come and go with edits.

The containers are stand-ins in Python: see `tests/container_program.py`.
"""

import json
import os
import signal
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy')

from std_msgs.msg import String

from composer.cli.main import run
from composer.interfaces.build.provision import import_packages, provide_packages
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.definitions.packages import load_packages
from composer.language.parsing.container_parser import LOADING_DEFINITIONS, LOADING_PACKAGE

pytestmark = pytest.mark.ros

PROGRAM = [sys.executable, str(Path(__file__).resolve().parents[2] / 'container_program.py')]
CODE = """
def starts(node):
    node.logger.info('starts')
"""


@pytest.fixture(autouse=True)
def loading(shared_cache, monkeypatch):
    """Build the package by which containers are asked, once for all tests."""
    monkeypatch.setenv('XDG_CACHE_HOME', str(shared_cache))
    definitions = load_packages({LOADING_PACKAGE: LOADING_DEFINITIONS}, InterfaceCatalogue())
    import_packages(provide_packages(definitions, lambda _line: None))


def component(kind='Talker', **keys):
    return {'package': 'stand_in', 'plugin': f'stand_in::{kind}', **keys}


def container(components, **keys):
    return {'command': PROGRAM, 'components': components, **keys}


def system(containers, nodes=None, **keys):
    data = {'version': 1, 'diagnostics': False, 'containers': containers, **keys}
    return json.dumps(data | {'nodes': nodes or {}})


@pytest.fixture
def listed(peer):
    """Return the nodes in a container, by their unique ids."""
    from composition_interfaces.srv import ListNodes

    def ask(name):
        answer = peer.call(ListNodes, f'{name}/_container/list_nodes')
        return dict(zip(answer.unique_ids, answer.full_node_names, strict=True))

    return ask


def container_of(child):
    """Return the process of the container of a system."""
    for entry in Path('/proc').iterdir():
        if entry.name.isdecimal():
            try:
                words = (entry / 'cmdline').read_bytes().split(b'\0')
                environment = (entry / 'environ').read_bytes()
            except OSError:
                continue
            domain = f'ROS_DOMAIN_ID={os.environ["ROS_DOMAIN_ID"]}'.encode()
            if PROGRAM[1].encode() in words and domain in environment:
                return int(entry.name)
    return pytest.fail(child.output)


def test_components_are_loaded_and_loaded_again(compose, peer, wait_for, listed):
    components = {
        'talker': component(
            namespace='left',
            parameters={'word': 'file', 'deep': {'er': [1, 2.5]}},
            parameter_files=['values.yaml'],
            remap={'chatter': '/words'},
            intra_process=True,
            log_level='debug',
        ),
        '/far/second': component(wait_for={'node': '/n'}, log_level='debug'),
    }
    (compose.folder / 'values.yaml').write_text('/**/talker: {ros__parameters: {word: hi}}')
    containers = {
        'perception': container(components, namespace='robot', restart={'delay': 0}),
    }
    nodes = {'n': {'wait_for': {'node': '/left/talker'}, 'on_start': 'parts:starts'}}
    heard = peer.listen(String, '/words')
    child = compose(system(containers, nodes), CODE)
    child.wait_for_line('1 node, 2 components and 1 process ready in ')

    told = ['perception]: extra talker', '[n]: starts', 'perception]: extra second [']
    at = [child.lines.index(child.wait_for_line(each)) for each in told]
    assert at == sorted(at)
    child.wait_for_line("talker ['enable_logger_service', 'use_intra_process_comms']")
    wait_for(lambda: 'hi' in [each.data for each in heard], 'the word of the parameter file')
    both = {1: '/left/talker', 2: '/far/second'}
    assert listed('/robot/perception') == both
    assert len(child.matching('has no services for log levels')) == 1

    os.kill(container_of(child), signal.SIGKILL)
    child.wait_for_line("container 'perception': 2 components were loaded again")
    del heard[:]
    wait_for(lambda: heard, 'the topic')
    assert child.stop() == 0


def test_a_component_that_fails_ends_the_start(compose):
    containers = {'perception': container({'it': component('Tlaker')})}
    child = compose(system(containers, {'n': {}}))

    assert child.wait() == 1
    child.wait_for_line(
        "error: component 'it' (system.yaml:1) cannot be loaded into '/perception': "
        'Failed to find class with the requested plugin'
    )
    assert not child.matching(' ready in ')


def test_a_stop_does_not_wait_for_a_slow_component(compose):
    (compose.folder / 'slow').touch()
    containers = {'perception': container({'it': component('Slow')}, stop={'signal': 'SIGKILL'})}
    child = compose(system(containers, {'n': {}}))
    child.wait_for_line("Waiting for the container '/perception' to load 'it'…")

    assert child.stop(once_up=False) == 130


def test_a_component_may_keep_the_name_of_its_plugin(compose, peer, wait_for, listed, capsys):
    (compose.folder / 'levels').touch()
    components = {
        'it': component(
            name=None,
            namespace='left',
            extra_arguments={'forward_global_arguments': False},
            parameters={'word': {'type': 'double', 'default': 2}},
            log_level='debug',
        )
    }
    heard = peer.listen(String, '/left/chatter')
    child = compose(system({'perception': container(components)}, diagnostics={}))
    child.wait_until_ready()

    assert listed('/perception') == {1: '/left/talker'}
    assert not child.matching('has no services for log levels')
    # A parameter has the type that is declared.
    assert wait_for(lambda: heard, 'its word')[0].data == '2.0'
    assert run(['top', '--once', '--format', 'json']) == 0
    shown = json.loads(capsys.readouterr().out)
    rows = [(each['node'], each['kind'], each['name']) for each in shown['entities']]
    assert ('/left/talker', 'publisher', '/left/chatter') in rows
    assert not [name for _, _, name in rows if name.endswith(('/rosout', '_parameters'))]
    child.wait_for_line('forward_global_arguments')
    assert run(['restart', '/left/talker']) == 0
    assert listed('/perception') == {2: '/left/talker'}
    assert child.stop() == 0


def test_an_edit_waits_for_what_the_one_before_has_loaded(compose, listed, wait_for):
    def edit(**components):
        beside = compose.folder / 'system.new'
        beside.write_text(system({'perception': container({'a': component(), **components})}))
        beside.replace(compose.folder / 'system.yaml')

    edit()
    child = compose.run('system.yaml', '--watch')
    child.wait_until_ready()
    (compose.folder / 'slow').touch()
    edit(slow=component('Slow'))
    child.wait_for_line("Waiting for the container '/perception' to load 'slow'…")
    edit(b=component())
    child.wait_for_line('to answer a request that is not wanted any more…')
    (compose.folder / 'slow').unlink()
    child.wait_for_line('reloaded in ')
    wait_for(lambda: sorted(listed('/perception').values()) == ['/a', '/b'], 'these components')
    assert not child.matching('not reloaded')
    assert child.stop() == 0


def test_an_edit_loads_and_unloads_what_it_names(compose, listed, capsys):
    def edit(**components):
        beside = compose.folder / 'system.new'
        beside.write_text(system({'perception': container(components)}))
        beside.replace(compose.folder / 'system.yaml')

    stays, changes = component(), component(parameters={'word': 'a'})
    path = compose.write(system({'perception': container({'a': stays, 'b': changes})}))
    child = compose.run(path.name, '--watch')
    child.wait_until_ready()
    # Which is loaded first, nobody says.
    (a,) = (number for number, name in listed('/perception').items() if name == '/a')

    edit(a=stays, b=component(parameters={'word': 'b'}), c=component())
    child.wait_for_line('reloaded in ')
    now = listed('/perception')
    assert (now.pop(a), sorted(now), sorted(now.values())) == ('/a', [3, 4], ['/b', '/c'])
    # A component that cannot be loaded leaves all as it was.
    edit(a=stays, b=component('Broken'))
    child.wait_for_line('Component constructor threw an exception: no such device')
    child.wait_for_line('[perception]: extra b', times=4)
    assert sorted(listed('/perception').values()) == ['/a', '/b', '/c']
    edit(a=stays)
    child.wait_for_line('reloaded in ', times=2)
    assert listed('/perception') == {a: '/a'}
    assert run(['restart', 'a']) == 0
    assert capsys.readouterr().out == "system: node '/a' was restarted\n"
    assert list(listed('/perception').values()) == ['/a']
    assert 1 not in listed('/perception')
    assert child.stop() == 0


def test_a_container_that_runs_elsewhere_gets_components_and_loses_only_these(
    compose, listed, wait_for
):
    (compose.folder / 'elsewhere.yaml').write_text(
        system({'elsewhere': container({'own': component()}, restart={'delay': 0})})
    )
    other = compose.run('elsewhere.yaml')
    other.wait_until_ready()
    there = {'/elsewhere': {'components': {'own': component()}}}
    child = compose(system(there))
    assert child.wait() == 1
    child.wait_for_line("it has a node '/own' already, which somebody else has loaded")
    there = {'/elsewhere': {'components': {'guest': component()}}}
    child = compose(system(there))
    child.wait_for_line('1 component ready in ')
    assert listed('/elsewhere') == {1: '/own', 2: '/guest'}

    os.kill(container_of(other), signal.SIGKILL)
    child.wait_for_line("container '/elsewhere': 1 component was loaded again")
    other.wait_for_line("container 'elsewhere': 1 component was loaded again")
    assert child.stop() == 0, child.output
    wait_for(lambda: list(listed('/elsewhere').values()) == ['/own'], 'its end')
    assert other.stop() == 0


def test_the_nodes_of_a_system_are_listed_as_those_of_a_container(compose, peer, listed):
    from composition_interfaces.srv import LoadNode

    nodes = {'b': {'namespace': '/robot'}, 'a': {}}
    child = compose(system({'perception': container({})}, nodes))
    child.wait_until_ready()

    assert listed('/composer_system') == {1: '/robot/b', 2: '/a'}
    answer = peer.call(LoadNode, '/composer_system/_container/load_node')
    assert not answer.success
    assert answer.error_message == (
        "the nodes of a system are those of its file: edit it, then 'composer reload system'"
    )
    assert child.stop() == 0


def test_a_component_is_brought_to_a_state_whenever_it_is_loaded(compose):
    components = {
        'driver': component('Managed', lifecycle='active'),
        'filter': component(
            'Managed', lifecycle='inactive', wait_for={'node': 'driver', 'state': 'active'}
        ),
    }
    text = system({'lidar': container(components, restart={'delay': 0})})
    child = compose(text, CODE, '--watch')
    child.wait_for_line("component 'driver' is active")
    child.wait_for_line("component 'filter' is inactive")
    path = compose.folder / 'system.yaml'
    path.write_text(path.read_text().replace('"inactive"', '"active"'))
    child.wait_for_line("component 'filter' is active")
    os.kill(container_of(child), signal.SIGKILL)
    child.wait_for_line("component 'driver' is active", times=2)
    assert child.stop() == 0
