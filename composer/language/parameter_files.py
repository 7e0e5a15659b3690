"""The parameter files that nodes and processes name: as they are, or changed for ROS.

`expressions: true` stands for the values that the system file has in scope where it names the
file; the names that the file uses take its place.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.input_limits import MAX_VALUES, UnreadableFileError, read_file
from composer.language.paths import PathError, resolve_path
from composer.language.specs import ParameterFileSpec
from composer.ros_parameters.expressions_in_files import Treatment

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from composer.ros_parameters.file_reader import ParameterFile


def parse_parameter_files(data: dict[str, Any]) -> tuple[ParameterFileSpec, ...]:
    """Return the parameter files of a node or process."""
    return tuple(map(_parse_file, data.get('parameter_files', ())))


def _parse_file(data: str | dict[str, Any]) -> ParameterFileSpec:
    if isinstance(data, str):
        return ParameterFileSpec(data)
    values = data.get('expressions', False)
    used = names_used(data['file'], values) if isinstance(values, dict) else {}
    written = None if values is False else json.dumps(used)
    return ParameterFileSpec(data['file'], data.get('root', ''), written)


def read_given_file(
    spec: ParameterFileSpec, most_values: int = MAX_VALUES, samples: Collection[str] = ()
) -> ParameterFile:
    """Read a parameter file as the nodes and processes that name it have it.

    Args:
        most_values: How many keys and values it may have.
        samples: The names in its expressions whose values are samples.

    Raises:
        PathError: It is in a package that is not installed.
    """
    # Most systems have no parameter files.
    from composer.ros_parameters.file_reader import read_parameter_file

    return read_parameter_file(
        resolve_path(spec.file, Path()), most_values, _treatment(spec, samples)
    )


def render_given_file(spec: ParameterFileSpec) -> str:
    """Return the text of a file that is changed before ROS reads it."""
    from composer.ros_parameters.file_reader import render_treated_file

    return render_treated_file(resolve_path(spec.file, Path()), _treatment(spec))


def _treatment(spec: ParameterFileSpec, samples: Collection[str] = ()) -> Treatment:
    return Treatment(spec.root, values_given(spec), samples)


def values_given(spec: ParameterFileSpec) -> dict[str, Any] | None:
    """Return what the expressions of a file have in scope; `None` if they are not evaluated."""
    return None if spec.expressions is None else dict(json.loads(spec.expressions))


def names_used(file: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values whose names stand in a file; all if it cannot be read."""
    try:
        text = read_file(resolve_path(file, Path())).decode(errors='replace')
    except (PathError, UnreadableFileError, ValueError):
        return dict(values)
    words = set(re.findall(r'\w+', text))
    # An argument may have dots, dashes and slashes in its name.
    return {
        name: value
        for name, value in values.items()
        if (name in words if name.isidentifier() else name in text)
    }
