"""Recordings that a case names are compared with its topics, and with the system before."""

import pytest

from composer.interfaces.catalogue import InterfaceCatalogue
from composer.scenarios.checks import check_scenarios
from composer.scenarios.expectations.evaluation import evaluate
from composer.scenarios.scenario_files import load_scenarios
from composer.simulation.events import Event
from tests.recorded import write_recording

pytestmark = pytest.mark.ros

SYSTEM = """\
version: 1
nodes:
  robot:
    subscriptions:
      scan: {type: sensor_msgs/msg/LaserScan, publish: out, external: true}
    publishers:
      out: {type: sensor_msgs/msg/LaserScan, external: true}
"""
CASE = """\
version: 1
system: {{file: robot.yaml}}
cases:
  one:
    until: 10
    given: {{{given}}}
    then: [{then}]
"""


def scan(*ranges, stamp=0):
    from sensor_msgs.msg import LaserScan

    message = LaserScan(ranges=ranges)
    message.header.stamp.sec = stamp
    return message


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Return a function that reads a case beside a system and a recording."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'robot.yaml').write_text(SYSTEM)
    path = tmp_path / 'a.scenario.yaml'
    recorded = {'/out': [scan(0.1, stamp=1), scan(0.2, stamp=2)], '/scan': [scan(0.1)]}
    write_recording(tmp_path / 'run.mcap', recorded)

    def load(given='', then=''):
        path.write_text(CASE.format(given=given, then=then))
        return load_scenarios(path.relative_to(tmp_path))

    return load


def published(*messages):
    return [Event(index, 'message', '/robot', '/out', each) for index, each in enumerate(messages)]


def said(loaded, events):
    case = loaded.spec.cases['one']
    return [(each.path[-1], each.message, each.diff) for each in evaluate(case, events)]


LIKE = '{topic: /out, like: run.mcap, ignore: [header.stamp]}'


def test_a_topic_is_as_it_was_recorded(load):
    assert said(load(then=LIKE), published(scan(0.1, stamp=7), scan(0.2))) == []


def test_what_is_not_as_recorded_is_told(load):
    assert said(load(then=LIKE), published(scan(0.1), scan(0.25))) == [
        (
            'like',
            'message 2 on /out at 0.000000001 s is not as recorded',
            '  ranges:\n-   [0]: 0.2\n+   [0]: 0.25',
        )
    ]


def test_a_recording_that_has_gone_is_told(load, tmp_path):
    loaded = load(then=LIKE)
    (tmp_path / 'run.mcap').unlink()
    assert said(loaded, published()) == [('like', "there is no recording 'run.mcap'", '')]


def check(loaded):
    found = check_scenarios(loaded, InterfaceCatalogue())
    return [f'{each.rule}: {each.message} ({each.help})' for each in found]


def test_a_recording_that_fits_has_no_findings(load):
    assert check(load('recording: run.mcap', LIKE)) == []


def test_a_topic_that_was_not_recorded_is_found(load, tmp_path):
    write_recording(tmp_path / 'other.mcap', {'/outt': [scan(0.1)]})
    assert check(load('recording: other.mcap', '{topic: /out, like: other.mcap}')) == [
        'unrecorded-topic: other.mcap has no topic that the system hears and does not publish '
        'itself (its topics are: /outt)',
        "unrecorded-topic: other.mcap has no messages of /out (did you mean '/outt'?)",
    ]


def test_a_topic_of_another_type_is_found(load, tmp_path):
    from std_msgs.msg import String

    write_recording(tmp_path / 'other.mcap', {'/out': [String()], '/scan': [String()]})
    message = (
        "conflicting-types: '{}' is a std_msgs/msg/String in the recording, "
        'and is a sensor_msgs/msg/LaserScan in the system (None)'
    )
    assert check(load('recording: other.mcap', '{topic: /out, like: other.mcap}')) == [
        message.format('/scan'),
        message.format('/out'),
    ]


def test_a_field_that_is_ignored_must_be_there(load):
    (found,) = check(load(then=LIKE.replace('header.stamp', 'header.stmp')))
    assert found.startswith("unknown-field: std_msgs/msg/Header has no field 'stmp'")
