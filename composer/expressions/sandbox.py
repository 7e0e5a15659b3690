"""The expressions' sandbox: jinja2's language, with that of its filters which data have use for.

What an expression can reach is listed here; how much it can do is bounded in `bounds`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from jinja2 import TemplateRuntimeError, TemplateSyntaxError, Undefined, nodes
from jinja2.exceptions import SecurityError
from jinja2.parser import Parser
from jinja2.runtime import new_context
from jinja2.sandbox import SandboxedEnvironment, SandboxedFormatter

from composer.expressions import limits
from composer.expressions.evaluation import evaluate_expression
from composer.expressions.functions import FUNCTIONS
from composer.expressions.limits import Budget

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from jinja2.nodes import EvalContext
    from jinja2.runtime import Context

_BEGIN, _END = '{{', '}}'
# The end of an expression is sought so far; most are near.
_USUAL, _LONGEST = 200, 10_000


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_FILTERS = _words(
    'abs attr batch capitalize center count d default dictsort first float format groupby int '
    'items join last length list lower map max min reject rejectattr replace reverse round select '
    'selectattr slice sort string sum title tojson trim truncate unique upper wordcount'
)
_SIZED_FILTERS = frozenset(('batch', 'center', 'round', 'slice', 'tojson', 'truncate'))

_METHODS: dict[type, frozenset[str]] = {
    str: _words(
        'capitalize casefold center count endswith find format index isalnum isalpha isascii '
        'isdecimal isdigit isidentifier islower isnumeric isprintable isspace istitle isupper '
        'join ljust lower lstrip partition removeprefix removesuffix replace rfind rindex rjust '
        'rpartition rsplit rstrip split splitlines startswith strip swapcase title upper '
        'zfill'
    ),
    dict: frozenset(('get', 'items', 'keys', 'values')),
    list: frozenset(('count', 'index')),
    tuple: frozenset(('count', 'index')),
    range: frozenset(('count', 'index')),
    int: frozenset(('bit_length',)),
    float: frozenset(('is_integer',)),
}
_SIZED_METHODS = frozenset(('center', 'ljust', 'rjust', 'zfill'))

_FILTER_LIMITS: dict[str, Callable[..., None]] = {
    'format': limits.limit_percent_format,
    'join': limits.limit_joined,
    'replace': limits.limit_replacement,
    'sum': limits.limit_sum,
}


@dataclass(frozen=True, slots=True)
class Method:
    """A method of a value that an expression may call."""

    owner: Any
    name: str


# The types whose size can be told at once; what else is iterable is made item by item.
_PLAIN = (str, bytes, list, tuple, dict, range, int, float, type(None), Undefined, Method)


class Sandbox(SandboxedEnvironment):
    """Evaluates the expressions of one file."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.budget = Budget()
        self.globals: dict[str, Any] = {'range': self.globals['range'], **FUNCTIONS}
        self.filters = {name: self.filters[name] for name in sorted(_FILTERS)}
        self._parsed: dict[str, nodes.Expr] = {}
        self._context = new_context(self, None, {}, globals=self.globals)

    def evaluate(self, code: str, values: Mapping[str, Any]) -> Any:
        """Return the value of an expression.

        Raises:
            TemplateError: It is none, or does what is not allowed.
            Exception: Whatever its operators and methods raise.
        """
        self.budget.begin()
        try:
            return evaluate_expression(self.parse_expression(code), self, values)
        except RecursionError:
            raise _too_deep() from None

    def names_in(self, code: str) -> set[str]:
        """Return the names that an expression speaks of.

        Raises:
            TemplateError: It is none.
        """
        expression = self.parse_expression(code)
        try:
            found = {each.name for each in expression.find_all(nodes.Name)}
        except RecursionError:
            raise _too_deep() from None
        return found | ({expression.name} if isinstance(expression, nodes.Name) else set())

    def measure(self, text: str) -> int:
        """Return the length of the expression at the beginning of a text, up to its `}}`.

        Raises:
            TemplateSyntaxError: It has no end.
        """
        for longest in (_USUAL, _LONGEST):
            head = text[: longest + len(_END)]
            self.budget.spend_on_reading(head)
            try:
                length = self._measure_whole(head)
            except TemplateSyntaxError:
                # It may be the cut that is wrong with it.
                if len(head) == len(text):
                    raise
            else:
                if length is not None:
                    return length
            if len(head) == len(text):
                message = "the expression has no end: '}}' is missing"
                raise TemplateSyntaxError(message, 1)
        message = f'an expression has at most {_LONGEST} characters'
        raise TemplateSyntaxError(message, 1)

    def _measure_whole(self, text: str) -> int | None:
        length = -len(_BEGIN)
        # jinja2 makes one character of a line break of two.
        for _, kind, value in self.lex(_BEGIN + text.replace('\r', ' ')):
            if kind == 'variable_end':
                return length + value.index(_END)
            length += len(value)
        return None

    def method_of(self, value: Any, name: str) -> Method | None:
        """Return the method of a value, if it is one that expressions may call."""
        return Method(value, name) if name in _METHODS.get(type(value), ()) else None

    def call_function(
        self, function: Any, arguments: Sequence[Any], keywords: Mapping[str, Any]
    ) -> Any:
        """Call a method or a function that is in scope.

        Raises:
            SecurityError: It is neither.
        """
        if isinstance(function, Method):
            return self._call_method(function, arguments, keywords)
        if not any(function is each for each in self.globals.values()):
            message = f'{function!r} is unsafe to call in an expression'
            raise SecurityError(message)
        result: Any = function(*arguments, **keywords)
        return result

    def call_filter(
        self,
        name: str,
        value: Any,
        args: Sequence[Any] | None = None,
        kwargs: Mapping[str, Any] | None = None,
        context: Context | None = None,
        eval_ctx: EvalContext | None = None,
    ) -> Any:
        """Apply a filter, also for other filters (`map`, `select`), within limits."""
        arguments, keywords = list(args or ()), dict(kwargs or {})
        self.budget.weigh(value, arguments, keywords)
        if name in _SIZED_FILTERS:
            limits.limit_widths(*arguments, *keywords.values())
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
        """Apply a test, also for filters."""
        self.budget.weigh(value, list(args or ()))
        context = context or self._context
        return bool(super().call_test(name, value, args, kwargs, context, eval_ctx))

    def _call_method(
        self, method: Method, arguments: Sequence[Any], keywords: Mapping[str, Any]
    ) -> Any:
        owner, name = method.owner, method.name
        self.budget.weigh(owner, list(arguments), dict(keywords))
        if name == 'format':
            limits.limit_formatted(owner, [arguments, keywords], '{')
            return SandboxedFormatter(self).vformat(owner, arguments, keywords)
        if name in _SIZED_METHODS:
            limits.limit_widths(*arguments)
        if name == 'replace':
            limits.limit_replacement(owner, *arguments)
        if name == 'join':
            limits.limit_joined(arguments[0] if arguments else (), owner)
        return self._counted(getattr(owner, name)(*arguments, **keywords))

    def _counted(self, value: Any) -> Any:
        """Return a value when its size has been counted; iterators as lists."""
        if isinstance(value, _PLAIN):
            self.budget.weigh(value)
            return value
        return self.budget.listed(value) if hasattr(value, '__iter__') else value

    def parse_expression(self, code: str) -> nodes.Expr:
        """Return the tree of an expression, which is read once.

        Raises:
            TemplateError: It is none.
        """
        if code not in self._parsed:
            self.budget.spend_on_parsing(code)
            try:
                self._parsed[code] = self._parse_whole(code)
            except RecursionError:
                raise _too_deep() from None
        return self._parsed[code]

    def _parse_whole(self, code: str) -> nodes.Expr:
        parser = Parser(self, code, state='variable')
        expression = parser.parse_expression()
        if not parser.stream.eos:
            message = 'chunk after expression'
            raise TemplateSyntaxError(message, parser.stream.current.lineno)
        expression.set_environment(self)
        return expression


def _too_deep() -> TemplateRuntimeError:
    return TemplateRuntimeError('the expression nests too deep')
