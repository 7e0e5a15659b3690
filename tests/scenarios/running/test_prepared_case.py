"""What is done before the clock of a case begins."""

import pytest

pytest.importorskip('rclpy')

from composer.errors import ComposerError
from composer.interfaces.build import provision
from composer.scenarios.running.prepared_case import prepare_file

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
interfaces: {own_parts: own_parts}
nodes:
  n:
    publishers: {part: own_parts/msg/Part}
    timers: {tell: {period: 1, publish: part, message: {number: 1}}}
"""


def test_packages_that_the_system_declares_are_built(tmp_path, monkeypatch):
    asked = []

    def provide(packages, _progress):
        asked.extend(each.package for each in packages)
        message = 'no compiler'
        raise ComposerError(message)

    monkeypatch.setattr(provision, 'provide_packages', provide)
    (tmp_path / 'own_parts/msg').mkdir(parents=True)
    (tmp_path / 'own_parts/msg/Part.msg').write_text('int32 number\n')
    (tmp_path / 'system.yaml').write_text(SYSTEM)
    scenario = tmp_path / 'it.scenario.yaml'
    scenario.write_text(
        'version: 1\nsystem: {file: system.yaml}\nuntil: 1.0\ncases:\n  it runs:\n    then:\n'
        '      - {exit_code: 0}\n'
    )
    # That they cannot be built is told by the case.
    assert prepare_file(str(scenario)).loaded.spec.cases
    assert asked == ['own_parts']
