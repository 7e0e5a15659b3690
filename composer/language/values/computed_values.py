"""Values that are computed from others: `vars`, and the defaults of arguments.

Each is computed once, after those that it needs. What an expression needs are the names in it.
"""

from __future__ import annotations

from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Diagnostic, Related, Span, diagnostic_at
from composer.errors import StartError
from composer.expressions import ALL_ARGUMENTS, ARGUMENTS
from composer.expressions.scope import Scope
from composer.expressions.templates import TemplateEvaluator
from composer.language.arguments import StartDefault, find_declaration_errors, find_value_problem
from composer.language.values.start_values import StartValues, parse_start_value
from composer.ros_parameters.parameter_types import convert_parameter_value, infer_parameter_type
from composer.schema.structure import is_sound
from composer.yaml_text.document import Document

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.arguments import ArgumentSpec, ArgumentValues
    from composer.yaml_text.positions import DataPath

VARIABLES = 'vars'
# The value of a variable whose own value could not be computed.
_SAMPLE = 'sample'


def infer_argument_types(
    document: Document, declared: Mapping[str, ArgumentSpec], given: ArgumentValues
) -> dict[str, ArgumentSpec]:
    """Return declarations with the types that computed defaults tell.

    Args:
        given: Samples of all other arguments.
    """
    # What is found on the way is found again when the real values are there.
    aside = Document(document.data, document.positions)
    scope = compute_values(aside, declared, given)
    return {
        name: argument
        if argument.type
        else replace(argument, type=_scalar_type(scope.values.get(name)))
        for name, argument in declared.items()
    }


def compute_values(
    document: Document,
    declared: Mapping[str, ArgumentSpec],
    given: ArgumentValues,
    start: StartValues | None = None,
) -> Scope:
    """Return what the expressions of a file have in scope; errors are added to its findings.

    Args:
        start: Where the values come from that are read when the system starts.

    Raises:
        ComposerError: Such a value cannot be read.
    """
    return _Computation(document, declared, given, start or StartValues()).compute()


def _data_of(argument: ArgumentSpec) -> Any:
    default = argument.default
    return dict(default.data) if isinstance(default, StartDefault) else default


def _is_sound(argument: ArgumentSpec) -> bool:
    """Return whether the schema has nothing to say against where a default is read from."""
    return is_sound({ARGUMENTS: {argument.name: _data_of(argument)}})


def _scalar_type(value: Any) -> str:
    type_name = infer_parameter_type(value)
    return type_name if type_name and not isinstance(value, list) else 'string'


