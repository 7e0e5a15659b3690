"""Which Composer this is."""

from __future__ import annotations

_DISTRIBUTION = 'rclpy-composer'


def find_version() -> str:
    """Return the version that is installed, or that this is a source tree."""
    # This import alone takes a tenth of the time of a check.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(_DISTRIBUTION)
    except PackageNotFoundError:
        return 'of a source tree'
