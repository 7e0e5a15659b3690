"""Expressions inside scalars: `{{ name }}`, evaluated by sandboxed jinja2.

A scalar that is one whole expression keeps the type of its value; in any other the values become
text. Names that are not in scope are errors. Source: https://jinja.palletsprojects.com/en/3.1.x/.
`here`, in scope everywhere, is the folder of the file that the expression stands in.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from jinja2 import (
    StrictUndefined,
    TemplateError,
    TemplateRuntimeError,
    TemplateSyntaxError,
    UndefinedError,
    nodes,
)
from jinja2.exceptions import SecurityError

from composer.confidential import hide, origin_of
from composer.diagnostics import Diagnostic, Related, diagnostic_at
from composer.expressions import ARGUMENTS, written_in_expression
from composer.expressions.evaluation import UnknownArgumentError, evaluate_expression
from composer.expressions.functions import PackageError
from composer.expressions.sandbox import Sandbox
from composer.expressions.scanner import OPEN, code_of, find_expressions, locate_name
from composer.input_limits import MAX_FINDINGS
from composer.programs import shell_environment
from composer.spelling import find_nearest, suggest
from composer.yaml_text.scalars import format_scalar

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.diagnostics import Span
    from composer.expressions.scope import Scope
    from composer.yaml_text.document import Document
    from composer.yaml_text.positions import DataPath

_UNDEFINED_NAME = re.compile(r"'([^']+)' is undefined")
_UNKNOWN_FILTER = re.compile(r"there is no filter '(\w+)'")
_ENV = re.compile(r"""\benv\(\s*['"]([^'"]*)['"]""")
# Beyond this no number is even a double; much longer ones Python will not print.
_MAX_BITS = 1024
# The nearest name is searched for so many undefined ones: each search takes a millisecond.
_MOST_SEARCHED = 100
# Where `none` is no value of its own.
_MAY_LACK_VALUES = (('processes',), ('containers',), ('environment',))
_EQUALITIES = ('eq', 'ne')
_MEMBERSHIPS = ('in', 'notin')
_NUMBERS = (bool, int, float)


class TemplateEvaluator:
    """Evaluates the expressions of one document.

    Args:
        document: Findings, and what else is learnt about the values, go there.
        scope: What is in scope.
        sandbox: What is shared with the other evaluators of the document.
    """

    def __init__(
        self,
        document: Document,
        scope: Scope,
        sandbox: Sandbox | None = None,
    ) -> None:
        self.document = document
        self.positions = document.positions
        self.scope = scope
        self._values = scope.values
        self._sandbox = sandbox or Sandbox()

    def spend_on_values(self, count: int) -> None:
        """Count the work that a loop of `foreach` takes for so many values.

        Raises:
            TemplateRuntimeError: There is no work left.
        """
        self._sandbox.budget.spend_on_values(count)

    def in_scope(self, scope: Scope) -> TemplateEvaluator:
        """Return an evaluator with another scope, for the same document."""
        return TemplateEvaluator(self.document, scope, self._sandbox)

    def within(self, name: str, value: Any, origin: str, *, is_sample: bool) -> TemplateEvaluator:
        """Return an evaluator with one more name in scope, for the same document."""
        return self.in_scope(self.scope.within(name, value, origin, is_sample=is_sample))

    def of_samples(self) -> TemplateEvaluator:
        """Return an evaluator for which all values only stand for others of their type."""
        return self.in_scope(replace(self.scope, samples=frozenset(self.scope.values)))

    def names_in(self, data: Any) -> frozenset[str]:
        """Return the names that the expressions in data use, as far as they can be read."""
        if isinstance(data, dict):
            data = [*data, *data.values()]
        if isinstance(data, list):
            return frozenset().union(*map(self.names_in, data))
        if not (isinstance(data, str) and OPEN in data):
            return frozenset()
        with suppress(TemplateError):
            return self._names_in(data, list(find_expressions(data, self._sandbox)))
        return frozenset()

    def evaluate(self, data: Any, path: DataPath) -> Any:
        """Return data with the values of all expressions in place."""
        if isinstance(data, dict):
            return self.evaluate_mapping(data, path)
        if isinstance(data, list):
            items = ((self.evaluate(item, (*path, at)), item) for at, item in enumerate(data))
            return [found for found, item in items if not _is_left_out(found, item, path)]
        if isinstance(data, str) and OPEN in data:
            return self._evaluate(data, path)
        return data

    def evaluate_mapping(self, data: dict[str, Any], path: DataPath) -> dict[str, Any]:
        """Return a mapping with the values of the expressions in its keys and values in place."""
        filled: dict[str, Any] = {}
        for written, value in data.items():
            key = self.evaluate_key((*path, written))
            if key != written and (key in data or key in filled):
                self.report_duplicate(key, (*path, written), (*path, key))
                continue
            if key != written:
                self.positions.move((*path, written), (*path, key))
            found = self.evaluate(value, (*path, key))
            if not _is_left_out(found, value, path):
                filled[key] = found
        return filled

    def evaluate_key(self, path: DataPath) -> str:
        """Return the key at the end of a path with the values of its expressions in place."""
        written = str(path[-1])
        if OPEN not in written:
            return written
        return _as_text(self._evaluate(written, path, is_key=True))

    def is_sampled(self, path: DataPath) -> bool:
        """Return whether the value at a path depends on samples."""
        return path in self.document.sampled_paths

    def _evaluate(self, text: str, path: DataPath, *, is_key: bool = False) -> Any:
        if self._sandbox.explained > MAX_FINDINGS:
            # Nobody sees more, and each takes its time.
            self.document.dropped.add(path)
            return text
        span = self.positions.key(path) if is_key else self.positions.value(path)
        sampled = False
        expressions: list[slice] = []
        try:
            expressions = list(find_expressions(text, self._sandbox))
            names = self._names_in(text, expressions)
            self.document.notes[path] = self._note(names)
            sampled = self.scope.has_samples(names)
            if sampled:
                self.document.sampled.append(span)
                self.document.sampled_paths |= set() if is_key else {path}
            return self._compute(text, expressions, span)
        except Exception as error:  # noqa: BLE001 - an expression may raise whatever it calls
            self.document.dropped.add(path)
            # It may succeed with the real value.
            is_sure = not sampled or isinstance(error, UndefinedError)
            if is_sure:
                self._sandbox.explained += 1
                origin = self._hidden_origin(text, expressions)
                part = _part_at_fault(error, text, expressions)
                place = span.narrowed_to(part, first=True)
                self.document.diagnostics.append(self._explain(error, place, origin))
            return text

    def _compute(self, text: str, expressions: list[slice], span: Span) -> Any:
        value = self._join(text, expressions, span)
        origin = self._hidden_origin(text, expressions)
        if origin is not None:
            outside = [text[end.stop : begin.start] for end, begin in pairwise(expressions)]
            ends = text[: expressions[0].start], text[expressions[-1].stop :]
            hide(value, origin, ' '.join((*ends, *outside)))
        return value

    def _join(self, text: str, expressions: list[slice], span: Span) -> Any:
        first, last = expressions[0], expressions[-1]
        outside = text[: first.start], text[last.stop :]
        if first is last and not ''.join(outside).strip():
            return self._value_of(text, first, span)
        parts = []
        start = 0
        for expression in expressions:
            parts.append(text[start : expression.start])
            parts.append(_as_text(self._value_of(text, expression, span)))
            start = expression.stop
        return ''.join([*parts, text[start:]])

    def _value_of(self, text: str, expression: slice, span: Span) -> Any:
        scope, code = self._values, code_of(text, expression)
        if ARGUMENTS in code:
            every = {ARGUMENTS: self.scope.argument_values()}
            is_one, scope = ARGUMENTS in self.scope.arguments, {**every, **scope}
            scope |= every if is_one else {}
        if 'here' in self._names_in(text, [expression]):
            scope = {'here': os.path.realpath(span.source.folder), **scope}
        value = _as_data(evaluate_expression(self._sandbox, code, scope))
        for message, part, advice in find_useless_comparisons(
            self._sandbox.parse_expression(code), self.scope
        ):
            place = span.narrowed_to(part)
            self.document.diagnostics.append(
                diagnostic_at(place, 'never-equal', message, help=advice)
            )
        origin = self._hidden_origin(text, [expression])
        if origin is not None:
            hide(value, origin)
        return value

    def _hidden_origin(self, text: str, expressions: list[slice]) -> str | None:
        """Return the call of `env` that expressions depend on, directly or by a name."""
        for name in sorted(self._names_in(text, expressions)):
            if name == 'env' and name not in self._values:
                called = {found for each in expressions for found in _ENV.findall(text[each])}
                # A default is none of the environment's.
                if not called or any(each in shell_environment() for each in called):
                    return f'env("{min(called)}")' if called else 'env(…)'
            elif (origin := origin_of(self._values.get(name))) is not None:
                return origin
        return None

    def _names_in(self, text: str, expressions: list[slice]) -> frozenset[str]:
        names: set[str] = set()
        for expression in expressions:
            # Errors are reported when it is evaluated; jinja2 reads no numbers of many digits.
            with suppress(TemplateError, ValueError):
                names |= self._sandbox.names_in(code_of(text, expression))
        return frozenset(names)

    def _note(self, names: frozenset[str]) -> str:
        origins = self.scope.origins
        used = sorted(names & origins.keys())
        return ', '.join(f'{name} = {self._values[name]} ({origins[name]})' for name in used)

    def _explain(self, error: Exception, span: Span, origin: str | None) -> Diagnostic:
        if isinstance(error, UndefinedError) and (
            found := _UNDEFINED_NAME.fullmatch(str(error.message))
        ):
            return self._explain_undefined(found.group(1), span)
        if isinstance(error, UnknownArgumentError):
            help_text = suggest(error.name, self.scope.arguments, 'the file declares')
            place = span.narrowed_to(error.name)
            return diagnostic_at(place, 'undefined-name', str(error.message), help=help_text)
        is_package = isinstance(error, PackageError)
        rule = 'uninstalled-package' if is_package else 'bad-expression'
        if origin is None:
            help_text = getattr(error, 'help', None) if is_package else None
            return diagnostic_at(span, rule, _describe(error), help=help_text)
        # Its text may quote any part of the value.
        message = f'the expression raised {type(error).__name__} with a value from {origin}'
        return diagnostic_at(span, rule, message)

    def _explain_undefined(self, name: str, span: Span) -> Diagnostic:
        is_searched = self._sandbox.explained <= _MOST_SEARCHED
        scope = self.scope.names if is_searched else set()
        declared = self._values or find_nearest(name, scope)
        listed = 'in scope are' if declared else None
        dotted = next((each for each in self._values if each.startswith(f'{name}.')), None)
        advice: str | None
        if dotted:
            advice = f'write {written_in_expression(dotted)}'
        elif name in self._sandbox.filters:
            advice = f"it is a filter: write 'value | {name}'"
        else:
            advice = suggest(name, scope, listed, "declare it as an argument, under 'args'")
        message = f"'{name}' is not defined"
        return diagnostic_at(locate_name(name, span), 'undefined-name', message, help=advice)

    def report_duplicate(self, key: str, path: DataPath, other: DataPath) -> None:
        """Report that two keys of one mapping evaluate to the same."""
        self.document.diagnostics.append(
            diagnostic_at(
                self.positions.key(path),
                'duplicate-key',
                f"the key '{key}' appears twice in one mapping",
                related=[Related('also used here', self.positions.key(other))],
            )
        )


def _part_at_fault(error: Exception, text: str, expressions: list[slice]) -> str:
    """Return what of a text an error is about: an unknown filter, or the only expression."""
    if named := _UNKNOWN_FILTER.search(str(error)):
        return named.group(1)
    return text[expressions[0]] if len(expressions) == 1 else ''


def _is_left_out(found: Any, written: Any, path: DataPath) -> bool:
    """Return whether an expression leaves a key or an item of a program out: its value is none."""
    return found is None and written is not None and path[:1] in _MAY_LACK_VALUES


def _describe(error: Exception) -> str:
    """Return an error in one line."""
    if isinstance(error, SecurityError):
        return f'the expression is not allowed: {error.message}'
    if isinstance(error, TemplateSyntaxError):
        return describe_syntax(error)
    message = str(error) or type(error).__name__
    if isinstance(error, TemplateError):
        return message
    return f'the expression raised {type(error).__name__}: {message}'


def describe_syntax(error: TemplateError) -> str:
    """Return a syntax error of Jinja in the words of expressions."""
    message = str(error.message).replace("'end of template'", 'end of the expression')
    return message.replace('end of template', 'end of the expression').rstrip('.')


def _as_data(value: Any) -> Any:
    """Return a value as YAML can represent it; raise if it cannot."""
    if isinstance(value, StrictUndefined):
        str(value)  # raises what is undefined
    if isinstance(value, str):
        return str(value)
    if isinstance(value, int) and value.bit_length() > _MAX_BITS:
        message = f'a number of {value.bit_length()} bits does not fit any ROS type'
        raise TemplateRuntimeError(message)
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, list | tuple | range):
        return [_as_data(item) for item in value]
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        return {str(key): _as_data(item) for key, item in value.items()}
    message = f'the expression returns a {type(value).__name__}, which YAML cannot represent'
    raise TemplateRuntimeError(message)


def _as_text(value: Any) -> str:
    """Return a value inside a text as YAML writes it, and nothing for null."""
    return '' if value is None else format_scalar(value)


def find_useless_comparisons(
    expression: nodes.Expr, scope: Scope
) -> Iterator[tuple[str, str, str | None]]:
    """Yield each value that an argument never has: what is wrong, the value as text, and help."""
    found = [*expression.find_all(nodes.Compare)]
    for compare in [*found, *([expression] if isinstance(expression, nodes.Compare) else [])]:
        operand = compare.ops[0]
        sides = (compare.expr, operand.expr)
        for one, other in (sides, sides[::-1]) if operand.op in _EQUALITIES else ():
            yield from _compare(one, [other], scope)
        if operand.op in _MEMBERSHIPS and isinstance(operand.expr, nodes.List | nodes.Tuple):
            yield from _compare(compare.expr, operand.expr.items, scope)


def _compare(
    side: nodes.Node, others: list[nodes.Expr], scope: Scope
) -> Iterator[tuple[str, str, str | None]]:
    name = side.name if isinstance(side, nodes.Name) else ''
    if name not in scope.arguments or scope.values.get(name) is None:
        return
    value, choices = scope.values[name], scope.choices.get(name, ())
    for other in others:
        if isinstance(other, nodes.List | nodes.Tuple | nodes.Dict):
            yield f"'{name}' is {type(value).__name__}, and is never equal to a list", '', None
        if not isinstance(other, nodes.Const) or other.value is None:
            continue
        if _kind(value) != _kind(other.value):
            kinds = f'{type(value).__name__}, and is never equal to {other.value!r}'
            yield f"'{name}' is {kinds}", str(other.value), 'compare it with a value of its type'
        elif choices and other.value not in choices:
            text = f"'{name}' is never {other.value!r}"
            yield text, str(other.value), suggest(other.value, choices, 'its choices are')


def _kind(value: Any) -> type:
    return float if isinstance(value, _NUMBERS) else type(value)
