"""The plugin of pytest: scenario files are tests, and tests drive systems in this process."""

import pytest

from tests.plugin import PLUGIN_OPTIONS

pytestmark = pytest.mark.ros

SYSTEM = """
    version: 1
    args: {speed: {default: 1.0}, shout: {default: false}}
    nodes:
      driver:
        parameters: {speed: "{{ speed }}", other: 0}
        on_start: parts:begin
        on_parameters: parts:validate
        state: {heard: []}
        publishers: {out: {type: std_msgs/msg/Float64, external: true}}
        subscriptions:
          scan: {type: std_msgs/msg/Float64, external: true, behaviour: 'parts:react', publish: out}
        services:
          reset: {type: std_srvs/srv/Trigger, behaviour: 'parts:reset'}
"""
CODE = """
    import time

    def begin(node):
        if node.parameters.speed > 100:
            raise OSError('no device')

    def validate(node, changes):
        return 'too fast' if changes.get('speed', 0) > 100 else None

    def react(node, message):
        if message.data < 0:
            raise ValueError('negative')
        node.state.heard.append(message.data)
        print('reacting')
        time.sleep(1.0)
        node.logger.info(f'drives at {node.parameters.speed}')
        return 0.0 if message.data < 0.5 else node.parameters.speed

    def reset(node, request):
        node.state.heard.clear()
        return {'success': True, 'message': 'done'}
"""
SCENARIO = """
    version: 1
    system: {file: ../configs/car.yaml}
    until: 3
    cases:
      stops:
        when: [{at: 1, publish: /scan, message: {data: 0.2}}]
        then: [{topic: /out, message: {data: 0.0}, within: [2, 2]}]
      never drives:
        when: [{at: 1, publish: /scan, message: {data: 2}}]
        then: [{topic: /out, never: data > 0}]
"""


@pytest.fixture
def run(pytester, monkeypatch):
    """Run pytest on tests beside a system, in a process of its own."""
    pytester.makefile('.toml', pyproject='[tool.pytest.ini_options]\nfilterwarnings = ["error"]')
    for folder in ('configs', 'tests'):
        pytester.mkdir(folder)
    files = {'configs/car.yaml': SYSTEM, 'parts.py': CODE}

    def run(*words, **tests):
        for name, text in (files | {f'tests/{key}': text for key, text in tests.items()}).items():
            lines = [line.removeprefix('    ') for line in text.splitlines()]
            (pytester.path / name).write_text('\n'.join(lines) + '\n')
        options = ('-p', 'no:cacheprovider', *PLUGIN_OPTIONS)
        return pytester.runpytest_subprocess(*options, *words, timeout=200)

    return run


def test_cases_are_tests_their_failures_our_reports_and_errors_in_files_fail_them_all(run):
    files = {
        'car.scenario.yaml': SCENARIO,
        'typo.scenario.yaml': SCENARIO.replace('/scan', '/scann'),
        'odd.scenario.yaml': 'version: 1\ncasses: {}\n',
    }
    result = run('-v', '--continue-on-collection-errors', **files)
    result.assert_outcomes(passed=1, failed=3, errors=1)
    told = ['tests/typo.scenario.yaml:7:*error[[]*', "*did you mean '/scan'?*"]
    for lines in (
        [
            'tests/car.scenario.yaml::stops PASSED*',
            'tests/car.scenario.yaml::never drives FAILED*',
            '*tests/car.scenario.yaml:11:*: expected no message on /out where data > 0, got 1*',
            '*/out {data: 1.0}*',
            "seed 0; to run this case again: composer test 'tests/car.scenario.yaml::never drives'*",
        ],
        ['tests/odd.scenario.yaml:2:*error[[]*', "*did you mean 'cases'?*"],
        [*told, *told],
    ):
        result.stdout.fnmatch_lines(lines)
    result.stdout.no_fnmatch_line('*Traceback*')


