"""Expressions of `-k`, as pytest has them: which names are meant."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NoReturn, TypeAlias

from composer.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

Condition: TypeAlias = 'Callable[[str], bool]'

# Words as in pytest's, and quoted texts: names of cases have spaces.
_TOKEN = re.compile(r"""\s*(?:([()])|'([^']*)'|"([^"]*)"|([\w:+\-.\[\]\\/]+))\s*""")
_OPERATORS = frozenset({'and', 'or', 'not'})


def parse_name_expression(text: str) -> Condition:
    """Return whether a name is meant: `stops and not (slow or fast)`.

    A word is a part of the name, in large or small letters.

    Raises:
        UsageError: It is no such expression.
    """
    parser = _Parser(text)
    condition = parser.parse_any()
    if parser.tokens:
        parser.refuse(f"'{parser.tokens[0][0]}' is unexpected")
    return condition


class _Parser:
    """What is left of an expression: tokens, and whether each is a text in quotes."""

    def __init__(self, text: str) -> None:
        self._text = text
        self.tokens: list[tuple[str, bool]] = []
        end = 0
        while end < len(text):
            match = _TOKEN.match(text, end)
            if match is None:
                self.refuse(f"'{text[end]}' is unexpected")
            bracket, single, double, word = match.groups()
            quoted = single if single is not None else double
            is_quoted = quoted is not None
            self.tokens.append((quoted if is_quoted else bracket or word, is_quoted))
            end = match.end()

    def refuse(self, problem: str) -> NoReturn:
        message = f"-k '{self._text}': {problem}"
        raise UsageError(message, help="as in -k 'stops and not (slow or fast)'")

    def parse_any(self) -> Condition:
        conditions = [self._parse_all()]
        while self._takes('or'):
            conditions.append(self._parse_all())
        return lambda name: any(each(name) for each in conditions)

    def _parse_all(self) -> Condition:
        conditions = [self._parse_one()]
        while self._takes('and'):
            conditions.append(self._parse_one())
        return lambda name: all(each(name) for each in conditions)

    def _parse_one(self) -> Condition:
        if self._takes('not'):
            condition = self._parse_one()
            return lambda name: not condition(name)
        if self._takes('('):
            inner = self.parse_any()
            if not self._takes(')'):
                self.refuse("')' is missing")
            return inner
        return self._parse_word()

    def _parse_word(self) -> Condition:
        if not self.tokens:
            self.refuse('a name is missing at its end')
        word, is_quoted = self.tokens.pop(0)
        if not is_quoted and (word in _OPERATORS or word in '()'):
            self.refuse(f"a name is missing before '{word}'")
        wanted = word.casefold()
        return lambda name: wanted in name.casefold()

    def _takes(self, token: str) -> bool:
        if self.tokens[:1] == [(token, False)]:
            self.tokens.pop(0)
            return True
        return False
