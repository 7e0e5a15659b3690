"""The environment variables by which programs find the interface packages of a system."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from composer.ament import PACKAGE_INDEX
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from composer.language.specs import SystemSpec


@record
class Entries:
    """What to add to a variable that holds a list of paths.

    Attributes:
        first: The paths to put first.
        last: Those to put last.
    """

    first: Sequence[str]
    last: Sequence[str] = ()

    def add_to(self, value: str | None) -> str:
        """Return a value with the paths added, and none of them twice."""
        before = value.split(os.pathsep) if value else []
        return os.pathsep.join(dict.fromkeys([*self.first, *before, *self.last]))


def find_entries(prefixes: Sequence[Path]) -> dict[str, Entries]:
    """Return what to add to which variables to find packages that are not installed.

    Args:
        prefixes: Of the packages.
    """
    if not prefixes:
        return {}
    # Tools find only what AMENT_PREFIX_PATH names; wheels are used without it.
    wheels = [str(each) for each in (Path(sys.prefix),) if (each / PACKAGE_INDEX).is_dir()]
    return {
        'AMENT_PREFIX_PATH': Entries([str(each) for each in prefixes], wheels),
        'LD_LIBRARY_PATH': Entries([str(each / 'lib') for each in prefixes]),
        'PYTHONPATH': Entries([str(each / 'python') for each in prefixes]),
    }


def extend_variables(variables: Mapping[str, str], prefixes: Sequence[Path]) -> dict[str, str]:
    """Return the new values of the variables by which programs find packages."""
    entries = find_entries(prefixes)
    return {name: each.add_to(variables.get(name)) for name, each in entries.items()}


def extend_processes(spec: SystemSpec, prefixes: Sequence[Path]) -> SystemSpec:
    """Return a system whose processes find packages also if they set such variables themselves."""

    def extend(env: Mapping[str, str]) -> dict[str, str]:
        extended = extend_variables(env, prefixes)
        return {name: extended.get(name, value) for name, value in env.items()}

    processes = {
        name: replace(process, env=extend(process.env)) for name, process in spec.processes.items()
    }
    return replace(spec, processes=processes)
