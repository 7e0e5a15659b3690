"""Values of entities that follow parameters: taken out of the data, and filled in once known."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from composer.diagnostics import diagnostic_at
from composer.entity_kinds import CHANNEL_KINDS
from composer.language.specs import ParameterReference
from composer.language.values.parameter_values import FOREACH, StartingValues
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.diagnostics import Diagnostic
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import NodeSpec, ParameterSpec, SystemSpec
    from composer.yaml_text.positions import DataPath

_PARAMETER = 'parameter'
_NUMBERS = ('integer', 'double')
# What stands for a value that is not known, and the types that its parameter may have.
_KEYS: dict[str, tuple[Any, tuple[str, ...]]] = {
    'rate': (1.0, _NUMBERS),
    'period': (1.0, _NUMBERS),
    'depth': (10, ('integer',)),
    **{str(kind.channel): ('', ('string', *_NUMBERS)) for kind in CHANNEL_KINDS},
}
# A timer follows these at once; what else follows a parameter is created with its value.
TIMES = ('rate', 'period')
# As those of periods that the file gives.
_SHORTEST_SEC = 1e-6
_LONGEST_SEC = 1e9


def take_references(
    name: str, data: dict[str, Any], path: DataPath
) -> tuple[dict[str, Any], dict[str, ParameterReference]]:
    """Return the data of an entity with stand-ins for what follows parameters, and that."""
    qos = data.get('qos')
    has_depth = isinstance(qos, dict) and isinstance(qos.get('depth'), dict)
    followed = [key for key in _KEYS if isinstance(data.get(key), dict)]
    if not (followed or has_depth):
        return data, {}
    references = {key: _parse(data[key], (*path, key)) for key in followed}
    plain = data | {key: _KEYS[key][0] or name for key in followed}
    if isinstance(qos, dict) and has_depth:
        references['depth'] = _parse(qos['depth'], (*path, 'qos', 'depth'))
        plain['qos'] = qos | {'depth': _KEYS['depth'][0]}
    return plain, references


def _parse(data: dict[str, Any], path: DataPath) -> ParameterReference:
    return ParameterReference(
        data[_PARAMETER], data.get('format', '{}'), float(data.get('scale', 1.0)), path
    )


def fill_in(system: LoadedSystem, spec: SystemSpec) -> SystemSpec:
    """Return a system in which what follows parameters has the values that these start with."""
    values = StartingValues(system.ros_arguments)
    nodes = {}
    for key, node in spec.nodes.items():
        listed = _listed(system, node)
        if not (listed or _references(node)):
            nodes[key] = node
            continue
        known = values.of_node(node)
        filled = with_values(node, known, listed)
        system.diagnostics += _find_problems(system, node, known)
        nodes[key] = node if filled == node else filled
    return replace(spec, nodes=nodes)


def _listed(system: LoadedSystem, node: NodeSpec) -> list[str]:
    """Return the parameters for whose values entities are repeated."""
    marked = system.positions.values
    return [
        name for name in node.parameters if (*node.path, 'parameters', name, FOREACH) in marked
    ]


def _references(node: NodeSpec) -> list[tuple[str, Any, str, ParameterReference]]:
    """Return the section and the entity of each value that follows a parameter, and its key."""
    return [
        (kind.section, entity, key, reference)
        for kind, entity in node.entities()
        for key, reference in getattr(entity, 'by_parameter', {}).items()
    ]


def listed_parameters(node: NodeSpec) -> frozenset[str]:
    """Return the parameters of a node for whose values entities are repeated, and no more."""
    return frozenset(node.followed) - {reference.parameter for *_, reference in _references(node)}


def with_values(node: NodeSpec, values: Mapping[str, Any], listed: Iterable[str] = ()) -> NodeSpec:
    """Return a node in which what follows parameters has these values.

    What is not read again is a parameter that cannot be set while the node runs.

    Args:
        listed: The parameters for whose values entities are repeated.
    """
    sections: dict[str, Any] = {}
    times: set[str] = set()
    fixed = set(listed)
    for section, entity, key, reference in _references(node):
        entities = sections.setdefault(section, dict(getattr(node, section)))
        value = values.get(reference.parameter)
        (times if key in TIMES else fixed).add(reference.parameter)
        if not find_value_problem(key, reference, value):
            entities[entity.name] = _with_value(entities[entity.name], key, reference, value)
    parameters = {
        name: replace(each, read_only=True) if name in fixed and not each.read_only else each
        for name, each in node.parameters.items()
    }
    followed = tuple(sorted({*node.followed, *fixed, *times}))
    return replace(node, parameters=parameters, followed=followed, **sections)


def _with_value(entity: Any, key: str, reference: ParameterReference, value: Any) -> Any:
    if key in TIMES:
        return replace(entity, period_sec=period_of(key, reference, value))
    if key == 'depth':
        policies = {**entity.qos.policies, 'depth': value}
        return replace(entity, qos=replace(entity.qos, policies=policies))
    return replace(entity, **{key: reference.format.replace('{}', str(value))})


def period_of(key: str, reference: ParameterReference, value: float) -> float:
    """Return the seconds that a rate or a period means which is the value of a parameter."""
    scaled = value * reference.scale
    return scaled if key == 'period' else 1.0 / scaled


def find_value_problem(key: str, reference: ParameterReference, value: Any) -> str:
    """Return what is wrong with a value that something follows; empty if nothing is."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return 'it has no value' if value is None else f'{value!r} is no {key}'
    if key not in TIMES and key != 'depth':
        return '' if reference.format.replace('{}', str(value)) else f'a {key} has a name'
    if isinstance(value, str) or (key == 'depth' and isinstance(value, float)):
        return f'{value!r} is no number'
    if not value > 0:
        return f'the {key} must be more than 0, not {value!r}'
    if key in TIMES and not _SHORTEST_SEC <= period_of(key, reference, value) <= _LONGEST_SEC:
        return f'{value!r} is too much or too little'
    return ''


