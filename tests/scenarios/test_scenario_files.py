"""A scenario file is read into records, and what is wrong with its structure is found."""

import textwrap

import pytest

from composer.reports.text import render_finding
from composer.scenarios.scenario_files import load_scenarios
from composer.scenarios.specs import (
    CallStepSpec,
    ErrorExpectationSpec,
    ExitExpectationSpec,
    GoalStepSpec,
    LikeExpectationSpec,
    LogExpectationSpec,
    MessageExpectationSpec,
    OrderExpectationSpec,
    ParametersExpectationSpec,
    PublishStepSpec,
    RateExpectationSpec,
    ScheduleSpec,
    SetParametersStepSpec,
    StateExpectationSpec,
    WindowSpec,
)

SYSTEM = """\
version: 1
args: {simulation: false}
nodes:
  governor:
    namespace: /robot
    parameters: {limit: 1.0}
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    """Return a function that reads the text of a scenario file beside a system."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'robot.yaml').write_text(SYSTEM)
    path = tmp_path / 'drive.scenario.yaml'

    def load(text):
        path.write_text(textwrap.dedent(text))
        return load_scenarios(path.relative_to(tmp_path))

    return load


def case_of(loaded):
    assert [render_finding(each) for each in loaded.document.diagnostics] == []
    ((_, case),) = loaded.spec.cases.items()
    return case


def said(loaded):
    return [
        f'{each.span.line}:{each.span.column} {each.rule}: {each.message}'
        + (f' ({each.help})' if each.help else '')
        for each in loaded.document.diagnostics
    ]


CASES = """\
version: 1
system: {file: robot.yaml, args: {simulation: true}, set: {nodes.governor.log_level: debug}}
until: 10
cases:
  drives:
    given:
      parameters: {governor: {limit: 2.0}}
      recording: run.mcap
      services: {reset: {response: {success: true}, delay: 0.5}}
      actions: {/fibonacci: {feedback: [{delay: 1, message: {}}, {message: {}}], status: aborted}}
    when:
      - {at: 4.0, every: 0.1, times: 20, publish: cmd_vel, message: {linear: {x: 2.0}}}
      - {at: 3.0, call: /reset, response: {success: true}}
      - {send_goal: /fibonacci, goal: {order: 5}}
      - {send_goal: /fibonacci, cancel_at: 0.3}
      - {at: 1, set_parameters: {governor: {limit: 0.1}}, refused: true}
    then:
      - {topic: /out, within: [2.0, 2.1], where: data == 0}
      - {topic: /out, never: data > 1.0}
      - {topic: /out, eventually: data > 1.0}
      - {topic: /out, count: [1, 3], message: {data: 1}}
      - {topic: /out, rate: [9.5, 10.5], between: [1, 10]}
      - {topic: /out, like: run.mcap, tolerance: 1e-6, ignore: [header.stamp]}
      - {order: [{topic: a}, {topic: b, where: data}], tolerance: 0.1}
      - {log: governor, level: error, never: true}
      - {error: '*', text: division}
      - {parameters: {governor: {limit: 2.0}}, at: 5}
      - {state: {governor: active}, within: [0, 2]}
      - {exit_code: 0}
"""


def test_every_form_is_read(load):
    case = case_of(load(CASES))
    given, steps, then = case.given, case.steps, case.expectations
    assert given.parameters == {'/robot/governor': {'limit': 2.0}}
    assert str(given.recording) == 'run.mcap'
    assert given.services['/reset'].delay_ns == 500_000_000
    assert [each.delay_ns for each in given.actions['/fibonacci'].feedback] == [0, 10**9]
    assert given.actions['/fibonacci'].delay_ns == 10**9
    assert list(map(type, steps)) == [
        PublishStepSpec, CallStepSpec, GoalStepSpec, GoalStepSpec, SetParametersStepSpec
    ]  # fmt: skip
    assert steps[0].schedule == ScheduleSpec(4 * 10**9, 10**8, 20)
    assert steps[0].topic == '/cmd_vel'
    assert (steps[2].status, steps[3].status) == ('succeeded', None)
    assert steps[4].values == {'/robot/governor': {'limit': 0.1}}
    assert list(map(type, then)) == [
        *[MessageExpectationSpec] * 4, RateExpectationSpec, LikeExpectationSpec,
        OrderExpectationSpec, LogExpectationSpec, ErrorExpectationSpec, ParametersExpectationSpec,
        StateExpectationSpec, ExitExpectationSpec,
    ]  # fmt: skip
    assert then[0].window == WindowSpec(2 * 10**9, 2_100_000_000)
    assert [(each.least, each.most) for each in then[:4]] == [(1, None), (0, 0), (1, None), (1, 3)]
    assert then[1].pattern.where == 'data > 1.0'
    assert [each.tolerance for each in then[6].patterns] == [0.1, 0.1]
    assert then[7].node == '/robot/governor'
    assert then[8].node is None
    assert then[9].at_ns == 5 * 10**9


