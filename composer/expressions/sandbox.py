"""The sandbox of expressions: jinja2's language with a subset of its filters.

This file lists what an expression can reach. Limits on time and memory stand in `limits`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jinja2 import StrictUndefined, TemplateRuntimeError, TemplateSyntaxError, Undefined, nodes
from jinja2.exceptions import SecurityError
from jinja2.lexer import TOKEN_ASSIGN
from jinja2.parser import Parser
from jinja2.runtime import new_context
from jinja2.sandbox import SandboxedEnvironment, SandboxedFormatter

from composer.expressions import ALL_ARGUMENTS, ARGUMENTS, limits
from composer.expressions.functions import FILTERS, FUNCTIONS
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from jinja2.nodes import EvalContext
    from jinja2.runtime import Context


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_FILTERS = _words(
    'abs attr batch capitalize center count d default dictsort first float format groupby int '
    'items join last length list lower map max min reject rejectattr replace reverse round select '
    'selectattr slice sort string sum title tojson trim truncate unique upper wordcount'
)
_FILTER_LIMITS: dict[str, Callable[..., None]] = {
    **dict.fromkeys(_words('batch center round slice tojson truncate'), limits.limit_widths),
    'format': limits.limit_percent_format,
    'join': limits.limit_joined,
    'replace': limits.limit_replacement,
    'sum': limits.limit_sum,
}

_METHODS: dict[type, frozenset[str]] = {
    str: _words(
        'capitalize casefold center count endswith find format index isalnum isalpha isascii '
        'isdecimal isdigit isidentifier islower isnumeric isprintable isspace istitle isupper '
        'join ljust lower lstrip partition removeprefix removesuffix replace rfind rindex rjust '
        'rpartition rsplit rstrip split splitlines startswith strip swapcase title upper '
        'zfill'
    ),
    dict: frozenset(('get', 'items', 'keys', 'values')),
    **dict.fromkeys((list, tuple, range), frozenset(('count', 'index'))),
    int: frozenset(('bit_length',)),
    float: frozenset(('is_integer',)),
}
_METHOD_LIMITS: dict[str, Callable[..., None]] = {
    **dict.fromkeys(_words('center ljust rjust zfill'), limits.limit_widths),
    'format': limits.limit_brace_format,
    'join': limits.limit_separated,
    'replace': limits.limit_replacement,
}


@record
class Method:
    """A method of a value that an expression may call."""

    owner: Any
    name: str


# What else can be iterated over is made item by item.
_PLAIN = (str, bytes, list, tuple, dict, range, int, float, type(None), Undefined, Method)


class Sandbox(SandboxedEnvironment):
    """What the expressions of one file can reach, and the work that they have left."""

    def __init__(self) -> None:
        super().__init__(undefined=StrictUndefined)
        self.budget = limits.Budget()
        self.explained = 0
        self.globals: dict[str, Any] = {'range': self.globals['range'], **FUNCTIONS}
        self.filters = {name: self.filters[name] for name in sorted(_FILTERS)} | dict(FILTERS)
        self._parsed: dict[str, nodes.Expr] = {}
        self._names: dict[str, frozenset[str]] = {}
        self._context = new_context(self, None, {}, globals=self.globals)

    def parse_expression(self, code: str) -> nodes.Expr:
        """Return the tree of an expression; each is parsed once.

        Raises:
            TemplateError: It cannot be read.
        """
        if code not in self._parsed:
            self.budget.spend_on_parsing(code)
            try:
                self._parsed[code] = self._parse_whole(code)
            except RecursionError:
                raise too_deep() from None
        return self._parsed[code]

    def _parse_whole(self, code: str) -> nodes.Expr:
        parser = Parser(self, code, state='variable')
        expression = parser.parse_expression()
        if not parser.stream.eos:
            is_assignment = parser.stream.current.type == TOKEN_ASSIGN
            message = 'unexpected text after the expression'
            message = "'=' compares nothing: write '=='" if is_assignment else message
            raise TemplateSyntaxError(message, parser.stream.current.lineno)
        return expression

    def names_in(self, code: str) -> frozenset[str]:
        """Return the names that an expression uses; for `args['a.b']` that is `a.b`.

        Raises:
            TemplateError: It cannot be read.
        """
        if code not in self._names:
            expression = self.parse_expression(code)
            try:
                self._names[code] = _names_of([expression, *expression.find_all(nodes.Node)])
            except RecursionError:
                raise too_deep() from None
        return self._names[code]

    def attribute(self, owner: Any, name: str) -> Any:
        """Return a method that expressions may call, or what stands under a name in a value."""
        if name in _METHODS.get(type(owner), ()):
            return Method(owner, name)
        return self.getattr(owner, name)

    def call_function(
        self, function: Any, arguments: Sequence[Any], keywords: Mapping[str, Any]
    ) -> Any:
        """Call a method or a function that is in scope.

        Raises:
            SecurityError: It is neither.
        """
        if isinstance(function, Method):
            return self._counted(self._call_method(function, arguments, keywords))
        if not any(function is each for each in self.globals.values()):
            message = f'{function!r} is unsafe to call in an expression'
            raise SecurityError(message)
        result: Any = function(*arguments, **keywords)
        return result

    def _call_method(
        self, method: Method, arguments: Sequence[Any], keywords: Mapping[str, Any]
    ) -> Any:
        owner, name = method.owner, method.name
        self.budget.spend(owner, arguments, keywords)
        if name in _METHOD_LIMITS:
            _METHOD_LIMITS[name](owner, *arguments, **keywords)
        if name == 'format':
            return SandboxedFormatter(self).vformat(owner, arguments, keywords)
        return getattr(owner, name)(*arguments, **keywords)

    def call_filter(
        self,
        name: str,
        value: Any,
        args: Sequence[Any] | None = None,
        kwargs: Mapping[str, Any] | None = None,
        context: Context | None = None,
        eval_ctx: EvalContext | None = None,
    ) -> Any:
        """Apply a filter within limits, also for other filters (`map`)."""
        arguments, keywords = list(args or ()), dict(kwargs or {})
        self.budget.spend(value, arguments, keywords)
        if name in _FILTER_LIMITS:
            _FILTER_LIMITS[name](value, *arguments, **keywords)
        context = context or self._context
        return self._counted(
            super().call_filter(name, value, arguments, keywords, context, eval_ctx)
        )

    def call_test(
        self,
        name: str,
        value: Any,
        args: Sequence[Any] | None = None,
        kwargs: Mapping[str, Any] | None = None,
        context: Context | None = None,
        eval_ctx: EvalContext | None = None,
    ) -> bool:
        """Apply a test within limits, also for filters (`select`)."""
        self.budget.spend(value, list(args or ()))
        context = context or self._context
        return bool(super().call_test(name, value, args, kwargs, context, eval_ctx))

    def _counted(self, value: Any) -> Any:
        """Return a value when its size has been counted; an iterator becomes a list."""
        if not isinstance(value, _PLAIN) and hasattr(value, '__iter__'):
            return self.budget.collect(value)
        self.budget.spend(value)
        return value


def _names_of(parts: Sequence[nodes.Node]) -> frozenset[str]:
    names = [part.name for part in parts if isinstance(part, nodes.Name)]
    arguments = [name for part in parts if (name := _argument_of(part)) is not None]
    every = () if names.count(ARGUMENTS) == len(arguments) else (ALL_ARGUMENTS,)
    return frozenset((*(name for name in names if name != ARGUMENTS), *every, *arguments))


def _argument_of(part: nodes.Node) -> str | None:
    """Return the argument that `args['name']` stands for."""
    if not isinstance(part, nodes.Getitem) or not isinstance(part.node, nodes.Name):
        return None
    key = part.arg.value if isinstance(part.arg, nodes.Const) else None
    return key if part.node.name == ARGUMENTS and isinstance(key, str) else None


def too_deep() -> TemplateRuntimeError:
    """Return the error for an expression that Python's stack does not hold."""
    return TemplateRuntimeError('the expression is nested too deeply')
