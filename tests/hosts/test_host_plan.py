"""A plan says that a part starts again for what it cannot take while it runs."""

import json

import pytest

from composer.application.system_reader import list_files
from composer.checks.checker import check_in_context, create_context
from composer.diagnostics import has_errors
from composer.hosts.host_parts import PartSources, build_part
from composer.hosts.host_plan import find_space_problem, plan_host
from composer.hosts.project_files import collect_files
from composer.hosts.wheels import Wheel
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system
from composer.network.variables import ros_variables
from composer.planning.differences import keep_start
from composer.planning.snapshot_data import encode_snapshot
from composer.planning.snapshot_taking import take_snapshot

SYSTEM = """\
version: 1
network: {discovery: peers, domain_id: 20}
interfaces: {plan_msgs: plan_msgs}
hosts: {front: {address: 10.0.0.1}, rear: {address: 10.0.0.2}}
nodes:
  talker:
    host: front
    publishers: {chatter: {type: plan_msgs/msg/Thing, topic: /chatter}}
"""
PACKAGE = """\
<package format="3">
  <name>plan_msgs</name><version>0.0.0</version><description>d</description>
  <maintainer email="a@b.c">a</maintainer><license>MIT</license>
</package>
"""
FILES = {
    'robot.yaml': SYSTEM,
    'plan_msgs/package.xml': PACKAGE,
    'plan_msgs/msg/Thing.msg': 'int32 x\n',
}
FACTS = {
    'ros': [],
    'folder': '/f',
    'root': '/f/systems/robot',
    'hold': '/run/hold',
    'edited': {},
    'missing': [],
    'venvs': [],
    'wheels': [],
    'composers': [],
    'unit_path': '/unit',
    'is_foreign': False,
    'state': {'ActiveState': 'active'},
}
# What is edited, and how: → what becomes of the part of the front.
CASES = {
    'nothing': ('robot.yaml', '', '', 'nothing', ''),
    'a definition': (
        *('plan_msgs/msg/Thing.msg', 'int32', 'int64', 'restart'),
        'interfaces.plan_msgs: a process can load an interface package once',
    ),
    'an address that is looked for': (
        *('robot.yaml', '10.0.0.2', '10.0.0.3', 'restart'),
        'hosts.rear: the middleware reads this when it starts',
    ),
    'its own address': ('robot.yaml', '10.0.0.1', '10.0.0.3', 'reload', ''),
    'a topic': ('robot.yaml', '/chatter', '/talk', 'reload', ''),
}
# With multicast no address is looked for.
OF_MULTICAST = {
    'another host': ('robot.yaml', 'hosts: {', 'hosts: {spare: {address: a}, ', 'reload', ''),
    'an address': ('robot.yaml', '10.0.0.2', '10.0.0.3', 'reload', ''),
}


def part_of_front(folder):
    system = load_system(folder / 'robot.yaml')
    context = create_context(system, InterfaceCatalogue())
    assert not has_errors(check_in_context(system, context))
    spec = context.spec = context.spec.on_host('front')
    given = [folder / 'robot.yaml']
    sources = PartSources(
        spec=spec,
        host=spec.hosts['front'],
        files=collect_files(given, list_files(context), spec),
        words=['robot.yaml'],
        wheels={},
        required={},
        composer=Wheel('composer.whl', b'', {}),
        variables=ros_variables(spec),
        start=encode_snapshot(keep_start(take_snapshot(context))),
        hosts=list(spec.hosts.values()),
    )
    return build_part(sources, FACTS)


def plan_after(folder, name, old, new, **more):
    before = part_of_front(folder)
    path = folder / name
    path.write_text(path.read_text().replace(old, new))
    # As a host keeps it.
    manifest = json.loads(json.dumps(before.manifest))
    facts = {**FACTS, 'manifest': manifest, 'unit': before.unit, **more}
    return plan_host(part_of_front(folder), facts)


@pytest.fixture
def folder(tmp_path):
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path


@pytest.mark.parametrize('case', CASES)
def test_a_part_starts_again_only_if_it_must(folder, case):
    name, old, new, action, reason = CASES[case]
    plan = plan_after(folder, name, old, new)
    assert (plan.action, plan.reason) == (action, reason)


@pytest.mark.parametrize('case', OF_MULTICAST)
def test_an_edit_of_the_inventory_alone_is_no_restart(folder, case):
    system = folder / 'robot.yaml'
    system.write_text(SYSTEM.replace('discovery: peers', 'discovery: multicast'))
    name, old, new, action, reason = OF_MULTICAST[case]
    plan = plan_after(folder, name, old, new)
    assert (plan.action, plan.reason) == (action, reason)


def test_a_file_that_somebody_has_removed_there_is_brought_again(folder):
    plan = plan_after(folder, 'robot.yaml', '', '', missing=['files/robot.yaml'])
    assert (plan.action, plan.changes) == ('reload', (('+', 'robot.yaml'),))


def test_a_disk_that_is_full_has_no_round_numbers(folder):
    plan = plan_after(folder, 'robot.yaml', '/chatter', '/talk')
    said = find_space_problem(plan, {**FACTS, 'free_bytes': 100})
    assert (
        said == f'host front: /f needs {plan.needed_bytes / 1000:.1f} kB, and its disk has 0.1 kB'
    )
