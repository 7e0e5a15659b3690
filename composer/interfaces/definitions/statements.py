"""Split interface definitions into sections and statements, with positions.

Lines are split as in `rosidl_adapter.parser`: a tab counts as a space, `#` starts a comment even
inside quotes, the type ends at the first space, and a line with `=` after its type is a constant.
"""

import re
from collections.abc import Iterator
from typing import Final, Literal, TypeAlias

from composer.diagnostics import SourceFile, Span
from composer.records import record

SEPARATOR: Final = '---'
_NEAR_SEPARATOR: Final = re.compile(r'\s*-[-\s]*-\s*(#.*)?')

StatementKind: TypeAlias = Literal['field', 'constant', 'unfinished']


@record
class Statement:
    """One line that defines something.

    Attributes:
        kind: `unfinished` where no name follows the type.
        indent: number of spaces before it; the reference parser allows none.
        type: as written.
        name: as written; of an unfinished statement, the empty place behind the type.
        value: the constant's value or the field's default, if there is one.
    """

    kind: StatementKind
    indent: int
    type: Span
    name: Span
    value: Span | None


@record
class Section:
    """The lines between two separators.

    Attributes:
        source: the file.
        start: number of its first line in the file.
        stop: number of the line behind its last one.
    """

    source: SourceFile
    start: int
    stop: int

    @property
    def text(self) -> str:
        """The section as a message definition."""
        return '\n'.join(self.source.lines[self.start - 1 : self.stop - 1])

    def statements(self) -> Iterator[Statement]:
        """Yield a statement for each line that defines something."""
        for number in range(self.start, self.stop):
            statement = split_line(self.source, number)
            if statement is not None:
                yield statement


def split_sections(source: SourceFile) -> list[Section]:
    """Split a service or an action at its separators, including badly written ones."""
    sections = []
    start = 1
    for stop, line in enumerate([*source.lines, SEPARATOR], start=1):
        if is_near_separator(line):
            sections.append(Section(source, start, stop))
            start = stop + 1
    return sections


def is_near_separator(line: str) -> bool:
    """Return whether a line is, or is meant to be, a separator."""
    return _NEAR_SEPARATOR.fullmatch(line) is not None


def split_line(source: SourceFile, number: int) -> Statement | None:
    """Split one line; None if it is empty or a comment."""
    text = source.line(number).replace('\t', ' ').partition('#')[0].rstrip()
    content = text.lstrip(' ')
    if not content:
        return None
    indent = len(text) - len(content)
    type_text, _, rest = content.partition(' ')
    rest = rest.lstrip()
    type_span = Span(source, number, indent + 1, len(type_text))
    place = len(text) - len(rest) + 1
    if not rest:
        return Statement('unfinished', indent, type_span, Span(source, number, place, 0), None)
    constant = '=' in rest
    name, _, value = rest.partition('=' if constant else ' ')
    value = value.lstrip()
    value_span = Span(source, number, len(text) - len(value) + 1, len(value))
    return Statement(
        'constant' if constant else 'field',
        indent,
        type_span,
        Span(source, number, place, len(name.rstrip())),
        value_span if value or constant else None,
    )
