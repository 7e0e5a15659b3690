"""QoS profiles by name: those of ROS, and those of a file that start from others."""

import pytest

from composer.language.pipeline import load_system_text
from composer.language.qos import BUILTIN_PROFILES, QosError, resolve_qos
from composer.language.specs import QosSpec


def qos(profile, path=(), **policies):
    return QosSpec(profile, policies, path)


def own_profiles():
    """Return rclpy's profiles by the names that they have here."""
    from rclpy import qos as rclpy_qos

    members = rclpy_qos.QoSPresetProfiles.__members__
    presets = {name.lower(): preset.value for name, preset in members.items()}
    assert presets.keys() >= {'sensor_data', 'best_available'}
    return {'default': rclpy_qos.QoSProfile(depth=10), **presets}


@pytest.mark.ros
@pytest.mark.parametrize('name', BUILTIN_PROFILES)
def test_a_profile_of_ros_is_rclpys_own(name):
    from composer.runtime.messages.qos_profiles import create_qos_profile

    theirs = own_profiles()[name]
    ours = create_qos_profile(qos(name), {})
    assert ours.get_c_qos_profile().to_dict() == theirs.get_c_qos_profile().to_dict()


@pytest.mark.ros
def test_every_profile_of_rclpy_has_its_name_here():
    here = BUILTIN_PROFILES.keys()
    assert {name for name in own_profiles() if name not in here} <= {'unknown'}


def test_a_built_in_profile_is_its_policies():
    assert resolve_qos(qos('sensor_data'), {}) == {
        'history': 'keep_last',
        'depth': 5,
        'reliability': 'best_effort',
        'durability': 'volatile',
        'liveliness': 'system_default',
    }


def test_own_policies_win_over_those_of_the_profile():
    profiles = {
        'slow': qos('sensor_data', depth=2, deadline=1.0),
        'slower': qos('slow', deadline=2.0, durability='transient_local'),
    }
    resolved = resolve_qos(qos('slower', depth=7), profiles)
    assert resolved == {
        'history': 'keep_last',
        'depth': 7,
        'reliability': 'best_effort',
        'durability': 'transient_local',
        'liveliness': 'system_default',
        'deadline': 2.0,
    }


def test_an_unknown_profile_is_told_with_the_qos_that_names_it():
    profiles = {'slow': qos('nowhere', ('qos', 'slow'))}
    with pytest.raises(QosError) as raised:
        resolve_qos(qos('slow', ('here',)), profiles)
    assert str(raised.value) == "there is no QoS profile 'nowhere'"
    assert raised.value.spec.path == ('qos', 'slow')


@pytest.mark.parametrize('length', [1, 2, 5])
def test_profiles_that_lead_back_to_themselves_are_told(length):
    profiles = {
        f'p{number}': qos(f'p{(number + 1) % length}', ('qos', f'p{number}'))
        for number in range(length)
    }
    with pytest.raises(QosError, match=r"^the QoS profile 'p0' leads back to itself$") as raised:
        resolve_qos(qos('p0', ('here',)), profiles)
    assert raised.value.spec.path == ('qos', f'p{length - 1}')


def test_an_unknown_profile_of_a_service_is_a_finding():
    service = '{type: std_srvs/srv/Empty, behaviour: a:b, qos: nope}'
    system = load_system_text(f'version: 1\nnodes: {{a: {{services: {{x: {service}}}}}}}\n')
    assert [each.message for each in system.diagnostics] == ["there is no QoS profile 'nope'"]
