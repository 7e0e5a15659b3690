"""YAML text → a tree of nodes with spans, in constant stack whatever the input nests."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

import yaml

from composer.diagnostics import Diagnostic, Related, SourceFile, Span, diagnostic_at
from composer.input_limits import MAX_DEPTH, MAX_VALUES
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable

# A key and its value without a space between them, which YAML reads as one text.
_GLUED = re.compile(r'[ -]*(?P<key>[\w.~/-]+):(?P<value>[^\s:#][^:#]*?)\s*(?:#.*)?')
# What the parser says one line too late.
_AFTER_GLUED = (
    'mapping values are not allowed in this context',
    "could not find expected ':'",
)
_SYNTAX_HELP = {
    'found character that cannot start any token': 'put a value that begins with it in quotes',
    'block sequence entries are not allowed in this context': 'write the list as [a, b]',
    'did not find expected key': 'indent all keys of a mapping alike',
}
_QUOTES = ("'", '"')
# PyYAML 6.0.4 brings a parser that refuses 1,000 levels before it tells of the first.
_NESTED_TOO_DEEP = 'exceeded maximum nesting depth'

# libyaml's parser is ten times faster; wheels of PyYAML bring it, source builds may not.
_Loader: Any = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


@dataclass(slots=True, eq=False)
class ScalarNode:
    """A scalar as written; `plain` if it has neither quotes nor a block style."""

    text: str
    tag: str | None
    plain: bool
    span: Span
    quoted: bool = False


@dataclass(slots=True, eq=False)
class SequenceNode:
    """A list; nodes may stand in several places through aliases."""

    tag: str | None
    span: Span
    items: list[TreeNode] = field(default_factory=list)


@dataclass(slots=True, eq=False)
class MappingNode:
    """A mapping, with its keys in the order of the text, duplicates included."""

    tag: str | None
    span: Span
    pairs: list[tuple[TreeNode, TreeNode]] = field(default_factory=list)


TreeNode: TypeAlias = ScalarNode | SequenceNode | MappingNode


class CompositionError(Exception):
    """The text cannot be read to its end.

    Attributes:
        diagnostic: Why.
        values: How many keys and values were read.
    """

    values = 0

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def compose_tree(text: str, source: SourceFile) -> TreeNode | None:
    """Return the one document of a text, or `None` if it is empty.

    Raises:
        CompositionError: The text is not YAML, nests too deep, holds several documents, or an
            alias that is unknown or contains itself.
    """
    trees, _ = _compose(text, source, partial(_TreeBuilder, source, most_documents=1))
    return trees[0] if trees else None


def compose_trees(
    text: str, source: SourceFile, *, alias_rule: str, most_values: int = MAX_VALUES
) -> tuple[list[TreeNode], int]:
    """Return all documents of a text without aliases, and how many keys and values they have.

    Args:
        alias_rule: The rule for findings about aliases.
        most_values: How many keys and values they may have.

    Raises:
        CompositionError: The text is not YAML, nests too deep, holds an alias or too many values.
    """
    create = partial(_TreeBuilder, source, alias_rule=alias_rule, most_values=most_values)
    return _compose(text, source, create)


def _compose(
    text: str, source: SourceFile, create_builder: Callable[[], _TreeBuilder]
) -> tuple[list[TreeNode], int]:
    builder = create_builder()
    try:
        _parse(text, source, builder)
    except CompositionError as error:
        refusal = error.__cause__
        if isinstance(refusal, yaml.MarkedYAMLError) and refusal.problem == _NESTED_TOO_DEEP:
            # The text before it goes beyond our own limit, or is wrong for another reason.
            end = refusal.problem_mark.index if refusal.problem_mark else 0
            return _compose(text[:end], source, create_builder)
        error.values = builder.values
        raise
    return builder.roots, builder.values


def _parse(text: str, source: SourceFile, builder: _TreeBuilder) -> None:
    try:
        loader = _Loader(text)
        takers = builder.takers()
        while (event := loader.get_event()) is not None:
            if take := takers.get(type(event)):
                take(event)
    except yaml.MarkedYAMLError as error:
        quote = _find_open_quote(error, builder.last_quoted)
        finding = _quote_problem(quote, source) if quote else _syntax_problem(error, source)
        raise CompositionError(finding) from error
    except yaml.reader.ReaderError as error:
        raise CompositionError(_character_problem(error, text, source)) from error
    except yaml.YAMLError as error:
        raise CompositionError(
            diagnostic_at(Span(source, 1, 1, 0), 'yaml-syntax', f'this is not YAML: {error}')
        ) from error


class _TreeBuilder:
    """Takes the parser's events one by one."""

    def __init__(
        self,
        source: SourceFile,
        *,
        alias_rule: str | None = None,
        most_documents: int | None = None,
        most_values: int = MAX_VALUES,
    ) -> None:
        self.roots: list[TreeNode] = []
        self.values = 0
        self.last_quoted: Any = None
        self._source = source
        self._alias_rule = alias_rule
        self._most_documents = most_documents
        self._most_values = most_values
        # The lists and mappings that have not ended, and what the last of them has: of a mapping,
        # keys and values in turn.
        self._open: list[tuple[SequenceNode | MappingNode, list[TreeNode]]] = []
        self._inner = self.roots
        self._anchors: dict[str, TreeNode] = {}
        self._documents = 0

    def takers(self) -> dict[type, Callable[[Any], None]]:
        """Return what takes an event, by its class."""
        return {
            yaml.ScalarEvent: self._take_scalar,
            yaml.MappingStartEvent: self._begin_mapping,
            yaml.SequenceStartEvent: self._begin_sequence,
            yaml.MappingEndEvent: self._end,
            yaml.SequenceEndEvent: self._end,
            yaml.AliasEvent: self._take_alias,
            yaml.DocumentStartEvent: self._begin_document,
        }

    def _take_scalar(self, event: Any) -> None:
        is_plain, is_text = event.implicit
        tag = None if is_plain or is_text else event.tag
        start, end = event.start_mark, event.end_mark
        line, column = start.line, start.column
        if line == end.line:
            length = end.column - column
        else:
            length = max(len(self._source.line(line + 1).rstrip()) - column, 1)
        span = Span(self._source, line + 1, column + 1, length)
        style = event.style
        plain, quoted = is_plain and not style, style in _QUOTES
        self._add(ScalarNode(event.value, tag, plain, span, quoted), event.anchor)
        if quoted:
            self.last_quoted = event

    def _begin_mapping(self, event: Any) -> None:
        node = MappingNode(event.tag, self._start(event))
        self._begin(node, [], event)

    def _begin_sequence(self, event: Any) -> None:
        node = SequenceNode(event.tag, self._start(event))
        self._begin(node, node.items, event)

    def _begin(self, node: SequenceNode | MappingNode, inner: list[TreeNode], event: Any) -> None:
        self._add(node, event.anchor)
        self._open.append((node, inner))
        self._inner = inner
        if len(self._open) > MAX_DEPTH:
            self._stop(event, 'too-deep', f'the data is nested more than {MAX_DEPTH} levels deep')

    def _end(self, _event: Any) -> None:
        node, inner = self._open.pop()
        if isinstance(node, MappingNode):
            node.pairs = list(zip(inner[::2], inner[1::2], strict=True))
        self._inner = self._open[-1][1] if self._open else self.roots

    def _begin_document(self, event: Any) -> None:
        self._documents += 1
        if self._most_documents is not None and self._documents > self._most_documents:
            self._stop(event, 'several-documents', 'a file holds only one YAML document')

    def _add(self, node: TreeNode, anchor: str | None) -> None:
        self.values += 1
        if self.values > self._most_values:
            which = 'file holds' if self._most_values == MAX_VALUES else 'files together hold'
            message = f'the {which} more than {MAX_VALUES:,} keys and values'
            raise CompositionError(diagnostic_at(node.span, 'unreadable-file', message))
        if anchor is not None:
            self._anchors[anchor] = node
        self._inner.append(node)

    def _take_alias(self, event: Any) -> None:
        if self._alias_rule is not None:
            message = f'ROS does not support aliases here: write what *{event.anchor} stands for'
            self._stop(event, self._alias_rule, message)
        node = self._anchors.get(event.anchor)
        if node is None:
            message = f'no anchor &{event.anchor} before this alias'
            help_text = suggest(event.anchor, self._anchors, 'there are')
            self._stop(event, 'unknown-alias', message, help=help_text)
        if any(node is each for each, _ in self._open):
            self._stop(event, 'cyclic-alias', f'the alias *{event.anchor} contains itself')
        self._add(node, None)

    def _start(self, event: Any, length: int = 1) -> Span:
        mark = event.start_mark
        return Span(self._source, mark.line + 1, mark.column + 1, length)

    def _stop(
        self,
        event: Any,
        rule: str,
        message: str,
        help: str | None = None,  # noqa: A002 - the word that the finding shows
    ) -> NoReturn:
        # Only an alias has a name here, after its asterisk.
        length = len(f'*{event.anchor}') if isinstance(event, yaml.AliasEvent) else 1
        span = self._start(event, length)
        raise CompositionError(diagnostic_at(span, rule, message, help=help))


