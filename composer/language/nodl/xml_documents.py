"""NoDL in XML, version 1: the nodes of a package, without QoS.

Source: `nodl_python/nodl/_schemas/v1.xsd` of https://github.com/ubuntu-robotics/nodl
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.parsers import expat  # no entities: a document that declares any is refused

from composer.diagnostics import Span, diagnostic_at
from composer.input_limits import MAX_FINDINGS
from composer.language.nodl.node_builder import RULE, NodlNode
from composer.spelling import suggest

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic, SourceFile

_CLIENT_ROLES = {
    'server': ('{}s',),
    'client': ('{}_clients',),
    'both': ('{}s', '{}_clients'),
}
# The sections that an element adds to, by its tag and its role.
_SECTIONS = {
    'topic': {
        'publisher': ('publishers',),
        'subscription': ('subscriptions',),
        'both': ('publishers', 'subscriptions'),
    },
    **{
        tag: {
            role: tuple(section.format(tag) for section in sections)
            for role, sections in _CLIENT_ROLES.items()
        }
        for tag in ('service', 'action')
    },
}
_ATTRIBUTES = {
    'interface': ('version',),
    'node': ('name', 'executable'),
    'parameter': ('name', 'type'),
    **dict.fromkeys(_SECTIONS, ('name', 'type', 'role')),
}
_PARENTS = {'interface': None, 'node': 'interface'}
# How far from its beginning the attributes of an element are searched.
_MOST_LINES = 10


def parse_xml(text: str, source: SourceFile) -> tuple[list[NodlNode], list[Diagnostic]]:
    """Return the nodes of a document, and what is wrong with it."""
    reader = _Reader(source)
    try:
        reader.parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        span = Span(source, error.lineno, error.offset + 1)
        reader.findings.append(
            diagnostic_at(span, RULE, f'not XML: {expat.ErrorString(error.code)}')
        )
    except _RefusedError:
        pass
    return reader.nodes, reader.findings


class _RefusedError(Exception):
    """The document is not read on."""


class _Reader:
    def __init__(self, source: SourceFile) -> None:
        self.nodes: list[NodlNode] = []
        self.findings: list[Diagnostic] = []
        self._source = source
        self._open: list[str] = []
        self.parser = expat.ParserCreate('utf-8')
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = lambda _: self._open.pop()
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype

    def _refuse_doctype(self, *_: object) -> None:
        self._report(self._here(1), 'a NoDL document has no DOCTYPE')
        raise _RefusedError

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self.findings) >= MAX_FINDINGS:
            raise _RefusedError
        here = self._here(len(tag) + 1)
        parent = self._open[-1] if self._open else None
        self._open.append(tag)
        wanted = _PARENTS.get(tag, 'node')
        if tag not in _ATTRIBUTES or parent != wanted:
            options = [each for each in _ATTRIBUTES if _PARENTS.get(each, 'node') == parent]
            where = f"in '{parent}'" if parent else 'at the top'
            help_text = suggest(tag, options, 'there are')
            self._report(here, f"there is no element '{tag}' {where}", help_text)
            if parent is None:
                raise _RefusedError
            return
        missing = [each for each in _ATTRIBUTES[tag] if each not in attributes]
        if missing:
            self._report(here, f"'{tag}' lacks the attribute '{missing[0]}'")
        elif tag == 'interface' and attributes['version'] != '1':
            version = self._value('version', attributes['version'], here)
            self._report(version, f"version '{attributes['version']}' of NoDL is not XML: it is 1")
        elif tag == 'node':
            name, executable = attributes['name'], attributes['executable']
            self.nodes.append(NodlNode(name, executable, here, self.findings))
        elif tag != 'interface' and self.nodes:
            self._add(tag, attributes, here)

    def _add(self, tag: str, attributes: dict[str, str], here: Span) -> None:
        node = self.nodes[-1]
        spans = tuple(self._value(each, attributes[each], here) for each in ('name', 'type'))
        places = (spans[0], spans[1])
        if tag == 'parameter':
            node.add_parameter(attributes['name'], attributes['type'], places)
            return
        roles = _SECTIONS[tag]
        sections = roles.get(attributes['role'])
        if sections is None:
            role = self._value('role', attributes['role'], here)
            help_text = suggest(attributes['role'], roles, 'the roles are')
            self._report(role, f"'{attributes['role']}' is no role of {tag}s", help_text)
        for section in sections or ():
            node.add_end(section, attributes['name'], attributes['type'], places)

    def _here(self, length: int) -> Span:
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber
        return Span(self._source, line, column + 1, length)

    def _value(self, key: str, value: str, here: Span) -> Span:
        """Return where the value of an attribute stands; the element if that is not plain."""
        start = here.column - 1
        for number in range(here.line, here.line + _MOST_LINES):
            text = self._source.line(number)
            for quote in '"\'':
                written = f'{key}={quote}{value}{quote}'
                at = text.find(written, start)
                if at >= 0:
                    return Span(self._source, number, at + len(key) + 3, len(value))
            start = 0
        return here

    def _report(self, span: Span, message: str, help_text: str | None = None) -> None:
        self.findings.append(diagnostic_at(span, RULE, message, help=help_text))
