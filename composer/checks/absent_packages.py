"""Packages that are not installed: errors, or what cannot be checked where there is no ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.ament import has_ros

if TYPE_CHECKING:
    from collections.abc import Iterable

    from composer.diagnostics import Diagnostic

# The rules that need the packages of the machine where the system runs.
_RULES = ('uninstalled-package', 'missing-package')


class AbsentPackages:
    """Leaves out findings about packages that are not installed, and counts them.

    Only without ROS 2: with it, a system that needs another package cannot start here, and a
    misspelt name is one that is not installed.

    Args:
        is_strict: Whether to leave none out.
    """

    def __init__(self, *, is_strict: bool = False) -> None:
        self._names: set[str] = set()
        self._places: set[tuple[object, ...]] = set()
        self._leaves_out = not is_strict and not has_ros()

    def leave_out(self, findings: Iterable[Diagnostic]) -> list[Diagnostic]:
        """Return the findings that are about something else."""
        if not self._leaves_out:
            return list(findings)
        kept = []
        for finding in findings:
            if finding.rule in _RULES:
                self._places.add(finding.sort_key)
                self._names.update(finding.message.split("'")[1:2])
            else:
                kept.append(finding)
        return kept

    @property
    def note(self) -> str | None:
        """What was not checked; `None` if nothing was left out."""
        if not self._places:
            return None
        count = len(self._places)
        plural = 's' if count > 1 else ''
        names = ', '.join(sorted(self._names))
        return f'{count} use{plural} of packages that are not installed ({names})'
