"""Which reports of a type checker are about messages and nodes.

A behaviour without annotations is full of values whose types a checker guesses: what it says of
those is left out. What it says of the types that stubs declare is no guess.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING

from composer.python_source.local_names import stored_names
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.stubs.annotated_copies import AnnotatedCopy
    from composer.stubs.type_checkers import TypeReport

_QUOTED = re.compile(r'"([^"]+)"')
_WORD = re.compile(r'\w+')
_CALLED = re.compile(r'(?:to|in function) "(\w+)"')
_ATTRIBUTE = re.compile(r'attribute "(\w+)"')
_OF_NODES = frozenset({'publish', 'call', 'call_async', 'send_goal'})
_METHODS = _OF_NODES | {'__init__', 'set_parameters', 'get_parameters'}
# What asks for an attribute that may not be there, or makes it.
_ASKING = frozenset({'hasattr', 'getattr', 'setattr', 'delattr'})
# What a missing name raises, and what these errors are.
_CAUGHT = frozenset(
    {
        'AttributeError',
        'BaseException',
        'ComposerError',
        'Exception',
        'KeyError',
        'LookupError',
        'PayloadError',
        'TypeError',
        'UndeclaredError',
        'UndeclaredParameterError',
    }
)
_KEPT = frozenset(
    {
        'arg-type',
        'assignment',
        'attr-defined',
        'call-arg',
        'call-overload',
        'comparison-overlap',
        'index',
        'list-item',
        'misc',
        'operator',
        'return-value',
        'typeddict-item',
        'typeddict-unknown-key',
        'unused-coroutine',
        'reportArgumentType',
        'reportAttributeAccessIssue',
        'reportCallIssue',
        'reportGeneralTypeIssues',
        'reportIndexIssue',
        'reportOperatorIssue',
        'reportReturnType',
        'reportUnusedCoroutine',
    }
)
# What is said of values of which too little is known, or that monkeypatching makes.
_GUESSES = re.compile(
    r'^Unsupported target|^Incompatible import|EllipsisType|object is not iterable'
)


@record
class RelevantReports:
    """Tells the reports in a module that matter.

    Attributes:
        classes: The names of the classes that the stubs declare.
        packages: The names of the interface packages.
    """

    copy: AnnotatedCopy
    classes: frozenset[str]
    packages: frozenset[str]

    def select(self, reports: list[TypeReport]) -> Iterator[TypeReport]:
        """Yield the reports that matter, each place once."""
        seen: set[tuple[int, int]] = set()
        for report in reports:
            if (report.line, report.column) not in seen and self._matters(report):
                seen.add((report.line, report.column))
                yield report

    def _matters(self, report: TypeReport) -> bool:
        if report.code not in _KEPT or _GUESSES.search(report.message):
            return False
        column = self.copy.original_column(report.line, report.column)
        found = self._nodes.get((report.line, column), [])
        return (
            self._is_about_stubs(report)
            and self._is_of_interface(report)
            and _is_shown(report, found, self.classes)
            and not self._is_reused(report)
            and not any(id(node) in self._guarded for node in found)
            and not self._is_asked_for(report, found)
        )

    def _is_of_interface(self, report: TypeReport) -> bool:
        """Return whether a call is one of a node or of a message's class."""
        if report.code == 'misc':
            return 'await' in report.message or '"yield"' in report.message
        called = _CALLED.search(report.message) if 'rgument' in report.message else None
        return called is None or called[1] in _METHODS or called[1] in self.classes

    def _is_reused(self, report: TypeReport) -> bool:
        """Return whether a variable is assigned whose name stands for several things."""
        if report.code != 'assignment':
            return False
        values = (
            node.value
            for node in ast.walk(self.copy.module.tree)
            if isinstance(node, ast.Assign) and node.lineno == report.line
        )
        return any(isinstance(value, ast.Name) and self._stored[value.id] > 1 for value in values)

    @cached_property
    def _stored(self) -> Counter[str]:
        """How often each name is stored; twice if it is unpacked, as its type is a guess then."""
        nodes = list(ast.walk(self.copy.module.tree))
        unpacked = [
            item for node in nodes if isinstance(node, ast.Tuple | ast.List) for item in node.elts
        ]
        return Counter(name.id for name in stored_names([*nodes, *unpacked]))

    def _is_asked_for(self, report: TypeReport, found: list[ast.AST]) -> bool:
        attribute = _ATTRIBUTE.search(report.message)
        if attribute is None:
            shown = (node.slice for node in found if isinstance(node, ast.Subscript))
            return any(
                isinstance(each, ast.Constant) and each.value in self._asked for each in shown
            )
        return attribute[1].startswith('_') or attribute[1] in self._asked

    @cached_property
    def _asked(self) -> frozenset[str]:
        """The attributes that the module asks for, or makes, by their names."""
        return frozenset(
            argument.value
            for node in ast.walk(self.copy.module.tree)
            for argument in _asked_names(node)
            if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
        )

    @cached_property
    def _guarded(self) -> frozenset[int]:
        """The syntax nodes whose errors the module itself catches, or that may never run."""
        return frozenset(
            id(inner)
            for node in ast.walk(self.copy.module.tree)
            for guarded in _guarded_nodes(node)
            for inner in ast.walk(guarded)
        )

    @cached_property
    def _nodes(self) -> dict[tuple[int, int], list[ast.AST]]:
        """The syntax nodes by where they begin, in the original, outermost first."""
        places: dict[tuple[int, int], list[ast.AST]] = {}
        lines = self.copy.module.source.lines
        for node in ast.walk(self.copy.module.tree):
            if isinstance(node, ast.expr | ast.stmt):
                text = lines[node.lineno - 1].encode()[: node.col_offset]
                start = len(text.decode(errors='replace')) + 1
                places.setdefault((node.lineno, start), []).append(node)
        return places

    def _is_about_stubs(self, report: TypeReport) -> bool:
        text = ' '.join([report.message, *report.notes[:3]])
        words = {word for quoted in _QUOTED.findall(text) for word in _WORD.findall(quoted)}
        called = _CALLED.search(report.message)
        is_of_node = called is not None and called[1] in _OF_NODES
        return is_of_node or bool(words & (self.classes | self.packages))


