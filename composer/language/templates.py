"""Expressions inside scalars: `{{ name }}`, evaluated by sandboxed jinja2.

A scalar that is one whole expression keeps the type of its value; in any other the values become
text. Names that are not in scope are errors. Source: https://jinja.palletsprojects.com/en/3.1.x/.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from jinja2 import StrictUndefined, TemplateError, UndefinedError
from jinja2.exceptions import SecurityError
from jinja2.sandbox import SandboxedEnvironment

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.names import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.language.positions import DataPath, SourceMap

_OPEN = '{{'
_WHOLE = re.compile(r'\s*\{\{((?:(?!\{\{|\}\}).)*)\}\}\s*', re.DOTALL)
_UNDEFINED_NAME = re.compile(r"'([^']+)' is undefined")


def fill_templates(
    data: Any, values: Mapping[str, Any], positions: SourceMap
) -> tuple[Any, list[Diagnostic], list[DataPath]]:
    """Evaluate all expressions of a document.

    Args:
        values: What is in scope, by name.

    Returns:
        The data with the values in place, the findings, and the paths of the scalars that could
        not be evaluated.
    """
    filler = _Filler(values, positions)
    return filler.fill(data, ()), filler.faults, filler.failed


class _Filler:
    def __init__(self, values: Mapping[str, Any], positions: SourceMap) -> None:
        self.faults: list[Diagnostic] = []
        self.failed: list[DataPath] = []
        self._values = values
        self._positions = positions
        # Statements have no place in a scalar: their delimiters cannot be written in YAML.
        self._environment = SandboxedEnvironment(
            undefined=StrictUndefined,
            finalize=_as_text,
            block_start_string='\0{%',
            block_end_string='%\0}',
            comment_start_string='\0{#',
            comment_end_string='#\0}',
            keep_trailing_newline=True,
        )

    def fill(self, data: Any, path: DataPath) -> Any:
        if isinstance(data, dict):
            return {
                self._fill_key(key, path): self.fill(value, (*path, key))
                for key, value in data.items()
            }
        if isinstance(data, list):
            return [self.fill(item, (*path, index)) for index, item in enumerate(data)]
        if isinstance(data, str) and _OPEN in data:
            return self._evaluate(data, path)
        return data

    def _fill_key(self, key: str, path: DataPath) -> str:
        if _OPEN not in key:
            return key
        filled = str(self._evaluate(key, (*path, key)))
        self._positions.move((*path, key), (*path, filled))
        return filled

    def _evaluate(self, text: str, path: DataPath) -> Any:
        whole = _WHOLE.fullmatch(text)
        try:
            if whole:
                expression = self._environment.compile_expression(
                    whole.group(1), undefined_to_none=False
                )
                value = expression(**self._values)
                # A strict undefined raises when it is looked at, not when it is returned.
                return str(value) if isinstance(value, StrictUndefined) else value
            return self._environment.from_string(text).render(**self._values)
        except Exception as error:  # noqa: BLE001 - an expression may raise whatever it calls
            self._report(error, path)
            return text

    def _report(self, error: Exception, path: DataPath) -> None:
        self.failed.append(path)
        span = self._positions.value(path)
        message = str(error) or type(error).__name__
        help_text = None
        name = ''
        if isinstance(error, UndefinedError) and (found := _UNDEFINED_NAME.search(message)):
            name = found.group(1)
            message = f"'{name}' is not defined"
            help_text = did_you_mean(name, self._values, 'in scope are') or 'declare it: args:'
        elif isinstance(error, SecurityError):
            message = f'the sandbox refuses the expression: {message}'
        elif not isinstance(error, TemplateError):
            message = f'the expression raised {type(error).__name__}: {message}'
        rule = 'undefined-name' if name else 'bad-expression'
        self.faults.append(diagnostic_at(span.narrowed_to(name), rule, message, help=help_text))


def _as_text(value: Any) -> Any:
    """Write a value inside a text as YAML does."""
    if isinstance(value, bool):
        return 'true' if value else 'false'
    return '' if value is None else value
