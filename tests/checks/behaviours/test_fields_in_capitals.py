"""A name in capitals is that of a constant, or of a field that ROS 1 wrote so."""

import pytest

from composer.cli.main import run

pytestmark = pytest.mark.ros

SYSTEM = """
version: 1
nodes:
  a:
    subscriptions:
      info: {type: sensor_msgs/msg/CameraInfo, external: true, behaviour: parts:hear}
      state: {type: sensor_msgs/msg/BatteryState, external: true, behaviour: parts:hear_state}
"""
CODE = """
def hear(node, message):
    node.logger.info(str(message.NAME))

def hear_state(node, message):
    node.logger.info(str(message.CONSTANT))
"""
LEVEL = 'POWER_SUPPLY_STATUS_FULL'


@pytest.mark.parametrize(
    ('field', 'constant', 'said'),
    [
        ('k', LEVEL, ''),
        ('K', LEVEL, "CameraInfo has no field 'K'\nhelp: did you mean 'k'?"),
        ('HEIGHT', LEVEL, "CameraInfo has no field 'HEIGHT'\nhelp: did you mean 'height'?"),
        (
            'k',
            f'{LEVEL}L',
            f"BatteryState has no constant '{LEVEL}L'\nhelp: did you mean '{LEVEL}'?",
        ),
    ],
)
def test_a_name_in_capitals_may_be_a_field(field, constant, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 's.yaml').write_text(SYSTEM)
    code = CODE.replace('NAME', field).replace('CONSTANT', constant)
    (tmp_path / 'parts.py').write_text(code)
    assert run(['check', 's.yaml']) == bool(said)
    output = capsys.readouterr().out
    for line in filter(None, said.split('\n')):
        assert line in output
