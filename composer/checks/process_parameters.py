"""Parameters of processes: values that rcl refuses or reads as something else.

Where the parameters of its nodes are declared: values that these refuse or ignore.
Source: `parse_value` and `parse_key` in rcl (`rcl_yaml_param_parser/src/parse.c`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.checks.connections.typos import find_typo
from composer.checks.parameters import (
    OF_EVERY_NODE,
    find_nearest_choice,
    find_refusal,
    warn_of_texts_for_bools,
)
from composer.language.specs import ProcessSpec
from composer.names import find_parameter_name_problem, with_article
from composer.ros_parameters.parameter_types import (
    convert_parameter_value,
    find_type_problem,
    infer_parameter_type,
    suggest_value,
)
from composer.spelling import suggest
from composer.yaml_text.scalars import suggest_flat

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ComponentSpec, DeclaredNodeSpec, ParameterSpec
    from composer.yaml_text.positions import DataPath

_RULE = 'bad-parameter'
# Parameters with which ROS changes the QoS of a publisher or subscription.
_OVERRIDES = 'qos_overrides.'
NO_TYPE = 'an empty list has no type here, and ends nodes of rclcpp'
LEAVE_OUT = 'leave it out: the node then keeps its own default'
_WITH_TYPE = 'write {default: [], type: string_array}, with the type that is meant'
_NO_NULL = 'there is no value, and ROS has no null'


def check_process_parameters(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that ROS takes the names and values."""
    nodes = {node.path: node for each in context.spec.processes.values() for node in each.nodes}
    for component in context.spec.components:
        path = (*component.path, 'parameters')
        given: dict[str, DataPath] = {}
        yield from _check_mapping(context, component.parameters, path, '', given)
        yield from _check_texts(context, component, given.values())
        yield from _check_types(context, component, given, component.types)
        if own := nodes.get(component.path):
            yield from _compare_with_declared(context, component, given, [own])
    for process in context.spec.processes.values():
        path = (*process.path, 'parameters')
        seen: dict[str, DataPath] = {}
        yield from _check_mapping(context, process.parameters, path, '', seen)
        declared = {name for node in process.nodes for name in node.parameters}
        open_places = [at for name, at in seen.items() if name not in declared]
        yield from _check_texts(context, process, open_places)
        types = {
            name: parameter.type
            for node in process.nodes
            for name, parameter in node.parameters.items()
            if parameter.path == seen.get(name)
        }
        yield from _check_types(context, process, seen, types)
        if process.nodes:
            yield from _compare_with_declared(context, process, seen, process.nodes)


def _check_texts(
    context: CheckContext, owner: ProcessSpec | ComponentSpec, places: Iterable[DataPath]
) -> Iterator[Diagnostic]:
    for path in places:
        yield from warn_of_texts_for_bools(context, _value_at(owner, path), path)


def _check_types(
    context: CheckContext,
    owner: ProcessSpec | ComponentSpec,
    places: Mapping[str, DataPath],
    types: Mapping[str, str | None],
) -> Iterator[Diagnostic]:
    """Report values without a type: a process gets its parameters in a file.

    Args:
        types: The types that are declared.
    """
    is_file = isinstance(owner, ProcessSpec)
    for name, path in places.items():
        if is_file and types.get(name) == 'byte_array':
            what, advice = 'a process gets a parameter file, which has no byte type', LEAVE_OUT
        elif _value_at(owner, path) == [] and (is_file or name not in types):
            what, advice = NO_TYPE, LEAVE_OUT if is_file else _WITH_TYPE
        else:
            continue
        inner = (*path, 'default')
        at = inner if inner in context.system.positions.values else path
        yield context.at_value(at, _RULE, f"parameter '{name}': {what}", help=advice)


def _value_at(owner: ProcessSpec | ComponentSpec, path: DataPath) -> Any:
    value: Any = owner.parameters
    for key in path[len(owner.path) + 1 :]:
        value = value[key]
    return value


