"""The environment variables by which programs find the interface packages of a system."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING

from composer.ament import PACKAGE_INDEX, ament_prefixes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from composer.language.specs import SystemSpec


def extend_variables(variables: Mapping[str, str], prefixes: Sequence[Path]) -> dict[str, str]:
    """Return the values of variables by which programs find packages and what is there already.

    Args:
        variables: the environment before.
        prefixes: of the packages.
    """
    if not prefixes:
        return {}
    # Tools take what AMENT_PREFIX_PATH does not name for not installed: wheels, for example.
    installed = [each for each in ament_prefixes() if (each / PACKAGE_INDEX).is_dir()]
    return {
        'AMENT_PREFIX_PATH': _extend(variables, 'AMENT_PREFIX_PATH', prefixes, installed),
        'LD_LIBRARY_PATH': _extend(variables, 'LD_LIBRARY_PATH', (p / 'lib' for p in prefixes)),
        'PYTHONPATH': _extend(variables, 'PYTHONPATH', (p / 'python' for p in prefixes)),
    }


def extend_processes(spec: SystemSpec, prefixes: Sequence[Path]) -> SystemSpec:
    """Return a system whose processes find packages also if they set such variables themselves."""

    def extend(env: Mapping[str, str]) -> dict[str, str]:
        extended = extend_variables(env, prefixes)
        return {name: extended.get(name, value) for name, value in env.items()}

    processes = {
        name: replace(process, env=extend(process.env)) for name, process in spec.processes.items()
    }
    return replace(spec, processes=processes)


def _extend(
    variables: Mapping[str, str], name: str, first: Iterable[Path], last: Iterable[Path] = ()
) -> str:
    before = variables.get(name)
    entries = before.split(os.pathsep) if before else []
    return os.pathsep.join(dict.fromkeys([*map(str, first), *entries, *map(str, last)]))
