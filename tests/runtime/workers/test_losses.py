"""What is lost with a worker are the servers that nobody else has."""

import pytest

from composer.language.pipeline import load_system
from composer.runtime.workers.losses import find_lost_servers

SYSTEM = """
version: 1
nodes:
  one:
    worker: left
    services:
      alone: {type: std_srvs/srv/SetBool, service: alone, behaviour: parts:serve}
      shared: {type: std_srvs/srv/SetBool, service: shared, behaviour: parts:serve}
    actions: {run: {type: test_msgs/action/Fibonacci, behaviour: parts:run}}
  two:
    namespace: there
    worker: right
    services:
      shared: {type: std_srvs/srv/SetBool, service: /shared, behaviour: parts:serve}
      own: {type: std_srvs/srv/SetBool, behaviour: parts:serve}
"""


@pytest.mark.parametrize(
    ('worker', 'services', 'actions'),
    [('left', {'/alone'}, {'/run'}), ('right', {'/there/own'}, set()), ('none', set(), set())],
)
def test_names_that_only_a_worker_serves_are_lost_with_it(tmp_path, worker, services, actions):
    file = tmp_path / 'system.yaml'
    file.write_text(SYSTEM)
    lost = find_lost_servers(load_system(file).spec, worker)
    assert lost == {'service_clients': services, 'action_clients': actions}
