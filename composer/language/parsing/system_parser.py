"""A system as data that satisfy the schema → its spec."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from composer.language.loaded_system import PARTS
from composer.language.parsing.entry_parser import Data, parse_entries, parse_qos
from composer.language.parsing.node_parser import parse_node
from composer.language.parsing.process_parser import parse_process
from composer.language.specs import (
    DEFAULT_DIAGNOSTICS_PERIOD_SEC,
    DEFAULT_SHUTDOWN_TIMEOUT_SEC,
    QosSpec,
    SystemSpec,
)
from composer.yaml_text.scalars import format_scalar

if TYPE_CHECKING:
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath


def parse_specs(system: LoadedSystem) -> None:
    """Parse the data of a system; what is left out becomes a system of its own.

    Both have the QoS profiles and interfaces.
    """
    name, used = system.path.stem, dict(system.entries)
    if system.left_out:
        unused = dict(used)
        for section in PARTS:
            entries = used.get(section, {})
            used[section] = {
                k: v for k, v in entries.items() if (section, k) not in system.left_out
            }
            if section in ('nodes', 'processes'):
                unused[section] = {k: v for k, v in entries.items() if k not in used[section]}
        system.unused = parse_system(unused, name)
    system.data = used
    system.spec = parse_system(used, name)


def parse_system(data: Data, name: str) -> SystemSpec:
    """Return the system that the data describe.

    Args:
        data: As the schema wants them.
        name: The file's name without its ending.
    """
    executor = data.get('executor', {})
    return SystemSpec(
        name=name,
        description=data.get('description', ''),
        interfaces=MappingProxyType(data.get('interfaces', {})),
        qos=parse_entries(data, (), 'qos', _parse_named_qos),
        threads=int(executor['threads']) if 'threads' in executor else None,
        shutdown_timeout_sec=float(executor.get('shutdown_timeout', DEFAULT_SHUTDOWN_TIMEOUT_SEC)),
        diagnostics_period_sec=_parse_diagnostics(data.get('diagnostics', True)),
        nodes=parse_entries(data, (), 'nodes', parse_node),
        environment=MappingProxyType(
            {name: format_scalar(value) for name, value in data.get('environment', {}).items()}
        ),
        processes=parse_entries(data, (), 'processes', parse_process),
    )


def _parse_diagnostics(data: bool | Data) -> float | None:  # noqa: FBT001 - as it is written
    if data is False:
        return None
    period = data.get('period') if isinstance(data, dict) else None
    return DEFAULT_DIAGNOSTICS_PERIOD_SEC if period is None else float(period)


def _parse_named_qos(name: str, data: Data, path: DataPath) -> QosSpec:  # noqa: ARG001 - a parser of entries
    return parse_qos(data, path)
