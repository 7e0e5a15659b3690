"""Which QoS can be kept without the middleware, and what the middleware itself may do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from rclpy.qos import HistoryPolicy, QoSCompatibility, qos_check_compatible

from composer.language import qos
from composer.network.transport_profile import PROFILE, PROFILE_VARIABLES
from composer.runtime.messages.qos_profiles import write_policies

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rclpy.qos import QoSProfile

_SYNCHRONOUS: Final = {'', 'SYNCHRONOUS'}
# Each names a file that may change how Fast DDS delivers; Composer's own does not.
_PROFILE_VARIABLES: Final = (
    *PROFILE_VARIABLES,
    'RMW_FASTRTPS_USE_QOS_FROM_XML',
)


def why_sent(profile: QoSProfile) -> str:
    """Return which policy only the middleware keeps; empty if there is none."""
    return qos.why_sent(write_policies(profile))


def may_be_late(middleware: str, environment: Mapping[str, str]) -> bool:
    """Tell whether a message may be on its way when `publish` has returned."""
    return (
        middleware != 'rmw_fastrtps_cpp'
        or environment.get('RMW_FASTRTPS_PUBLICATION_MODE', '') not in _SYNCHRONOUS
        or any(environment.get(name, '') not in ('', PROFILE) for name in _PROFILE_VARIABLES)
    )


def queue_depth(profile: QoSProfile) -> int | None:
    """Return how many messages a queue holds; `None` for any number."""
    depth: int = profile.depth
    # Where the depth is 0, Fast DDS keeps one.
    return max(depth, 1) if profile.history == HistoryPolicy.KEEP_LAST else None


def are_compatible(offered: QoSProfile, requested: QoSProfile) -> bool:
    """Tell whether ends of these QoS meet."""
    compatibility, _ = qos_check_compatible(offered, requested)
    return bool(compatibility != QoSCompatibility.ERROR)
