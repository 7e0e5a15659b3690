"""The values that the parameters of nodes start with: defaults, parameter files, command line."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

from composer.errors import ComposerError
from composer.language.parameter_files import read_given_file
from composer.language.specs import ParameterFileSpec
from composer.ros_parameters.parameter_types import infer_parameter_type

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from composer.language.specs import NodeSpec, ParameterSpec
    from composer.ros_parameters.overrides import MergedFiles

# Marks a parameter for whose values entities are repeated, below its path.
FOREACH = 'foreach'


class StartingValues:
    """What parameters start with; parameter files are read once.

    Args:
        ros_arguments: The arguments after `--ros-args` of the command line.
    """

    def __init__(self, ros_arguments: Sequence[str]) -> None:
        self._ros_arguments = ros_arguments
        self._given = tuple(
            ParameterFileSpec(text)
            for option, text in pairwise(ros_arguments)
            if option == '--params-file'
        )
        self._merged: dict[tuple[ParameterFileSpec, ...], MergedFiles | None] = {}

    def of_node(self, node: NodeSpec) -> dict[str, Any]:
        """Return the values of the parameters that a node declares, by name."""
        return self.find(node.full_name, node.parameters, node.parameter_files)

    def find(
        self,
        full_name: str,
        parameters: Mapping[str, ParameterSpec],
        files: tuple[ParameterFileSpec, ...],
    ) -> dict[str, Any]:
        """Return the values of declared parameters; what does not fit leaves the default."""
        given: dict[str, Any] = {}
        for named in filter(None, (files, self._given)):
            merged = self._merge(named)
            entries = merged.find_overrides(full_name) if merged else {}
            given |= {name: entry.value for name, entry in entries.items()}
        if self._ros_arguments:
            from composer.ros_parameters.overrides import parse_command_line

            words = parse_command_line(self._ros_arguments, full_name)
            given |= {name: value for name, (value, _) in words.items()}
        return {
            name: given[name] if name in given and _fits(each, given[name]) else each.value
            for name, each in parameters.items()
        }

    def _merge(self, files: tuple[ParameterFileSpec, ...]) -> MergedFiles | None:
        if files not in self._merged:
            # Most systems have no parameter files.
            from composer.ros_parameters.overrides import MergedFiles

            try:
                self._merged[files] = MergedFiles(map(read_given_file, files))
            except (ComposerError, ValueError, OSError):
                # What is wrong with them is for the checks to say.
                self._merged[files] = None
        return self._merged[files]


def _fits(parameter: ParameterSpec, value: Any) -> bool:
    """Return whether a value has the type of a parameter; an empty list has that of any list."""
    if value == []:
        return str(parameter.type).endswith('_array')
    return infer_parameter_type(value) == parameter.type
