"""Texts of launch files: what they are now, and the expressions that they are made of."""

from __future__ import annotations

import re
import shlex
from typing import TYPE_CHECKING, Any, Literal, Self, TypeAlias

import yaml

from composer.records import record
from composer.yaml_text.writer import Expression

if TYPE_CHECKING:
    from collections.abc import Iterable

# `python-bool` is `True` as a text, all other booleans are `true`.
Kind: TypeAlias = Literal['text', 'bool', 'python-bool', 'number']


class Computed(Expression):
    """A text of the language with expressions.

    Attributes:
        value: What it comes to with the arguments as they are given to the import.
    """

    value: Any

    def __new__(cls, text: str, value: Any) -> Self:
        """Return the text with its value."""
        self = super().__new__(cls, text)
        self.value = value
        return self


@record
class Code:
    """A part of a text that depends on arguments.

    Attributes:
        code: An expression of the language.
        text: What it is with the arguments as they are given to the import.
        kind: The type of its value.
    """

    code: str
    text: str
    kind: Kind = 'text'

    @property
    def as_text(self) -> str:
        """An expression for its value as a text."""
        if self.kind == 'python-bool':
            return f"('True' if {self.code} else 'False')"
        return self.code


@record
class Text:
    """A text: constant parts, and parts that depend on arguments."""

    parts: tuple[str | Code, ...]

    @property
    def text(self) -> str:
        """What it is with the arguments as they are given to the import."""
        return ''.join(part if isinstance(part, str) else part.text for part in self.parts)

    @property
    def is_constant(self) -> bool:
        """Whether it depends on no argument."""
        return all(isinstance(part, str) for part in self.parts)

    @property
    def code(self) -> str:
        """An expression for it."""
        if not self.parts:
            return "''"
        if len(self.parts) == 1:
            (only,) = self.parts
            return repr(only) if isinstance(only, str) else only.as_text
        codes = (repr(part) if isinstance(part, str) else part.as_text for part in self.parts)
        return f'({" ~ ".join(codes)})'

    @property
    def _only_code(self) -> str:
        (only,) = self.parts
        return repr(only) if isinstance(only, str) else only.code

    @property
    def kind(self) -> Kind:
        """The type of the value."""
        (only, *others) = self.parts or ('',)
        return 'text' if others or isinstance(only, str) else only.kind

    def written(self) -> str:
        """Return it as a text of the language."""
        if self.is_constant:
            return self.text
        return Computed(''.join(map(_written_part, self.parts)), self.text)

    def typed(self) -> Any:
        """Return it as a value that launch reads as YAML: of a parameter."""
        value = read_yaml(self.text)
        if self.is_constant:
            return value
        if self.kind != 'text':
            return Computed(f'{{{{ {self._only_code} }}}}', value)
        if len(self.parts) > 1 and isinstance(value, str):
            return self.written()
        return Computed(f'{{{{ {self.code} | from_yaml }}}}', value)

    def condition(self) -> str:
        """Return an expression for whether it is true, as conditions of launch read it."""
        if len(self.parts) == 1 and self.kind in ('bool', 'python-bool'):
            return self._only_code
        return f'{self.code} | bool'


EMPTY = Text(())


def constant(text: str) -> Text:
    """Return a text that depends on nothing."""
    return Text((text,)) if text else EMPTY


def one(code: str, text: str, kind: Kind = 'text') -> Text:
    """Return a text that is one expression."""
    return Text((Code(code, text, kind),))


def joined(texts: Iterable[Text], separator: str = '') -> Text:
    """Return texts one after the other."""
    parts: list[str | Code] = []
    for index, each in enumerate(texts):
        for part in (separator if index else '', *each.parts):
            if isinstance(part, str) and parts and isinstance(parts[-1], str):
                parts[-1] += part
            elif part:
                parts.append(part)
    return Text(tuple(parts))


def chosen(condition: str, then: Text, otherwise: Text, *, is_true: bool) -> Text:
    """Return one of two texts, after a condition."""
    if then == otherwise:
        return then
    code = f'({then.code} if {condition} else {otherwise.code})'
    return one(code, (then if is_true else otherwise).text)


def only_if(condition: str, value: Any, otherwise: Any, *, is_true: bool) -> Any:
    """Return a value of the language if a condition holds, else another one; `None` is none."""
    if not condition:
        return value
    code = f'{code_of(value)} if {condition} else {code_of(otherwise)}'
    now = value if is_true else otherwise
    return Computed(f'{{{{ {code} }}}}', now.value if isinstance(now, Computed) else now)


def code_of(value: Any) -> str:
    """Return an expression for a value of the language."""
    if isinstance(value, Computed):
        pieces = re.split(r'{{ (.*?) }}(?!})', value)
        codes = [f'({piece})' if i % 2 else repr(piece) for i, piece in enumerate(pieces) if piece]
        return ' ~ '.join(codes) if len(codes) == 1 else f'({" ~ ".join(codes)})'
    if isinstance(value, list):
        return f'[{", ".join(map(code_of, value))}]'
    return {'None': 'none', 'True': 'true', 'False': 'false'}.get(repr(value), repr(value))


def read_yaml(text: str) -> Any:
    """Return the value that launch reads from a text; the text itself if it is no YAML."""
    try:
        value = yaml.safe_load(text) if text else ''
    except (yaml.YAMLError, ValueError):
        return text
    return value if isinstance(value, bool | int | float | str | list) else text


def split_words(text: Text) -> list[Text]:
    """Return the words of a command line, as a shell splits it."""
    codes: list[Code] = []
    plain = ''
    for part in text.parts:
        if isinstance(part, Code):
            plain += f'\ue003{len(codes)}\ue004'
            codes.append(_without_quotes(part))
        else:
            plain += part
    words = []
    for word in shlex.split(plain):
        pieces = re.split('\ue003(\\d+)\ue004', word)
        parts = tuple(
            codes[int(piece)] if index % 2 else piece
            for index, piece in enumerate(pieces)
            if index % 2 or piece
        )
        words.append(Text(parts))
    return words


def _without_quotes(part: Code) -> Code:
    """Return a part of a command line without the quotes that a shell takes away from it."""
    for quote in '"', "'":
        if quote in part.text:
            code = f'({part.code} | replace({quote!r}, {""!r}))'
            part = Code(code, part.text.replace(quote, ''), part.kind)
    return part


def _written_part(part: str | Code) -> str:
    if isinstance(part, Code):
        return f'{{{{ {part.as_text} }}}}'
    return part.replace('{{', "{{ '{{' }}")