def _compare_with_declared(
    context: CheckContext,
    owner: ProcessSpec | ComponentSpec,
    given: Mapping[str, DataPath],
    nodes: Sequence[DeclaredNodeSpec],
) -> Iterator[Diagnostic]:
    declared: dict[str, list[ParameterSpec]] = {}
    for node in nodes:
        for name, parameter in node.parameters.items():
            declared.setdefault(name, []).append(parameter)
    apart = [node for node in nodes if node.path != owner.path]
    knows_all = bool(apart) and all(node.declares_all_parameters for node in apart)
    for name, path in given.items():
        if name in OF_EVERY_NODE or name.startswith(_OVERRIDES):
            continue
        if name in declared:
            yield from _find_refusals(context, owner, path, declared[name])
        elif knows_all or find_typo(name, declared):
            yield context.at_key(
                path,
                'undeclared-parameter',
                f"{_kind_of(owner)} '{owner.name}' declares no parameter '{name}', "
                'and ROS ignores it',
                help=suggest(name, declared, 'declared are', 'it declares none'),
            )


def _find_refusals(
    context: CheckContext,
    owner: ProcessSpec | ComponentSpec,
    path: DataPath,
    declared: list[ParameterSpec],
) -> Iterator[Diagnostic]:
    value = _value_at(owner, path)
    for parameter in declared:
        if any(path[: len(parameter.path)] == each.path for each in declared):
            return  # The value of the declaration itself.
        inferred = infer_parameter_type(value)
        if parameter.type is None or inferred is None:
            continue
        help_text = find_nearest_choice(parameter, value)
        if inferred != parameter.type:
            got, wanted = with_article(inferred), with_article(parameter.type)
            problem: str | None = f'expected {wanted}, and ROS takes this for {got}'
            help_text = suggest_value(parameter.type, value) or help_text
        else:
            problem = find_refusal(parameter, value)
        if problem:
            yield context.at_value(
                path,
                'refused-parameter',
                f"parameter '{parameter.name}' of {_kind_of(owner)} '{owner.name}': {problem}",
                help=help_text,
                related=[context.related(parameter.path, 'declared here')],
            )
            return


def _kind_of(owner: ProcessSpec | ComponentSpec) -> str:
    return 'process' if isinstance(owner, ProcessSpec) else 'component'


def _check_mapping(
    context: CheckContext,
    values: Mapping[str, Any],
    path: DataPath,
    prefix: str,
    seen: dict[str, DataPath],
) -> Iterator[Diagnostic]:
    for key, value in values.items():
        at, name = (*path, key), f'{prefix}{key}'
        if problem := find_parameter_name_problem(name):
            yield context.at_key(at, 'bad-name', f"'{name}': {problem}")
        elif isinstance(value, dict) and value:
            yield from _check_mapping(context, value, at, f'{name}.', seen)
        elif name in seen:
            yield context.at_key(at, _RULE, f"the parameter '{name}' is given twice")
        else:
            seen[name] = at
            for place, problem in _find_problems(value):
                help_text = suggest_flat(value[place[0]]) if place else None
                message = f"parameter '{name}': {problem}"
                yield context.at_value((*at, *place), _RULE, message, help=help_text)


def _find_problems(value: Any) -> Iterator[tuple[tuple[int, ...], str]]:
    """Yield the errors of a value; those of list items with their index."""
    if value is None:
        yield (), _NO_NULL
    elif isinstance(value, dict):
        yield (), 'the mapping is empty, and ROS misreads what follows one'
    elif isinstance(value, list):
        # Integers among doubles become doubles.
        yield from _find_list_problems(convert_parameter_value(value, infer_parameter_type(value)))
    else:
        yield from _find_scalar_problems(value, ())


def _find_list_problems(items: list[Any]) -> Iterator[tuple[tuple[int, ...], str]]:
    for index, item in enumerate(items):
        if item is None:
            yield (index,), f'item {index}: {_NO_NULL}'
        elif isinstance(item, list | dict):
            what = 'lists' if isinstance(item, list) else 'mappings'
            yield (index,), f'item {index}: a list of parameters cannot contain {what}'
        elif infer_parameter_type([items[0], item]) is None:
            types = (infer_parameter_type(each) for each in (item, items[0]))
            own, first = (with_article(str(each)) for each in types)
            yield (index,), f'item {index}: a list has one type, and this is {own}, not {first}'
        else:
            yield from _find_scalar_problems(item, (index,))
            continue
        # One is enough: what follows may be right or wrong for the same reason.
        return


def _find_scalar_problems(
    value: Any, place: tuple[int, ...]
) -> Iterator[tuple[tuple[int, ...], str]]:
    type_name = str(infer_parameter_type(value))
    problem = find_type_problem(value, type_name)
    if problem:
        yield place, problem