DRIVING = """
    import math
    import time
    from pathlib import Path

    import parts
    import pytest
    from composer.errors import ComposerError, StartError, UsageError


    def test_it_drives_in_virtual_time(composer):
        begun = time.monotonic()
        system = composer('configs/car.yaml', speed=2.0)
        system.publish('/scan', {'data': 3.0})
        system.forward(0.9)
        assert system.messages('/out') == []
        system.forward(0.2)
        assert system.messages('/out')[-1].data == 2.0
        system.forward(3600.0)
        assert time.monotonic() - begun < 60


    def test_it_is_driven_as_from_a_command_line(composer):
        system = composer(
            '../configs/car.yaml', set_values=['nodes.driver.parameters.speed=4.0'], seed=3
        )
        system.publish('/scan', {'data': 1.0})
        assert system.forward_until(lambda: system.messages('/out'))
        assert math.isclose(system.now, 1.0)
        assert system.messages('/out')[0].data == 4.0
        assert system.state('driver').heard == [1.0]
        assert system.call('/reset').message == 'done'
        assert system.state('driver').heard == []
        system.set_parameters('driver', {'speed': 5.0})


    def test_behaviours_can_be_patched(composer, monkeypatch):
        monkeypatch.setattr(parts.time, 'sleep', lambda seconds: None)
        system = composer('configs/car.yaml')
        system.publish('/scan', {'data': 1.0})
        system.forward(0.0)
        assert len(system.messages('/out')) == 1


    def test_systems_run_one_after_another_but_not_at_once(composer):
        first = composer('configs/car.yaml')
        with pytest.raises(ComposerError, match='another simulated system runs'):
            composer('configs/car.yaml')
        first.stop()
        second = composer('configs/car.yaml', speed=7.0)
        second.publish('/scan', 1.0)
        second.forward(1.0)
        assert [message.data for message in second.messages('/out')] == [7.0]


    @pytest.mark.parametrize('path', ['configs/none.yaml', '../none.yaml'])
    def test_a_file_that_is_not_there(composer, path):
        with pytest.raises(UsageError, match='there is no file'):
            composer(path)


    def test_arguments_that_do_not_fit(composer):
        with pytest.raises(UsageError, match='spead'):
            composer('configs/car.yaml', spead=1)


    def test_errors_that_are_looked_at_are_expected(composer):
        system = composer('configs/car.yaml')
        system.publish('/scan', {'data': -1.0})
        system.forward(0.1)
        (error,) = system.errors
        assert 'negative' in error.value


    def test_a_system_that_refuses_to_start(composer):
        with pytest.raises(StartError, match='no device'):
            composer('configs/car.yaml', speed=200.0)


    @pytest.mark.parametrize('atomically', [True, False])
    def test_parameters_are_set_each_or_all(composer, atomically):
        system = composer('configs/car.yaml')
        with pytest.raises(ComposerError, match='too fast'):
            system.set_parameters('driver', {'speed': 200.0, 'other': 1}, atomically=atomically)
        assert system.parameters('driver')['other'] == int(not atomically)
"""
FAILING = """
    def test_that_fails(composer):
        system = composer('configs/car.yaml')
        system.publish('/scan', {'data': 3.0})
        system.forward(2.0)
        assert system.messages('/out')[-1].data == 9.0


    def test_that_ignores_an_error(composer):
        system = composer('configs/car.yaml')
        system.publish('/scan', {'data': -3.0})
        system.forward(0.1)
"""


def test_tests_in_python_drive_systems_and_failures_show_what_those_did(run):
    """Other plugins work with it."""
    files = {'test_car.py': DRIVING, 'test_failing.py': FAILING}
    result = run('-n', '1', '--timeout', '100', **files)
    result.assert_outcomes(passed=12, failed=1, errors=1)
    for lines in (
        ['*a behaviour raised an error*', '*ValueError: negative'],
        [
            '*assert 1.0 == 9.0*',
            '*composer: last events call*',
            '1.000000000 message /driver /out {data: 1.0}',
            '*composer: log call*',
            '1 s [[]info[]] [[]/driver[]]: drives at 1.0',
        ],
    ):
        result.stdout.fnmatch_lines(lines)


def test_it_costs_nothing_where_it_is_not_used(run):
    text = """
    import sys

    def test_it():
        assert 'composer.simulation' not in sys.modules
        assert 'jsonschema' not in sys.modules
    """
    run(**{'test_plain.py': text}).assert_outcomes(passed=1)
