"""Public launch files, written anew: the graph is the one that launch makes of its programs.

What launch does is to start programs with arguments of ROS; plain rclpy nodes get the same ones
here, and both graphs are seen by a third node.
"""

import json
import os
from pathlib import Path

import pytest

from tests.graphs import Graph

pytestmark = pytest.mark.ros

STRING, TWIST, POSE = 'std_msgs/msg/String', 'geometry_msgs/msg/Twist', 'geometry_msgs/msg/Pose'


def program(name, *arguments, publishers=(), subscriptions=(), parameters=None):
    return {
        'name': name,
        'arguments': arguments,
        'publishers': [(*each, False)[:3] for each in publishers],
        'subscriptions': [(*each, False)[:3] for each in subscriptions],
        'parameters': parameters or {},
    }


def talker(*arguments, best_effort=False):
    return program('talker', *arguments, publishers=[('chatter', STRING, best_effort)])


def listener(*arguments, best_effort=False):
    return program('listener', *arguments, subscriptions=[('chatter', STRING, best_effort)])


def turtle(*arguments):
    return program(
        'turtlesim',
        *arguments,
        publishers=[('turtle1/pose', POSE)],
        subscriptions=[('turtle1/cmd_vel', TWIST)],
        parameters={'background_r': 69, 'background_g': 86, 'background_b': 255},
    )


def mimic(*arguments):
    return program(
        'mimic',
        *arguments,
        publishers=[('/output/cmd_vel', TWIST)],
        subscriptions=[('/input/pose', POSE)],
    )


def ns(namespace, name=None):
    return ('-r', f'__ns:={namespace}', *(('-r', f'__node:={name}') if name else ()))


# The systems

BEHAVIOURS = """
def hear(node, message):
    pass

def paint(node):
    colours = node.parameters
    return colours.background_r, colours.background_g, colours.background_b
"""
CHATTER = f"""
version: 1
args: {{reliability: reliable}}
defaults: {{qos: {{reliability: "{{{{ reliability }}}}"}}}}
nodes:
  talker:
    publishers: {{chatter: {STRING}}}
    timers: {{talk: {{period: 1.0, publish: chatter, message: {{data: hello}}}}}}
  listener:
    subscriptions: {{chatter: {{type: {STRING}, behaviour: 'parts:hear'}}}}
"""
TURTLE = f"""
version: 1
args: {{r: 69, g: 86, b: 255}}
nodes:
  sim:
    parameters:
      background_r: "{{{{ r }}}}"
      background_g: "{{{{ g }}}}"
      background_b: "{{{{ b }}}}"
    on_start: parts:paint
    publishers: {{turtle1/pose: {{type: {POSE}, external: true}}}}
    timers: {{move: {{period: 1.0, publish: turtle1/pose, message: {{}}}}}}
    subscriptions: {{turtle1/cmd_vel: {{type: {TWIST}, behaviour: 'parts:hear', external: true}}}}
"""
MIMIC = f"""
version: 1
nodes:
  mimic:
    publishers: {{/output/cmd_vel: {TWIST}}}
    timers: {{steer: {{period: 1.0, publish: /output/cmd_vel, message: {{}}}}}}
    subscriptions: {{/input/pose: {{type: {POSE}, behaviour: 'parts:hear'}}}}
"""

# https://docs.ros.org/en/jazzy/How-To-Guides/Launch-file-different-formats.html
FORMATS = """
version: 1
args: {background_r: 0, background_g: 255, background_b: 0, chatter_ns: my/chatter/ns}
include:
  chatter: {file: chatter.yaml}
  chatter_in_namespace: {file: chatter.yaml, namespace: "{{ chatter_ns }}"}
  first: {file: turtle.yaml, namespace: turtlesim1}
  second:
    file: turtle.yaml
    namespace: turtlesim2
    args: {r: "{{ background_r }}", g: "{{ background_g }}", b: "{{ background_b }}"}
  mimic:
    file: mimic.yaml
    remap:
      /input/pose: /turtlesim1/turtle1/pose
      /output/cmd_vel: /turtlesim2/turtle1/cmd_vel
nodes: {}
"""
FORMATS_PROGRAMS = [
    talker(),
    listener(),
    talker(*ns('/other/ns')),
    listener(*ns('/other/ns')),
    turtle(*ns('/turtlesim1', 'sim')),
    turtle(
        *ns('/turtlesim2', 'sim'),
        *('-p', 'background_r:=200', '-p', 'background_g:=255', '-p', 'background_b:=0'),
    ),
    mimic(
        *('-r', '__node:=mimic', '-r', '/input/pose:=/turtlesim1/turtle1/pose'),
        *('-r', '/output/cmd_vel:=/turtlesim2/turtle1/cmd_vel'),
    ),
]