class _Computation:
    def __init__(
        self,
        document: Document,
        declared: Mapping[str, ArgumentSpec],
        given: ArgumentValues,
        start: StartValues,
    ) -> None:
        self._document = document
        self._start = start
        self._declared = declared
        self._values = dict(given.values)
        self._samples = set(given.samples)
        self._origins = {name: self._describe_origin(name, given) for name in given.values}
        variables = (document.data or {}).get(VARIABLES)
        self._variables: dict[str, Any] = {
            name: data
            for name, data in (variables if isinstance(variables, dict) else {}).items()
            # What is reported as a name that is taken stands for what has it.
            if name not in declared
        }
        self._pending = {
            name: _data_of(argument)
            for name, argument in declared.items()
            if name not in given.values
        } | self._variables
        self._evaluator = TemplateEvaluator(document, self._scope())

    def compute(self) -> Scope:
        for name in self._in_order():
            self._evaluator = self._evaluator.in_scope(self._scope())
            if name in self._variables:
                self._compute_variable(name)
            else:
                self._compute_default(self._declared[name])
        return self._scope()

    def _scope(self) -> Scope:
        choices = {name: each.choices for name, each in self._declared.items() if each.choices}
        names = tuple(self._declared)
        return Scope(self._values, frozenset(self._samples), self._origins, names, choices)

    def _in_order(self) -> list[str]:
        """Return the names, each after those that it needs; those in cycles get samples."""
        needs: dict[str, list[str]] = {}
        for name, data in self._pending.items():
            names = self._evaluator.names_in(data)
            used = {*names, *self._declared} if ALL_ARGUMENTS in names else names
            needs[name] = sorted(used & self._pending.keys())
        while True:
            try:
                return list(TopologicalSorter(needs).static_order())
            except CycleError as error:
                self._report_cycle(error.args[1], needs)

    def _report_cycle(self, cycle: list[str], needs: dict[str, list[str]]) -> None:
        # The sorter lists each name before the one that needs it.
        names = cycle[:0:-1]
        start = min(range(len(names)), key=lambda index: list(self._pending).index(names[index]))
        first, *others = names = [*names[start:], *names[:start]]
        chain = ', which needs '.join(f"'{name}'" for name in [*others, first])
        message = f"'{first}' needs {chain}" if others else f"'{first}' needs itself"
        related = [Related(f"'{name}' is computed here", self._span(name)) for name in others]
        self._document.diagnostics.append(
            diagnostic_at(
                self._span(first),
                'value-cycle',
                message,
                help='give one of them a value that needs none of the others' if others else None,
                related=related,
            )
        )
        for name in names:
            needs.pop(name)
            self._use_sample(name)
        for others in needs.values():
            others[:] = [other for other in others if other not in names]

    def _compute_variable(self, name: str) -> None:
        path = self._path(name)
        value, has_failed, is_sampled = self._evaluate(self._variables[name], path)
        if has_failed:
            self._use_sample(name)
        else:
            self._set(name, value, is_sampled=is_sampled)

    def _evaluate(self, data: Any, path: DataPath) -> tuple[Any, bool, bool]:
        """Return data with values in place, whether one has failed, and one is a sample."""
        dropped, sampled = len(self._document.dropped), len(self._document.sampled)
        value = self._evaluator.evaluate(data, path)
        has_failed = len(self._document.dropped) > dropped
        return value, has_failed, len(self._document.sampled) > sampled

    def _compute_default(self, argument: ArgumentSpec) -> None:
        path = self._path(argument.name)
        value, has_failed, is_sampled = self._evaluate(_data_of(argument), path)
        if has_failed:
            self._use_sample(argument.name)
            return
        if isinstance(argument.default, StartDefault):
            if not _is_sound(argument):
                self._use_sample(argument.name)
                return
            data = {**value, 'type': argument.type}
            if 'file' in data and not data['file'].startswith('package://'):
                folder = self._document.positions.value((*path, 'file')).source.folder
                data['file'] = str(folder / data['file'])
            name = f"argument '{argument.name}'"
            source = parse_start_value(name, data, path, self._document.positions)
            value, is_sample = self._start.value_of(source)
            if is_sample:
                self._use_sample(argument.name)
                return
            if problem := find_value_problem(argument, value):
                message = f'{source.span}: {problem}'
                raise StartError(message)
        if argument.type:
            value = convert_parameter_value(value, argument.type)
        # A choice that is the default itself lets nobody give another value.
        choices = (value if each == argument.default else each for each in argument.choices)
        computed = replace(argument, default=value, choices=tuple(choices))
        problems = list(self._find_problems(computed))
        if problems:
            self._use_sample(argument.name)
            if not is_sampled:
                self._document.diagnostics += problems
        else:
            self._set(argument.name, value, is_sampled=is_sampled)

    def _find_problems(self, argument: ArgumentSpec) -> list[Diagnostic]:
        span = self._span(argument.name)
        if isinstance(argument.default, list | dict | None):
            message = f'an argument is a bool, a number or a string, not {argument.default!r}'
            return [diagnostic_at(span, 'bad-argument-declaration', message, help=_HELP)]
        return [
            diagnostic_at(span, 'bad-argument-declaration', problem, help=advice)
            for keys, problem, advice in find_declaration_errors(argument)
            if keys == ('default',)
        ]

    def _set(self, name: str, value: Any, *, is_sampled: bool) -> None:
        self._values[name] = value
        self._origins[name] = self._span(name).place
        if is_sampled:
            self._samples.add(name)

    def _use_sample(self, name: str) -> None:
        declared = self._declared.get(name)
        self._values[name] = declared.sample if declared else _SAMPLE
        self._origins[name] = self._span(name).place
        self._samples.add(name)

    def _describe_origin(self, name: str, given: ArgumentValues) -> str:
        return given.origins.get(name) or f'default, {self._span(name).place}'

    def _path(self, name: str) -> DataPath:
        if name not in self._declared:
            return VARIABLES, name
        path = (ARGUMENTS, name, 'default')
        return path if path in self._document.positions.values else path[:-1]

    def _span(self, name: str) -> Span:
        return self._document.positions.value(self._path(name))


_HELP = "declare lists and mappings under 'vars'"