def _find_open_quote(error: yaml.MarkedYAMLError, last: Any) -> Any:
    """Return where a quote begins that is not closed, or only by the beginning of another one."""
    if error.context and 'quoted scalar' in error.context and 'unexpected' in str(error.problem):
        return error.context_mark
    mark = error.problem_mark
    is_long = last is not None and last.start_mark.line != last.end_mark.line
    is_at_its_end = is_long and mark is not None and mark.line == last.end_mark.line
    return last.start_mark if is_at_its_end else None


def _quote_problem(begun: Any, source: SourceFile) -> Diagnostic:
    span = Span(source, begun.line + 1, begun.column + 1)
    message = 'this is not YAML: the quote that begins here is not closed in its line'
    return diagnostic_at(span, 'yaml-syntax', message)


def _syntax_problem(error: yaml.MarkedYAMLError, source: SourceFile) -> Diagnostic:
    mark = error.problem_mark or error.context_mark
    span = Span(source, mark.line + 1, mark.column + 1) if mark else Span(source, 1, 1, 0)
    if (glued := _find_glued_key(error, span)) is not None:
        return glued
    problem = error.problem or error.context or 'it cannot be parsed'
    begun = error.context_mark
    context = f' {error.context}' if error.context and error.problem else ''
    related: tuple[Related, ...] = ()
    if context and begun and mark and begun.line != mark.line:
        context += f' that begins on line {begun.line + 1}'
        related = (Related('it begins here', Span(source, begun.line + 1, begun.column + 1)),)
    message = f'this is not YAML: {problem}{context}'
    return diagnostic_at(
        span, 'yaml-syntax', message, help=_syntax_help(error, span), related=related
    )