def test_the_system_is_read_as_the_file_gives_it(load):
    loaded = load(CASES)
    assert loaded.spec.system.words == ('simulation:=true',)
    assert loaded.system.given.values == {'simulation': True}
    assert loaded.system.spec.nodes['governor'].log_level == 'debug'


def test_the_settings_of_a_case_come_before_those_of_the_file(load):
    loaded = load("""\
        version: 1
        system: {file: robot.yaml}
        until: 10
        seed: 3
        cases:
          one: {then: []}
          two: {then: [], until: 2.5, seed: 4, real_time_limit: 5}
    """)
    one, two = loaded.spec.cases.values()
    assert (one.until_ns, one.seed, one.real_time_limit_sec) == (10 * 10**9, 3, 60.0)
    assert (two.until_ns, two.seed, two.real_time_limit_sec) == (2_500_000_000, 4, 5.0)


def test_a_step_is_repeated_until_the_case_ends():
    assert list(ScheduleSpec(10, 3).list_times(20)) == [10, 13, 16, 19]
    assert list(ScheduleSpec(10, 3, 2).list_times(20)) == [10, 13]
    assert list(ScheduleSpec(10).list_times(20)) == [10]
    assert list(ScheduleSpec(21).list_times(20)) == []


CASE = """\
version: 1
system: {{file: robot.yaml}}
cases:
  one:
    until: 1
    {}
"""


@pytest.mark.parametrize(
    ('text', 'finding'),
    [
        ('then: [{topik: /a}]', "6:13 unknown-key: unknown key 'topik' in expectation "
         "(did you mean 'topic'?)"),
        ('then: [{topic: /a, log: b}]', "6:24 conflicting-keys: 'topic' and 'log' cannot be used "
         'together in expectation (keep one of them)'),
        ('then: [{log: b, where: a}]', "6:21 missing-key: 'where' requires 'topic'"),
        ('then: [{topic: /a, within: [1]}]', '6:32 out-of-range: expected at least 2 items, got 1'),
        ('then: [{topic: /a, within: [1, 2, 3]}]', '6:32 out-of-range: expected at most 2 items, got 3'),
        ('then: [{topic: /a, rate: [1, 2], within: [1, 2]}]', "6:38 conflicting-keys: 'rate' and "
         "'within' cannot be used together in expectation (keep one of them)"),
        ('then: [{topic: /a b}]', '6:20 bad-value: expected a full name, as in /scan; got '
         "'/a b'"),
        ('when: [{at: -1, publish: /a}]\n    then: []', '6:17 out-of-range: expected at least 0, got -1'),
        ('when: [{at: 1, publish: /a, times: 3}]\n    then: []', "6:33 missing-key: 'times' requires 'every'"),
        ('then: [{topic: /a, never: false}]', '6:31 wrong-type: expected true or a string, got false'),
        ('then: [{log: a, regex: b}]', "6:21 unknown-key: unknown key 'regex' in expectation (did you mean 'matches'?)"),
        ('given: {}', "4:3 missing-key: the key 'then' is missing in case 'one'"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_the_structure_is_found(load, text, finding):
    assert said(load(CASE.format(text))) == [finding]


def test_what_is_wrong_leaves_the_rest(load):
    loaded = load("""\
        version: 1
        system: {file: robot.yaml}
        until: 1
        cases:
          one:
            when: [{at: -1, publish: /a}, {publish: /b}]
            then: [{topic: /a}, {topic: 1}]
          two: {given: 1, then: []}
          three: {then: []}
    """)
    one, three = loaded.spec.cases.values()
    assert (one.name, three.name) == ('one', 'three')
    assert [each.path[-1] for each in (*one.steps, *one.expectations)] == [1, 0]


@pytest.mark.parametrize(
    ('system', 'finding'),
    [
        ('{file: robto.yaml}', "2:16 unreadable-file: there is no file 'robto.yaml' "
         "(did you mean 'robot.yaml'?)"),
        ('{file: robot.yaml, layers: [a.yaml]}', "2:37 unreadable-file: there is no file 'a.yaml' (there are: drive.scenario.yaml, robot.yaml)"),
        ('{file: robot.yaml, args: {simulatoin: true}}', '2:28 bad-system-argument: there is no argument '
         "'simulatoin' (did you mean 'simulation'?) (the file declares simulation (bool, default false))"),
        ('{file: robot.yaml, set: {nodes.x.y: 1}}', '2:28 bad-system-argument: nodes.x.y=1: there is no '
         "'x' in nodes (there are: governor)"),
        ('{}', "2:1 missing-key: the key 'file' is missing in system"),
    ],
)  # fmt: skip
def test_a_system_that_cannot_be_read_is_found(load, system, finding):
    loaded = load(f'version: 1\nsystem: {system}\ncases: {{one: {{then: [], until: 1}}}}\n')
    assert said(loaded) == [finding]
    assert loaded.system is None


def test_a_case_without_an_end_is_found(load):
    loaded = load('version: 1\nsystem: {file: robot.yaml}\ncases: {one: {then: []}}\n')
    assert said(loaded) == [
        "3:9 missing-key: the key 'until' is missing in case 'one' "
        '(write when the case ends, in seconds since the start of the system)'
    ]
