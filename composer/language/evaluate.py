"""The steps in which arguments get their values, and expressions are evaluated with these."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Related, diagnostic_at
from composer.entity_kinds import KIND_OF_SECTION
from composer.expressions import BUILT_IN, SECTIONS, has_conditions, is_variable_name
from composer.language.arguments import (
    find_declaration_errors,
    parse_declarations,
    sample_values,
)
from composer.language.namespaces import full_node_name, join_namespaces, split_node_name
from composer.language.parameter_files import parse_parameter_files
from composer.language.parsing.entity_parser import parse_parameter
from composer.language.paths import with_paths
from composer.language.values.parameter_values import StartingValues
from composer.language.values.start_values import is_start_value
from composer.ros_parameters.parameter_types import find_texts_for_bools
from composer.schema.structure import correct_outer_keys, is_sound

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from composer.diagnostics import Diagnostic
    from composer.language.arguments import ArgumentSpec, GiveValues
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import SourceMap


def give_arguments(system: LoadedSystem, give_values: GiveValues) -> None:
    """Read which arguments a file declares, and give each its value.

    Args:
        give_values: Returns the values of the declared arguments. It is not called if a
            declaration is wrong, which has to be corrected first: samples are taken then.
    """
    written = system.entries.get('args', {})
    correct_outer_keys(system)
    system.arguments = parse_declarations(system.entries)
    findings = list(_check_declarations(system.arguments, system.positions))
    system.diagnostics += [*findings, *_check_variables(system)]
    system.diagnostics += _warn_of_texts_for_bools(system.arguments, system.positions)
    is_usable = not findings and is_sound({'args': written})
    if not all(argument.type for argument in system.arguments.values()):
        from composer.language.values.computed_values import infer_argument_types

        samples = sample_values(system.arguments)
        system.arguments = infer_argument_types(system, system.arguments, samples)
    system.given = (give_values if is_usable else sample_values)(system.arguments)


def evaluate_expressions(system: LoadedSystem) -> None:
    """Evaluate the expressions of a file, and repeat or leave out its entries."""
    data = system.entries
    is_plain = not (_has_expressions(system.positions) or _has_conditions(data))
    if is_plain and not any(each.is_computed for each in system.arguments.values()):
        return
    # jinja2 takes a tenth of a check's time to import, and most files have no expressions.
    from composer.expressions.foreach import expand_document
    from composer.language.values.computed_values import compute_values

    declarations = {key: data[key] for key in ('args', 'vars', 'check') if key in data}
    rest = {key: value for key, value in data.items() if key not in declarations}
    before = len(system.diagnostics)
    scope = compute_values(system, system.arguments, system.given, system.start)
    expanded = expand_document(system, rest, scope, partial(_find_list, system))
    # Of a file with too many entries nothing is left.
    system.data = None if expanded is None else expanded | declarations
    if not all(isinstance(data.get(key, {}), dict) for key in ('args', 'vars')):
        # Nothing is known of the arguments, not even their names.
        found = system.diagnostics[before:]
        system.diagnostics[before:] = [each for each in found if each.rule != 'undefined-name']


def _find_list(
    system: LoadedSystem,
    defaults: Mapping[str, Any],
    key: str,
    node: Mapping[str, Any],
    name: Any,
) -> tuple[str, Any]:
    """Return what is wrong with a parameter for whose values entities are repeated, and these."""
    declared = node.get('parameters')
    data = declared.get(name) if isinstance(declared, dict) and isinstance(name, str) else None
    if data is None:
        return f"node '{key}' declares no parameter '{name}'", None
    if is_start_value(data) or not is_sound({'nodes': {key: {'parameters': {name: data}}}}):
        return f"the list of parameter '{name}' must stand in the file or in parameter files", None
    spec = parse_parameter({}, name, data, ('nodes', key, 'parameters', name))
    outer = join_namespaces(system.namespace, str(defaults.get('namespace', '')))
    namespace, simple = split_node_name(key, dict(node))
    full_name = full_node_name(join_namespaces(outer, str(namespace)), simple)
    files = parse_parameter_files(with_paths(dict(node), ('nodes', key), system.positions))
    values = StartingValues(system.ros_arguments).find(full_name, {name: spec}, files)
    if not isinstance(values[name], list):
        return f"parameter '{name}' of node '{key}' is no list", None
    return '', values[name]


def _has_expressions(positions: SourceMap) -> bool:
    # `expressions: true` is about those of a parameter file.
    return any(
        '{{' in line or 'expressions' in line
        for source in positions.sources()
        for line in source.lines
    )


def _has_conditions(data: Mapping[str, Any]) -> bool:
    if any(has_conditions(data.get(section)) for section in SECTIONS):
        return True
    nodes = data.get('nodes')
    return any(
        key in KIND_OF_SECTION and has_conditions(section)
        for node in (nodes.values() if isinstance(nodes, dict) else ())
        if isinstance(node, dict)
        for key, section in node.items()
    )


def _check_variables(system: LoadedSystem) -> Iterable[Diagnostic]:
    variables = system.entries.get('vars')
    for name in variables if isinstance(variables, dict) else ():
        related: tuple[Related, ...] = ()
        if not is_variable_name(name):
            message = f"'{name}' cannot be used as a name in expressions"
        elif name in system.arguments:
            message = f"'{name}' is an argument already"
            span = system.positions.key(('args', name))
            related = (Related('declared here', span),)
        elif name in BUILT_IN:
            message = f"'{name}' means something else in expressions"
        else:
            continue
        span = system.positions.key(('vars', name))
        advice = 'choose another name'
        yield diagnostic_at(span, 'bad-variable', message, help=advice, related=related)


def _check_declarations(
    declared: Mapping[str, ArgumentSpec], positions: SourceMap
) -> Iterable[Diagnostic]:
    for name, argument in declared.items():
        for key, problem, advice in find_declaration_errors(argument):
            path = ('args', name, *key)
            span = positions.value(path) if key else positions.key(path)
            yield diagnostic_at(span, 'bad-argument-declaration', problem, help=advice)


def _warn_of_texts_for_bools(
    declared: Mapping[str, ArgumentSpec], positions: SourceMap
) -> Iterable[Diagnostic]:
    for name, argument in declared.items():
        path = ('args', name)
        if argument.choices or (*path, 'type') in positions.values:
            continue
        for keys in ((), ('default',)):
            found = find_texts_for_bools(argument.default, (*path, *keys), positions)
            for at, message, advice in found:
                yield diagnostic_at(positions.value(at), 'text-for-bool', message, help=advice)
