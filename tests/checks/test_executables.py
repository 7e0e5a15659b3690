"""Processes: what must be installed, and what need not be."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

SYSTEM = """
version: 1
args: {simulation: %s}
nodes: {}
processes:
  driver: {when: "{{ not simulation }}", package: vendor_camera, executable: driver}
"""


@pytest.mark.parametrize(
    ('simulation', 'messages'),
    [('true', []), ('false', ["no package 'vendor_camera' is installed"])],
)
def test_a_process_that_is_left_out_may_be_of_another_machine(
    tmp_path, monkeypatch, simulation, messages
):
    (tmp_path / 'share/ament_index/resource_index/packages').mkdir(parents=True)
    (tmp_path / 'share/ament_index/resource_index/packages/other').touch()
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    path = tmp_path / 'system.yaml'
    path.write_text(SYSTEM % simulation)

    findings = check_system(load_system(path), InterfaceCatalogue())

    assert [finding.message for finding in findings] == messages