def _find_problems(
    system: LoadedSystem, node: NodeSpec, values: Mapping[str, Any]
) -> Iterator[Diagnostic]:
    """Yield what is wrong with the parameters that something of a node follows."""
    for _, _, key, reference in _references(node):
        span = system.positions.value((*reference.path, _PARAMETER))
        parameter = node.parameters.get(reference.parameter)
        if parameter is None:
            if (*node.path, 'parameters') in system.dropped:
                continue
            message = f"node '{node.name}' declares no parameter '{reference.parameter}'"
            advice = suggest(reference.parameter, node.parameters, 'its parameters are')
            yield diagnostic_at(span, 'bad-parameter-reference', message, help=advice)
            continue
        if parameter.path in system.dropped or (*parameter.path, 'default') in system.dropped:
            continue
        problem, advice = _find_problem(key, reference, parameter, values[parameter.name])
        if problem:
            message = f"a {key} cannot follow parameter '{parameter.name}': {problem}"
            yield diagnostic_at(span, 'bad-parameter-reference', message, help=advice)


def _find_problem(
    key: str, reference: ParameterReference, parameter: ParameterSpec, value: Any
) -> tuple[str, str | None]:
    """Return why a value cannot follow a parameter, and what helps; empty if it can."""
    types = _KEYS[key][1]
    if parameter.type not in types:
        wanted = ' or '.join(types)
        return f"it is of type '{parameter.type}'", f'declare it with a default of type {wanted}'
    problem = find_value_problem(key, reference, value)
    if problem:
        return problem, 'give it a default'
    allowed = parameter.choices or (() if parameter.minimum is None else (parameter.minimum,))
    if key in TIMES and not (allowed and all(each > 0 for each in allowed)):
        least = 1 if parameter.type == 'integer' else 0.001
        return 'it may be 0', f"give it a range, as in 'minimum: {least}'"
    return '', None