def _find_glued_key(error: yaml.MarkedYAMLError, span: Span) -> Diagnostic | None:
    """Return the finding for a `key:value` above, which makes the next line part of its text."""
    if error.problem not in _AFTER_GLUED:
        return None
    number = span.line - 1
    while number and not span.source.line(number).split('#')[0].strip():
        number -= 1
    found = _GLUED.fullmatch(span.source.line(number))
    if found is None:
        return None
    key, value = found['key'], found['value']
    return diagnostic_at(
        Span(span.source, number, found.start('key') + 1, len(f'{key}:{value}')),
        'yaml-syntax',
        f"this is not YAML: '{key}:' needs a space before its value",
        help=f"write '{key}: {value}'",
    )


def _syntax_help(error: yaml.MarkedYAMLError, span: Span) -> str | None:
    before = span.source.line(span.line)[: span.column - 1].rstrip()
    if '\t' in before[: len(before) - len(before.lstrip())] or span.text == '\t':
        return 'indent YAML with spaces, not tabs'
    closing = re.search("'([]}])'", error.problem or '')
    begun = error.context_mark
    if closing and begun and (span.text in (']', '}') or begun.line + 1 < span.line):
        return f"close the bracket with '{closing[1]}'"
    if span.text == ':' and closing:
        return "put a comma between entries, and a value that contains ': ' in quotes"
    if span.text == ':' and error.problem == _AFTER_GLUED[0] and ': ' in before:
        return "put a value that contains ': ' in quotes"
    if before.endswith(_QUOTES) and error.problem in _SYNTAX_HELP:
        return "put all of the value in quotes, and write '' for a ' in it"
    return _SYNTAX_HELP.get(error.problem or '')


def _character_problem(
    error: yaml.reader.ReaderError, text: str, source: SourceFile
) -> Diagnostic:
    # The position in the error counts bytes or characters, depending on the parser.
    found = yaml.reader.Reader.NON_PRINTABLE.search(text)
    before = f'{text[: found.start()]}^'.splitlines() if found else ['^']
    line, column = len(before), len(before[-1])
    code = error.character if isinstance(error.character, int) else ord(str(error.character)[:1])
    return diagnostic_at(
        Span(source, line, column),
        'yaml-syntax',
        f'YAML does not allow the character U+{code:04X}',
        help='remove it, or write it as an escape in double quotes',
    )
