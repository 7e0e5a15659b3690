"""What is read of a scenario file before its cases are forked."""

import pytest

from composer.scenarios.running.prepared_case import prepare_file

pytestmark = pytest.mark.ros


def test_values_that_are_known_at_the_start_are_read(tmp_path):
    node = 'publishers: {out: std_msgs/msg/String}, parameters: {model: {command: [echo, arm]}}'
    (tmp_path / 'arm.yaml').write_text(f'version: 1\nnodes:\n  arm: {{{node}}}\n')
    path = tmp_path / 'arm.scenario.yaml'
    path.write_text('version: 1\nsystem: {file: arm.yaml}\ncases: {one: {then: [], until: 1}}\n')
    prepared = prepare_file(str(path))
    assert prepared.loaded.system.spec.nodes['arm'].parameters['model'].value.strip() == 'arm'
    assert prepared.limit_of('one') == 60.0
