"""What external processes are said to have, as data that satisfy the schema → specs."""

from __future__ import annotations

from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import CHANNEL_KINDS, KIND_OF_SECTION
from composer.language.parsing.entity_parser import parse_parameter
from composer.language.parsing.entry_parser import Data, parse_entity_qos, parse_entries
from composer.language.specs import DeclaredEndSpec, DeclaredNodeSpec
from composer.names import expand_namespace, join_names
from composer.ros_parameters.parameter_types import PARAMETER_TYPES, convert_parameter_value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.language.specs import ParameterSpec
    from composer.yaml_text.positions import DataPath

END_SECTIONS = tuple(kind.section for kind in CHANNEL_KINDS)
_OF_DECLARATIONS = {
    *('type', 'default', 'description', 'read_only'),
    *('minimum', 'maximum', 'step', 'choices'),
}


def is_declaration(value: Any) -> bool:
    """Return whether a value under `parameters:` of a process declares a parameter.

    Any other mapping is a group of parameters.
    """
    return (
        isinstance(value, dict)
        and value.get('type') in PARAMETER_TYPES
        and value.keys() <= _OF_DECLARATIONS
    )


def given_values(parameters: Data) -> Data:
    """Return the values that a process is given: declarations have one in `default`, or none."""
    given: Data = {}
    for name, value in parameters.items():
        if not is_declaration(value):
            given[name] = value
        elif 'default' in value:
            given[name] = convert_parameter_value(value['default'], value['type'])
    return given


def given_types(parameters: Data) -> Mapping[str, str]:
    """Return the types of the declarations among the parameters of a process or component."""
    return {name: value['type'] for name, value in parameters.items() if is_declaration(value)}


def parse_declared_nodes(
    process: str, data: Data, path: DataPath
) -> tuple[tuple[DeclaredNodeSpec, ...], bool]:
    """Return the nodes that a process is said to have, and whether they have all of its ends."""
    nodes = data.get('nodes', {})
    entries = (
        [(key, name, entry) for key, (name, entry) in zip(nodes, nodes.items(), strict=True)]
        if isinstance(nodes, dict)
        else [(index, name, None) for index, name in enumerate(nodes)]
    )
    declared = [
        _parse_node(process, data, name, entry, (*path, 'nodes', key))
        for key, name, entry in entries
    ]
    is_complete = all(each.sections is not None for each in declared)
    own = _parse_own_node(process, data, path)
    if own is None or own.sections is None:
        is_complete = is_complete and 'nodes' in data
    return (*declared, *([own] if own else ())), is_complete


def _parse_own_node(process: str, data: Data, path: DataPath) -> DeclaredNodeSpec | None:
    """Return the node whose ends stand beside the keys of its process."""
    is_declared, sections, parameters = parse_own_ends(data, path)
    if not is_declared and not parameters:
        return None
    return DeclaredNodeSpec(
        name=data.get('name', process),
        is_named='name' in data,
        namespace=_namespace_of(data),
        remap=tuple(data.get('remap', {}).items()),
        sections=sections if is_declared else None,
        parameters=parameters,
        declares_all_parameters=False,
        process=process,
        path=path,
    )


def parse_own_ends(
    data: Data, path: DataPath
) -> tuple[bool, Mapping[str, Mapping[str, DeclaredEndSpec]], Mapping[str, ParameterSpec]]:
    """Return whether ends are declared, which, and the parameters declared among the values.

    Args:
        data: A process or a component.
    """
    written = {
        name: value for name, value in data.get('parameters', {}).items() if is_declaration(value)
    }
    is_declared = any(section in data for section in END_SECTIONS)
    parameters = _parse_parameters({'parameters': written}, path)
    return is_declared, _parse_sections(data, path), parameters


def _parse_node(
    process: str, data: Data, name: str, entry: Data | None, path: DataPath
) -> DeclaredNodeSpec:
    full = name if name.startswith('/') else join_names(_namespace_of(data), name)
    namespace, _, last = full.rpartition('/')
    return DeclaredNodeSpec(
        name=last,
        is_named=True,
        namespace=namespace or '/',
        remap=tuple(data.get('remap', {}).items()),
        sections=None if entry is None else _parse_sections(entry, path),
        parameters=_parse_parameters(entry or {}, path),
        declares_all_parameters='parameters' in (entry or {})
        and not (entry or {}).get('allow_undeclared_parameters', False),
        process=process,
        path=path,
    )


def _namespace_of(data: Data) -> str:
    return expand_namespace(data.get('namespace', ''))


def _parse_parameters(data: Data, path: DataPath) -> Mapping[str, ParameterSpec]:
    return parse_entries(data, path, 'parameters', partial(parse_parameter, data))


def _parse_sections(data: Data, path: DataPath) -> Mapping[str, Mapping[str, DeclaredEndSpec]]:
    return MappingProxyType(
        {
            section: parse_entries(data, path, section, partial(_parse_end, section))
            for section in END_SECTIONS
            if section in data
        }
    )


def _parse_end(section: str, name: str, data: str | Data, path: DataPath) -> DeclaredEndSpec:
    entry: Data = {'type': data} if isinstance(data, str) else data
    kind = KIND_OF_SECTION[section]
    is_service = kind.channel == 'service'
    return DeclaredEndSpec(
        name=name,
        type=entry['type'],
        channel=entry.get(str(kind.channel), name),
        qos=parse_entity_qos(entry, path, is_service=is_service) if kind.has_qos else None,
        external=entry.get('external', False),
        path=path,
    )


def entries_with_ends(process: Data) -> Iterator[tuple[DataPath, Data]]:
    """Yield the mappings of a process that hold sections of ends, by their paths in it."""
    yield (), process
    nodes = process.get('nodes')
    for name, node in (nodes if isinstance(nodes, dict) else {}).items():
        if node is not None:
            yield ('nodes', name), node
    for name, component in process.get('components', {}).items():
        yield ('components', name), component
