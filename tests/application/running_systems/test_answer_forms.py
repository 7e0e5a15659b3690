"""Whoever is on the ROS graph may send answers: those of another form are refused."""

import json

import pytest

from composer.application.running_systems.answer_forms import STATUS, TOP, read_answer
from composer.errors import ComposerError

EXTERNAL = {
    'name': 'driver',
    'state': 'running',
    'pid': 8,
    'restarts': 1,
    'cpu': None,
    'memory_bytes': 4096,
    'level': 'ok',
    'message': '',
}
STATUS_ANSWER = {
    'version': 1,
    'name': 'arm',
    'file': '/arm.yaml',
    'host': 'rover',
    'state': 'running',
    'pid': 7,
    'uptime_sec': 1.5,
    'last_error': '',
    'nodes': ['/a'],
    'components': ['/b'],
    'stopped': [],
    'workers': [{'name': 'w'}],
    'lifecycles': {'/a': 'active'},
    'awaited': {'/b': "service '/s'"},
    'external_processes': [EXTERNAL],
    'more': None,
    'health': {'level': 'ok', 'message': ''},
    'last_reload': {'time': 1, 'succeeded': True},
}
ENTITY = {
    'node': '/a',
    'kind': 'timer',
    'name': 't',
    'key': '',
    'queued': 0,
    'cpu': None,
    'worker': '',
    'mean_ms': 1.0,
    'p50_ms': 1.0,
    'p99_ms': 1.0,
    'delivery_p50_ms': None,
    'delivery_p99_ms': 2.0,
    'max_ms': 1.0,
    'rate_hz': 1.0,
    'errors': 0,
    'dropped': 0,
    'late': 0,
    'skipped': 0,
    'delivery': None,
    'delivery_reason': '',
}
PROCESS = {
    'worker': '',
    'pid': 1,
    'cores': 2,
    'cpu': 0.5,
    'gil_wait_mean_ms': 0.1,
    'gil_wait_max_ms': 0.2,
}
TOP_ANSWER = {
    'version': 1,
    'name': 'robot',
    'period': 3,
    'period_sec': 1,
    'has_cpu': False,
    'external_processes': [EXTERNAL],
    'processes': [PROCESS],
    'entities': [ENTITY],
}
# What stands in place of a value, as JSON.
WRONG = ('{}', '[]', '[null]', '"\\u001b"', 'true', 'NaN', '1e400', '1' + 20 * '0', '[' * 100000)


def test_answers_of_the_form_are_read():
    assert read_answer(json.dumps(STATUS_ANSWER), STATUS) == STATUS_ANSWER
    assert read_answer(json.dumps({**STATUS_ANSWER, 'health': None}), STATUS)['health'] is None
    assert read_answer(json.dumps(TOP_ANSWER), TOP) == TOP_ANSWER
    assert read_answer('{"version": 1, "more": 2}')['more'] == 2


@pytest.mark.parametrize(('answer', 'form'), [(STATUS_ANSWER, STATUS), (TOP_ANSWER, TOP)])
def test_others_are_refused(answer, form):
    texts = ['', '{', 'null', '7', *WRONG, *(json.dumps({**answer, 'version': 2}),)]
    for key in form:
        texts.append(json.dumps({name: each for name, each in answer.items() if name != key}))
        for wrong in WRONG:
            # A text with an escape, and a boolean, are in order for some.
            if (key == 'has_cpu' and wrong == 'true') or (form[key] is str and '"' in wrong):
                continue
            if (isinstance(form[key], list), wrong) == (True, '[]'):
                continue
            if wrong == '{}' and key in ('lifecycles', 'awaited'):
                continue
            texts.append(json.dumps({**answer, key: '@'}).replace('"@"', wrong))
    if form is TOP:
        texts += [json.dumps({**answer, 'entities': [{**ENTITY, key: {}}]}) for key in ENTITY]
    for text in texts:
        with pytest.raises(ComposerError, match='does not know'):
            read_answer(text, form)
