"""Processes as they are read: what defaults and includes make of them."""

from textwrap import dedent

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Read `robot.yaml` beside other files; there must be nothing wrong with them."""
    monkeypatch.chdir(tmp_path)

    def load(**texts):
        for name, text in texts.items():
            (tmp_path / f'{name}.yaml').write_text(dedent(text))
        system = load_system(tmp_path / 'robot.yaml')
        assert [each.message for each in system.diagnostics] == []
        return system

    return load


DRIVERS = """
    version: 1
    defaults: {namespace: drivers, log_level: warn, use_sim_time: true}
    nodes:
      user: {wait_for: [{process: camera}, {topic: image}]}
    processes:
      camera: {package: vendor, executable: camera, wait_for: {service: power}}
      named: {command: [driver], name: other}
      plain: {command: [record], wait_for: [{process: camera}, {topic: image}, {node: /far}]}
"""


def conditions(waiter):
    return [(each.kind, each.name) for each in waiter.wait_for]


def test_defaults_hold_for_programs_of_ros_alone(load):
    processes = load(robot=DRIVERS).spec.processes

    for name in ('camera', 'named'):
        process = processes[name]
        assert process.is_ros
        assert (process.namespace, process.log_level) == ('/drivers', 'warn')
        assert process.parameters == {'use_sim_time': True}
    plain = processes['plain']
    assert not plain.is_ros
    assert (plain.namespace, plain.log_level, dict(plain.parameters)) == (None, None, {})


def test_the_process_itself_wins_over_defaults(load):
    text = """
        version: 1
        defaults: {namespace: drivers, log_level: warn, use_sim_time: true}
        processes:
          camera:
            command: [driver]
            namespace: /own
            log_level: debug
            parameters: {use_sim_time: false, a: 1}
    """
    camera = load(robot=text).spec.processes['camera']

    assert (camera.namespace, camera.log_level) == ('/own', 'debug')
    assert camera.parameters == {'use_sim_time': False, 'a': 1}


def test_an_include_moves_programs_of_ros_and_what_others_wait_for(load):
    robot = """
        version: 1
        include:
          left: {file: drivers.yaml, namespace: left, remap: {a: b}}
          right: {file: drivers.yaml, namespace: /right}
    """
    system = load(robot=robot, drivers=DRIVERS)
    processes = system.spec.processes

    assert sorted(processes) == [
        'camera',
        'named',
        'plain',
        'right_camera',
        'right_named',
        'right_plain',
    ]
    camera, plain = processes['camera'], processes['plain']
    assert (camera.namespace, camera.log_level) == ('/left/drivers', 'warn')
    assert camera.parameters == {'use_sim_time': True}
    assert camera.remap == (('a', 'b'),)
    assert conditions(camera) == [('service', 'power')]
    assert (plain.is_ros, plain.remap) == (False, ())
    assert conditions(plain)[:2] == [('process', 'camera'), ('topic', 'left/drivers/image')]
    assert conditions(processes['right_plain'])[:2] == [
        ('process', 'right_camera'),
        ('topic', '/right/drivers/image'),
    ]
    users = [conditions(node)[0] for node in system.spec.nodes.values()]
    assert users == [('process', 'camera'), ('process', 'right_camera')]


def test_who_waits_for_its_own_remapped_topic_waits_in_a_circle(load):
    text = """
        version: 1
        nodes:
          one:
            remap: {scan: /shared}
            wait_for: {topic: scan}
          two:
            wait_for: {node: one}
            publishers: {shared: {type: std_msgs/msg/Empty, external: true}}
    """
    rules = [each.rule for each in check_system(load(robot=text), InterfaceCatalogue())]

    assert 'wait-cycle' in rules


def test_a_system_may_have_processes_alone(load):
    system = load(robot="version: 1\nprocesses: {driver: {command: ['true']}}\n")

    assert list(system.spec.processes) == ['driver']
    assert not system.spec.nodes


@pytest.mark.parametrize(
    ('processes', 'longest'),
    [('{}', 3), ('{a: {command: [a]}}', 6), ('{a: {command: [a], stop: {timeout: 40}}}', 43)],
)
def test_a_stop_takes_as_long_as_nodes_and_then_processes(load, processes, longest):
    text = f'version: 1\nexecutor: {{shutdown_timeout: 3}}\nprocesses: {processes}\n'

    assert load(robot=text).spec.longest_stop_sec == longest


def test_names_of_included_processes_hold_where_they_are_started_and_waited_for(load):
    part = """
        version: 1
        processes:
          homing: {command: [a], on_exit: [shutdown, {start: mission}]}
          mission: {command: [b], wait_for: {process: homing, state: ended}}
    """
    robot = """
        version: 1
        include: {left: part.yaml}
        processes: {homing: {command: [c]}, mission: {command: [d]}}
    """
    processes = load(
        robot=robot.replace('part.yaml', '{file: part.yaml}'), part=part
    ).spec.processes

    assert [each.start for each in processes['left_homing'].on_exit] == [None, 'left_mission']
    assert conditions(processes['left_mission']) == [('process', 'left_homing')]
    assert [name for name, each in processes.items() if each.on_demand] == ['left_mission']


def test_components_lie_where_defaults_and_includes_put_them(load):
    part = """
        version: 1
        args: {count: 2}
        defaults: {namespace: drivers, use_sim_time: true, log_level: warn}
        nodes: {n: {wait_for: {node: left/filter_1}}}
        containers:
          container:
            components:
              "filter_{{ i }}":
                foreach: {i: "{{ range(count) }}"}
                package: vendor
                plugin: vendor::Filter
                namespace: left
                remap: {points: cloud}
                wait_for: {process: container}
              /far/other: {package: vendor, plugin: "vendor::Other", when: "{{ count > 2 }}"}
          /lidar/container: {components: {it: {package: vendor, plugin: "vendor::It"}}}
    """
    robot = """
        version: 1
        include: {arm: {file: part.yaml, namespace: arm, remap: {points: /all}}}
        processes: {container: {command: [a]}}
    """
    system = load(robot=robot, part=part)
    processes = system.spec.processes

    own, other = processes['arm_container'], processes['/lidar/container']
    assert (own.package, own.executable) == ('rclcpp_components', 'component_container')
    assert (own.full_name, own.external) == ('/arm/drivers/container', False)
    assert (other.full_name, other.external) == ('/lidar/container', True)
    names = {key: each.full_name for key, each in own.components.items()}
    assert names == {f'filter_{i}': f'/arm/drivers/left/filter_{i}' for i in range(2)}
    assert [each.full_name for each in other.components.values()] == ['/arm/drivers/it']
    first = own.components['filter_0']
    assert first.remap == (('points', '/all'),)
    assert (dict(first.parameters), first.log_level) == ({'use_sim_time': True}, 'warn')
    assert conditions(first) == [('process', 'arm_container')]
    place = system.positions.value((*first.path, 'plugin'))
    assert (place.source.name.rpartition('/')[2], place.line) == ('part.yaml', 12)
    assert list(system.unused.processes['arm_container'].components) == [
        *('filter_0', 'filter_1'),
        '/far/other',
    ]
