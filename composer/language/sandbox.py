"""The expressions' sandbox: jinja2's own, without what is only for pages of text."""

from __future__ import annotations

import os
from typing import Any

from jinja2 import TemplateRuntimeError, TemplateSyntaxError
from jinja2.sandbox import SandboxedEnvironment

from composer.ament import find_share, list_packages
from composer.names import suggest

# No field or parameter needs more; a larger result is a mistake that would take all memory.
_MAX_ITEMS = 10_000_000
_MAX_BITS = 10_000

_BEGIN = '{{'


class Sandbox(SandboxedEnvironment):
    """Evaluates expressions; their globals are `range`, `env` and `find`."""

    intercepted_binops = frozenset(('*', '**'))

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.globals = {'range': self.globals['range'], 'env': _env, 'find': _find}

    def call_binop(self, context: Any, operator: str, left: Any, right: Any) -> Any:
        """Multiply or raise to a power, unless the result would be enormous."""
        too_large = _is_power_too_large if operator == '**' else _is_product_too_large
        if too_large(left, right):
            message = f"the result of '{operator}' is too large"
            raise TemplateRuntimeError(message)
        return super().call_binop(context, operator, left, right)

    def measure(self, text: str) -> int:
        """Return the length of the expression at the beginning of a text, up to its `}}`.

        Raises:
            TemplateSyntaxError: It has no end.
        """
        length = -len(_BEGIN)
        # jinja2 makes one character of a line break of two.
        for _, kind, value in self.lex(_BEGIN + text.replace('\r', ' ')):
            if kind == 'variable_end':
                return length + value.index('}}')
            length += len(value)
        message = "the expression has no end: '}}' is missing"
        raise TemplateSyntaxError(message, 1)


def _env(name: str, default: str | None = None) -> str:
    """Return a variable of the environment, or the default."""
    value = os.environ.get(name, default)
    if value is None:
        message = f"the environment has no '{name}'; give a default, as in env('{name}', 'none')"
        raise TemplateRuntimeError(message)
    return value


def _find(package: str) -> str:
    """Return the share folder of a ROS package."""
    share = find_share(package)
    if share is None:
        near = suggest(package, list_packages())
        hint = f"; did you mean '{near}'?" if near else ''
        message = f"no package '{package}' is installed{hint}"
        raise TemplateRuntimeError(message)
    return str(share)


def _is_power_too_large(base: Any, exponent: Any) -> bool:
    if not (isinstance(base, int) and isinstance(exponent, int)):
        return False
    return base.bit_length() * exponent > _MAX_BITS


def _is_product_too_large(left: Any, right: Any) -> bool:
    for items, times in ((left, right), (right, left)):
        if isinstance(items, str | list | tuple) and isinstance(times, int):
            return len(items) * times > _MAX_ITEMS
    return False