_DISPLAYS = (ast.Dict, ast.List, ast.Tuple)
_PLAIN = (ast.Constant, ast.JoinedStr, ast.UnaryOp, ast.BinOp, ast.Compare, ast.Attribute)


def _asked_names(node: ast.AST) -> list[ast.expr]:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _ASKING:
        return node.args
    if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn):
        return [node.left]
    return []


def _guarded_nodes(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.Try | ast.TryStar) and any(map(_catches, node.handlers)):
        yield from node.body
    elif isinstance(node, ast.With | ast.AsyncWith):
        calls = [item.context_expr for item in node.items]
        names = {each for call in calls if isinstance(call, ast.Call) for each in _names(call)}
        if 'suppress' in names and names & _CAUGHT:
            yield from node.body
    elif isinstance(node, ast.If) and _is_fixed(node.test):
        yield from (*node.body, *node.orelse)
    elif isinstance(node, ast.IfExp) and _is_fixed(node.test):
        yield from (node.body, node.orelse)


def _is_fixed(test: ast.expr) -> bool:
    """Return whether a condition may hold always or never: a constant, or an identity."""
    if isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.Is | ast.IsNot):
        return not isinstance(test.comparators[0], ast.Constant)
    return isinstance(test, ast.Name) and (test.id.isupper() or test.id == '__debug__')


def _catches(handler: ast.ExceptHandler) -> bool:
    return handler.type is None or bool(_CAUGHT & set(_names(handler.type)))


def _names(expression: ast.expr) -> Iterator[str]:
    for node in ast.walk(expression):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr


def _is_shown(report: TypeReport, found: list[ast.AST], classes: frozenset[str]) -> bool:
    """Return whether the code shows what a report is about: a name or mapping written out.

    Of a name or mapping that is computed, a type checker knows too little.
    """
    text = ' '.join([report.message, *report.notes])
    if 'dict[' in text or 'Collection[' in text:
        payloads = [node.value if isinstance(node, ast.Yield) else node for node in found]
        calls = [node for node in found if isinstance(node, ast.Call)]
        if calls and 'overload' in text:
            named = [each.value for each in calls[0].keywords if each.arg == 'payload']
            payloads = [*calls[0].args[1:2], *named] if _has_literal_name(calls) else []
        displays = [each for each in payloads if isinstance(each, _DISPLAYS)]
        return any(_is_plain(each, classes) for each in displays)
    if report.code == 'return-value' and re.search(r'got "[^"]*\b(Any|object)\b', text):
        return False
    if report.code in ('call-overload', 'reportCallIssue') and 'overload' in text:
        return _has_literal_name(found)
    if re.search('Argument 1 to "(publish|call|call_async|send_goal)"', text):
        return any(isinstance(node, ast.Constant) for node in found)
    if 'Literal[' in text and report.code == 'reportArgumentType':
        return any(isinstance(node, ast.Constant) for node in found)
    return True


def _has_literal_name(found: Iterable[ast.AST]) -> bool:
    for node in found:
        name: ast.expr | None = None
        if isinstance(node, ast.Call):
            named = [each.value for each in node.keywords if each.arg == 'name']
            name = next(iter([*node.args, *named]), None)
        elif isinstance(node, ast.Subscript):
            name = node.slice
        if isinstance(name, ast.Constant):
            return True
    return False


def _is_plain(value: ast.expr, classes: frozenset[str]) -> bool:
    """Return whether the code shows the type of a value, or it is no mapping at least."""
    parts: list[ast.expr] = []
    if isinstance(value, ast.Dict):
        if not all(isinstance(key, ast.Constant) for key in value.keys):
            return False
        parts = value.values
    elif isinstance(value, ast.List | ast.Tuple):
        parts = value.elts
    elif isinstance(value, ast.IfExp):
        parts = [value.body, value.orelse]
    elif isinstance(value, ast.Call):
        return next(_names(value.func), '') in classes
    elif not isinstance(value, _PLAIN):
        return False
    return all(_is_plain(each, classes) for each in parts)
