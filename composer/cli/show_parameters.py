"""`composer show --params`: the parameters of all nodes, as they are when the system starts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from composer.checks.checker import create_context
from composer.checks.parameter_files import check_parameter_files
from composer.cli.output import show_findings
from composer.diagnostics import has_errors
from composer.errors import ExitCode
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.paths import resolve_path
from composer.language.pipeline import load_system
from composer.ros_parameters.overrides import find_overrides
from composer.ros_parameters.parameter_files import read_parameter_file
from composer.ros_parameters.writer import render_parameter_file

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.diagnostics import Diagnostic
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import NodeSpec

_SIM_TIME = 'use_sim_time'


def show_parameters(paths: Sequence[Path], words: Sequence[str], settings: Sequence[str]) -> int:
    """Print one parameter file for a whole system; return the exit code.

    Raises:
        UsageError: The arguments or settings do not fit the file.
    """
    system = load_system(paths[0], words, layers=paths[1:], settings=settings)
    findings = _find_faults(system)
    show_findings(findings)
    if has_errors(findings) or system.spec is None:
        return ExitCode.FAILED
    nodes = system.spec.nodes.values()
    click.echo(
        render_parameter_file({node.full_name: final_values(node) for node in nodes}), nl=False
    )
    return ExitCode.DONE


def final_values(node: NodeSpec) -> dict[str, tuple[str, Any]]:
    """Return type and value of each parameter of a node that has one, by its name."""
    files = [read_parameter_file(resolve_path(text, Path())) for text in node.parameter_files]
    overrides = find_overrides(files, node.full_name)
    values = {_SIM_TIME: ('bool', True)} if node.use_sim_time else {}
    if _SIM_TIME in overrides:
        values[_SIM_TIME] = 'bool', overrides[_SIM_TIME].value
    for name, spec in node.parameters.items():
        value = overrides[name].value if name in overrides else spec.value
        if value is not None:
            values[name] = str(spec.type), value
    return values


def _find_faults(system: LoadedSystem) -> list[Diagnostic]:
    context, _ = create_context(system, InterfaceCatalogue())
    found = check_parameter_files(context) if context else ()
    return list(dict.fromkeys([*system.diagnostics, *found]))