# Groups in groups, as in many simulators: PushRosNamespace and SetRemap in each, UnlessCondition.
GROUPS = """
version: 1
args: {sim: true}
include:
  simulator: {file: inner.yaml, namespace: simulator, remap: {chatter: /all/news}}
  quiet: {file: chatter.yaml, namespace: quiet, args: {reliability: best_effort}}
  real: {file: inner.yaml, namespace: real, when: "{{ not sim }}"}
nodes: {}
"""
INNER = """
version: 1
include:
  left: {file: chatter.yaml, namespace: left, remap: {chatter: left_news}}
  right: {file: chatter.yaml, namespace: right}
  fixed: {file: chatter.yaml, namespace: /fixed, remap: {chatter: ~/news}}
nodes: {}
"""
BOTH = (talker, listener)
NEWS = ('-r', 'chatter:=/all/news')
GROUPS_PROGRAMS = [
    *(each(*ns('/simulator/left'), *NEWS, '-r', 'chatter:=left_news') for each in BOTH),
    *(each(*ns('/simulator/right'), *NEWS) for each in BOTH),
    *(each(*ns('/fixed'), *NEWS, '-r', 'chatter:=~/news') for each in BOTH),
    *(each(*ns('/quiet'), best_effort=True) for each in BOTH),
]

# https://github.com/ros2/launch_ros/blob/rolling/launch_ros/examples/optional_namespace.launch.py
# and the wildcards of the tutorial on large projects.
OPTIONAL = """
version: 1
args: {namespace: '', use_namespace: true}
nodes:
  parameter_blackboard:
    namespace: "{{ (namespace or env('ROBOT_NAMESPACE', '')) if use_namespace else '' }}"
    parameters: {some_int: 1, some_text: none, some.nested.list: [1.0], kept: 3, wide: false}
    parameter_files: [values.yaml]
  other:
    namespace: /robot1/arm
    parameters: {some_int: 1, wide: false}
    parameter_files: [values.yaml]
"""
VALUES = """
/**:
  ros__parameters: {wide: true}
/*/parameter_blackboard:
  ros__parameters:
    some_int: 42
    some: {nested: {list: [0.5, 1.5]}}
/robot1/**/other:
  ros__parameters: {some_int: 7}
robot1:
  parameter_blackboard:
    ros__parameters: {some_text: yes it is}
"""
BLACKBOARD = {
    'some_int': 1,
    'some_text': 'none',
    'some.nested.list': [1.0],
    'kept': 3,
    'wide': False,
}
FILE = ('--params-file', 'values.yaml')
OPTIONAL_PROGRAMS = [
    program('parameter_blackboard', *ns('/robot1'), *FILE, parameters=BLACKBOARD),
    program('other', *ns('/robot1/arm'), *FILE, parameters={'some_int': 1, 'wide': False}),
]


@pytest.fixture
def plain(tmp_path, start_program, other_domain_id):
    """Run plain nodes in a domain of their own."""

    def run(programs):
        process = start_program(
            Path(__file__).with_name('plain_nodes.py'),
            json.dumps(programs),
            cwd=tmp_path,
            env=os.environ
            | {'ROS_DOMAIN_ID': str(other_domain_id), 'ROS_LOG_DIR': str(tmp_path / 'l')},
        )
        assert process.stdout.readline() == 'ready\n'

    return run


SYSTEM = """
version: 1
args: {chatter_ns: '', background_r: 0, namespace: ''}
include:
  formats:
    file: formats.yaml
    args: {chatter_ns: "{{ chatter_ns }}", background_r: "{{ background_r }}"}
  groups: {file: groups.yaml}
  optional: {file: optional.yaml, args: {namespace: "{{ namespace }}"}}
nodes: {}
"""
FILES = {
    'system.yaml': SYSTEM,
    'formats.yaml': FORMATS,
    'groups.yaml': GROUPS,
    'optional.yaml': OPTIONAL,
    'chatter.yaml': CHATTER,
    'turtle.yaml': TURTLE,
    'mimic.yaml': MIMIC,
    'inner.yaml': INNER,
    'values.yaml': VALUES,
    'parts.py': BEHAVIOURS,
}
WORDS = ('chatter_ns:=/other/ns', 'background_r:=200', 'namespace:=robot1')
PROGRAMS = FORMATS_PROGRAMS + GROUPS_PROGRAMS + OPTIONAL_PROGRAMS
WITH_PARAMETERS = [
    '/turtlesim1/sim',
    '/turtlesim2/sim',
    '/robot1/parameter_blackboard',
    '/robot1/arm/other',
]


def test_the_graph_is_that_of_the_launch_files(compose, plain, other_domain_id, wait_for):
    for name, text in FILES.items():
        (compose.folder / name).write_text(text.lstrip())
    plain(PROGRAMS)
    child = compose.run(compose.folder / 'system.yaml', *WORDS)
    child.wait_until_ready()
    wanted, real = Graph(other_domain_id), Graph(compose.domain_id)
    try:
        count = sum(len(each['publishers'] + each['subscriptions']) for each in PROGRAMS)
        for graph in (wanted, real):
            wait_for(lambda graph=graph: len(graph.nodes()) >= len(PROGRAMS), 'the nodes')
            wait_for(lambda graph=graph: len(graph.ends()) >= count, 'the ends of topics')
        assert real.nodes() == wanted.nodes()
        assert real.ends() == wanted.ends()
        assert real.parameters(WITH_PARAMETERS) == wanted.parameters(WITH_PARAMETERS)
    finally:
        wanted.close()
        real.close()
    assert not child.matching('warning['), child.output
    assert child.stop() == 0
