"""When a unit counts as up, and when its start has failed, by what systemd says of it."""

import pytest

from composer.hosts.agent import host_unit
from composer.hosts.agent.host_errors import HostError
from composer.hosts.agent.host_unit import Service

SUCCEEDED = {'Result': 'success', 'ExecMainExitTimestamp': 'Mon 2026-11-23 14:00:00 UTC'}
STATES = {
    'up': {'ActiveState': 'active'},
    'over': {'ActiveState': 'inactive', **SUCCEEDED},
    # `start --no-block` returns before systemd has begun; the unit is as the last stop left it.
    'queued': {'ActiveState': 'inactive', 'Job': '7', **SUCCEEDED},
    'queued at first': {'ActiveState': 'inactive', 'Job': '7'},
    'coming': {'ActiveState': 'activating'},
    'failed': {'ActiveState': 'failed', 'Result': 'exit-code'},
    'left': {'ActiveState': 'inactive'},
    'started again': {'ActiveState': 'activating', 'NRestarts': '1'},
}
USUAL = {'SubState': '', 'NRestarts': '0', 'Result': 'success', 'ExecMainExitTimestamp': ''}


@pytest.mark.parametrize(
    ('names', 'problem'),
    [
        (['up'], None),
        (['over'], None),
        (['queued', 'queued at first', 'coming', 'up'], None),
        (['queued', 'failed'], 'the system did not start'),
        (['queued', 'left'], 'the system did not start'),
        (['coming', 'started again'], 'the system did not start'),
    ],
)
def test_a_start_ends_as_systemd_says(monkeypatch, names, problem):
    states = [USUAL | STATES[name] for name in names]
    monkeypatch.setattr(host_unit, '_POLL_SEC', 0.0)
    service = Service('unit', 'system', '')
    monkeypatch.setattr(service, 'state', lambda: states.pop(0))
    monkeypatch.setattr(service, 'last_log', str)
    if problem is None:
        service.wait_until_up(10.0)
    else:
        with pytest.raises(HostError, match=problem):
            service.wait_until_up(10.0)
    assert states == []
