"""What nodes refuse, at the start and later, and goals that only the end of a case ends."""

import pytest

pytestmark = pytest.mark.ros

SYSTEM = """
    version: 1
    nodes:
      driver:
        parameters: {mode: works, limit: 1.0, other: 0, device: {type: string}}
        on_start: parts:begin
        on_parameters: parts:validate
      second: {parameters: {limit: 1.0}}
      managed: {lifecycle: {start: active}, parameters: {mode: works}, on_configure: 'parts:configure'}
      worker:
        actions: {work: {type: test_msgs/action/Fibonacci, behaviour: 'parts:work'}}
"""
CODE = """
    import time

    def begin(node):
        if node.parameters.mode == 'fails':
            raise OSError('no port')
        if node.parameters.mode == 'needs':
            node.logger.info(node.parameters.device)
            if node.parameters.device is None:
                raise ValueError('no device is given')
        if node.parameters.mode == 'sets':
            node.set_parameters('driver', {'limit': 1.5})

    def validate(node, changes):
        return 'not by half' if changes.get('limit') == 1.5 else None

    def configure(node):
        if node.parameters.mode == 'fails':
            raise OSError('no motor')

    def work(node, goal):
        if goal.order > 90:
            raise ValueError('too far')
        end = time.monotonic() + goal.order
        while time.monotonic() < end:
            time.sleep(0.5)
            yield [1]
        return [goal.order]
"""
SET = 'at: 1, set_parameters: {driver: {limit: 1.5, other: 3}}'
LONG = '{at: 1, send_goal: /work, goal: {order: 50}'
NO_RESULT = 'the goal of /work has no result at 1 s: the case ended before'
# The mode of the driver and that of the managed node, the steps, what is expected, and the failures.
CASES = [
    ('fails', 'works', '', '{error: driver, text: no port}', []),
    ('needs', 'works', '', '{error: driver, text: no device}', []),
    ('sets', 'works', '', '{error: driver, text: not by half}', []),
    ('works', 'fails', '', '{error: managed, text: no motor}', []),
    ('sets', 'works', '', '{exit_code: 1}', []),
    ('fails', 'works', '', '{error: driver, text: no motor}', [
        'on_start of /driver raised OSError: no port at 0 s',
        'expected an error of /driver with "no motor", got none among 1 error']),
    ('fails', 'works', '', '{exit_code: 2}',
     ['expected the system to end with exit code 2, got 1 at 0.0005 s']),
    ('fails', 'works', '{at: 1, call: /driver/get_parameters}', '{exit_code: 1}',
     ['the step at 1 s is not done: the system ended at 0.0005 s']),
    ('works', 'works', '', '{error: driver, text: no port}',
     ['expected an error of /driver with "no port", got no error']),
    ('works', 'works', '', '{exit_code: 1}',
     ['expected the system to end with exit code 1, but it ran on']),
    ('works', 'works', f'{{{SET}}}', '{parameters: {driver: {limit: 1.0, other: 3}}}', [
        "the parameters of /driver cannot be set at 1 s: node '/driver' refused 'limit': not by half"]),
    ('works', 'works', f'{{{SET}, refused: true}}', '{parameters: {driver: {other: 3}}}',
     ["expected /driver to refuse the parameters at 1 s, but 'other' of /driver can be set"]),
    ('works', 'works', f'{{{SET}, refused: true, atomically: true}}',
     '{parameters: {driver: {limit: 1.0, other: 0}}}', []),
    ('works', 'works', f'{{{SET}, atomically: true}}', '{parameters: {driver: {other: 0}}}', [
        "the parameters of /driver cannot be set at 1 s: node '/driver' refused all: not by half"]),
    ('works', 'works', '{at: 1, set_parameters: {driver: {limit: 1.5}, second: {limit: 1.5}}, refused: true}',
     '', ["expected /driver, /second to refuse the parameters at 1 s, but 'limit' of /second can be set"]),
    ('works', 'works', '{at: 1, send_goal: /work, goal: {order: 91}, status: aborted}', '{error: worker}', []),
    ('works', 'works', f'{LONG}, cancel_at: 2, status: canceled}}', '', []),
    *(('works', 'works', f'{LONG}{rest}}}', "{error: '*', count: [0, 1]}", [NO_RESULT])
      for rest in (', status: aborted', ', cancel_at: 3')),
]  # fmt: skip


def test_what_is_refused_or_not_ended_can_be_expected_and_nothing_else(project, run_json):
    project.write('system.yaml', SYSTEM)
    project.write('parts.py', CODE)
    lines = (
        f'case {number}: {{given: {{parameters: {{driver: {{mode: {driver}}}, managed: {{mode: '
        f'{managed}}}}}}}, when: [{when}], then: [{then}]}}\n'
        for number, (driver, managed, when, then, _) in enumerate(CASES)
    )
    project.scenario(''.join(lines))
    _, report = run_json('--jobs', '2')
    assert report['findings'] == []
    said = [[each['message'] for each in case['failures']] for case in report['cases']]
    assert said == [case[-1] for case in CASES]
