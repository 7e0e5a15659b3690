"""Resolved QoS becomes the profile that rclpy has for it."""

import pytest

pytest.importorskip('rclpy')

from rclpy.duration import Infinite
from rclpy.qos import (
    HistoryPolicy,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
)

from composer.language.specs import QosSpec
from composer.runtime.messages.qos_profiles import create_qos_profile

pytestmark = pytest.mark.ros


@pytest.mark.parametrize('preset', [each for each in QoSPresetProfiles if each.name != 'UNKNOWN'])
def test_built_in_profiles_are_those_of_rclpy(preset):
    profile = create_qos_profile(QosSpec(preset.name.lower(), {}, ()), {})

    assert str(profile) == str(preset.value)


def test_depth_alone_is_what_rclpy_makes_of_a_number():
    profile = create_qos_profile(QosSpec('default', {'depth': 7}, ()), {})

    assert (
        profile.get_c_qos_profile().to_dict() == QoSProfile(depth=7).get_c_qos_profile().to_dict()
    )


def test_policies_of_a_chain_of_profiles_add_up():
    profiles = {
        'base': QosSpec('sensor_data', {'depth': 2, 'deadline': 0.25}, ()),
        'derived': QosSpec('base', {'deadline': 'infinite'}, ()),
    }
    profile = create_qos_profile(QosSpec('derived', {'history': 'keep_all'}, ()), profiles)

    assert profile.history is HistoryPolicy.KEEP_ALL
    assert profile.depth == 2
    assert profile.reliability is ReliabilityPolicy.BEST_EFFORT
    assert profile.deadline == Infinite
