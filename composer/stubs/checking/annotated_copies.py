"""Copies of a project's modules in which functions say what they are given and return.

The copies have the lines of the originals; in a line that has an annotation more, columns are
mapped back. What the annotations need is imported after the last line. Of some places, a report
says nothing certain: an error there may be caught, asked for before, or never come, as a value of
the file decides.
"""

from __future__ import annotations

import ast
import io
import itertools
import tokenize
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, TypeAlias

from composer.entity_kinds import PUBLISHED
from composer.language.bindings import node_bindings
from composer.node_uses.names import Chain
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.modules import FunctionSource
from composer.python_source.syntax import (
    FUNCTIONS,
    SCOPES,
    count_characters,
    list_arguments,
    list_children,
    owner_of,
    stored_names,
    words_in,
)
from composer.records import record
from composer.stubs.message_stubs import StubImports
from composer.stubs.node_stubs import named, type_of_parameter
from composer.stubs.project_modules import all_nodes
from composer.stubs.stored_types import ANYTHING, type_in

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.interfaces.message_types import MessageTypes
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec
    from composer.node_uses.names import Value
    from composer.node_uses.reading import Wire
    from composer.node_uses.walk import Places
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.type_checker import TypeReport
    from composer.stubs.project_modules import ProjectModule

FunctionKey: TypeAlias = tuple[str, str]
# What asks for an attribute that may not be there, or makes it.
_ASKING = frozenset({'hasattr', 'getattr', 'setattr', 'delattr'})


@dataclass(slots=True)
class Received:
    """The keys of nodes, and the types, that a parameter is given.

    It is open if it may be given something else.
    """

    nodes: dict[str, None] = field(default_factory=dict)
    types: dict[str, None] = field(default_factory=dict)
    is_open: bool = False


@dataclass(slots=True)
class FunctionUse:
    """A function at the top level of a module or class, and what its parameters are given.

    It may be bound to several places, and be called or passed on by the project itself.
    """

    definition: FunctionNode
    received: dict[str, Received] = field(default_factory=dict)
    bindings: list[tuple[Binding, Wire]] = field(default_factory=list)
    is_called: bool = False

    @property
    def given(self) -> dict[str, Value]:
        """What the parameters stand for that are given nodes or messages alone."""
        return {
            name: Chain(('node' if each.nodes else 'message',))
            for name, each in self.received.items()
        }

    @property
    def is_chosen(self) -> bool:
        """Whether an argument of another kind decides what is done: whoever calls it knows."""
        names = {each.arg for each in list_arguments(self.definition.args)} - {'self', 'cls'}
        names -= {name for name, each in self.received.items() if not each.is_open}
        return self.is_called and any(
            words_in(node.test) & names and any(isinstance(each, ast.Return) for each in node.body)
            for node in ast.walk(self.definition)
            if isinstance(node, ast.If)
        )

    def give(self, name: str, value: Value | None, node: NodeSpec, of_type: str) -> None:
        """Note what a parameter is given by a behaviour of a node."""
        received = self.received.setdefault(name, Received())
        if value == Chain(('node',)):
            received.nodes[node.key] = None
        else:
            received.types[of_type] = None
            received.is_open |= of_type == ANYTHING


def find_received_values(
    context: CheckContext, modules: Mapping[str, ProjectModule]
) -> dict[FunctionKey, FunctionUse]:
    """Return the functions of a project that are given nodes or messages, by module and name."""
    functions = {
        (name, f'{owner}{function.name}'): FunctionUse(function)
        for name, module in modules.items()
        for owner, body in _scopes(module)
        for function in body
        if isinstance(function, FUNCTIONS)
    }
    by_definition = {id(use.definition): use for use in functions.values()}
    for node in all_nodes(context):
        for binding in node_bindings(node):
            behaviour, wire = binding.behaviour, context.behaviours.wire_of(node, binding)
            bound = functions.get((behaviour.module, behaviour.function))
            reading = context.behaviours.read(node, binding)
            # What decorators from elsewhere make of a function, nobody knows.
            if bound is not None and (reading.passed or not bound.definition.decorator_list):
                bound.bindings.append((binding, wire))
            for passed in reading.passed:
                use = by_definition.get(id(passed.definition))
                if use is not None:
                    use.is_called |= passed.is_call
                    for name, value in passed.given.items():
                        of_type = _type_of(context.types, value, node, wire)
                        use.give(name, value, node, of_type)
    return functions


def _type_of(types: MessageTypes, value: Value | None, node: NodeSpec, wire: Wire) -> str:
    match value:
        case Chain(path=('node', 'parameters', name)) if name in node.parameters:
            return type_of_parameter(node.parameters[name])
        case Chain(path=('message', *path)) if wire.given:
            return type_in(types, wire.given, path)
        case Chain(path=('made', name, *path)):
            return type_in(types, name, path)
    return ANYTHING


def find_certain_values(
    functions: Mapping[FunctionKey, FunctionUse],
) -> dict[int, dict[str, Value]]:
    """Return what parameters stand for that are given one type alone, by their functions."""
    return {
        id(use.definition): {
            name: Chain(('node',) if each.nodes else ('made', *each.types))
            for name, each in use.received.items()
            if not each.is_open and bool(each.nodes) + len(each.types) == 1
            if each.nodes or '/' in ''.join(each.types)
        }
        for use in functions.values()
    }


def _scopes(module: ProjectModule) -> Iterator[tuple[str, list[ast.stmt]]]:
    yield '', module.tree.body
    for top in module.tree.body:
        if isinstance(top, ast.ClassDef):
            yield f'{top.name}.', top.body


# The annotations that say less than the class of the node.
_GENERAL = frozenset({'Node', 'composer.Node', 'Any', 'typing.Any', 'object'})


@dataclass(frozen=True, slots=True, order=True)
class _Edit:
    """A change in one line: characters from `start` to `end`, counted from 0, become `text`."""

    line: int
    start: int
    end: int
    text: str


@record
class AnnotatedCopy:
    """A module, and the changes that make its annotated copy, with the lines at its end."""

    module: ProjectModule
    _edits: tuple[_Edit, ...]
    _end: tuple[str, ...]

    @property
    def text(self) -> str:
        """The text of the copy."""
        lines = list(self.module.source.lines)
        for edit in reversed(self._edits):
            line = lines[edit.line - 1]
            lines[edit.line - 1] = line[: edit.start] + edit.text + line[edit.end :]
        return '\n'.join([*lines, *self._end, ''])

    def revealing(self, values: Iterable[ast.expr]) -> AnnotatedCopy:
        """Return a copy that has the types of values reported, as `typing.reveal_type` does."""
        edits = [*self._edits]
        for value in values:
            (line, column), (end_line, end) = self.start(value), self.end(value)
            edits.append(_Edit(line, column - 1, column - 1, 'reveal_type('))
            edits.append(_Edit(end_line, end - 1, end - 1, ')'))
        return replace(self, _edits=tuple(sorted(edits)))

    def original_column(self, line: int, column: int) -> int:
        """Return the column, from 1, in the original, of one in the copy."""
        grown = 0
        for edit in (each for each in self._edits if each.line == line):
            begin = edit.start + grown + 1
            if begin <= column < begin + len(edit.text):
                return edit.start + 1
            grown += (len(edit.text) - (edit.end - edit.start)) if column >= begin else 0
        return column - grown

    def start(self, node: ast.AST) -> tuple[int, int]:
        """Return the line and the column at which a statement or an expression begins."""
        line, offset = getattr(node, 'lineno', 1), getattr(node, 'col_offset', 0)
        return line, self._column(line, offset)

    def end(self, node: ast.AST) -> tuple[int, int]:
        """Return the line and the column after the last character."""
        line, offset = getattr(node, 'end_lineno', 1), getattr(node, 'end_col_offset', 0)
        return line, self._column(line, offset)

    def _column(self, line: int, offset: int) -> int:
        lines = self.module.source.lines
        return count_characters(lines[line - 1] if line <= len(lines) else '', offset) + 1

    @cached_property
    def parents(self) -> dict[int, ast.AST]:
        """What each syntax node is in, by the identity of the node."""
        nodes = ast.walk(self.module.tree)
        return {id(child): node for node in nodes for child in ast.iter_child_nodes(node)}

    @cached_property
    def asked(self) -> frozenset[str]:
        """The attributes and keys that the module asks for, or makes."""
        return frozenset(
            argument.value
            for node in ast.walk(self.module.tree)
            for argument in _asked_names(node)
            if isinstance(argument, ast.Constant) and isinstance(argument.value, str)
        )

    @cached_property
    def nodes(self) -> dict[tuple[int, int], list[ast.AST]]:
        """The statements and expressions that begin at each place, outermost first."""
        places: dict[tuple[int, int], list[ast.AST]] = {}
        for node in ast.walk(self.module.tree):
            if isinstance(node, ast.expr | ast.stmt):
                places.setdefault(self.start(node), []).append(node)
        return places


def _asked_names(node: ast.AST) -> list[ast.expr]:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _ASKING:
        return node.args
    if isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn):
        return [node.left]
    return []


@dataclass(slots=True)
class Annotator:
    """Writes annotated copies; `name_nodes` returns the module and the class of nodes."""

    functions: Mapping[FunctionKey, FunctionUse]
    name_nodes: Callable[[Iterable[str]], tuple[str, str]]
    kept: Mapping[str, str]
    _imports: StubImports = field(default_factory=lambda: StubImports(''))

    def copy(self, module: ProjectModule) -> AnnotatedCopy:
        """Return the copy of a module."""
        self._imports = StubImports('')
        lines = list(module.source.lines)
        edits: list[_Edit] = []
        for (name, _), use in self.functions.items():
            if name == module.name:
                edits += self._edit(use, lines)
        for top in module.tree.body:
            if isinstance(top, ast.ClassDef):
                edits += self._attributes(top, lines)
        return AnnotatedCopy(module, tuple(sorted(edits)), tuple(self._imports.lines()))

    def _edit(self, use: FunctionUse, lines: list[str]) -> Iterator[_Edit]:
        arguments = use.definition.args
        changed = stored_names(use.definition)
        pending = [] if use.is_chosen else [*arguments.posonlyargs, *arguments.args]
        for each in pending:
            received = use.received.get(each.arg)
            wanted = self._annotation(received) if received else None
            if wanted and each.arg not in changed:
                yield from _annotate(
                    each, wanted, lines, is_node=bool(received and received.nodes)
                )
        is_free = use.bindings and not use.is_called and use.definition.returns is None
        if is_free and (wanted := self._returned(use)):
            yield from _annotate_return(use.definition, wanted, lines)

    def _attributes(self, of: ast.ClassDef, lines: list[str]) -> Iterator[_Edit]:
        """Write the types of attributes that begin as `None`."""
        pending = {*self.kept}
        for init in (each for each in of.body if getattr(each, 'name', '') == '__init__'):
            for statement in getattr(init, 'body', []):
                match statement:
                    case ast.Assign(
                        targets=[ast.Attribute(ast.Name('self'), name) as target],
                        value=ast.Constant(None),
                    ) if name in pending:
                        pending.discard(name)
                        wanted = f'{named(self._imports, self.kept[name])} | None'
                        yield _after(target, wanted, lines)

    def _annotation(self, received: Received) -> str | None:
        if received.is_open or bool(received.nodes) == bool(received.types):
            return None
        if received.nodes:
            return self._imports.take(*self.name_nodes(received.nodes))
        # A function that is given messages of several types tells them apart in its own ways.
        return named(self._imports, *received.types) if len(received.types) == 1 else None

    def _returned(self, use: FunctionUse) -> str | None:
        kind = FunctionSource(use.definition).kind
        returned = self._payload(use, 'returned')
        if kind in (FunctionKind.PLAIN, FunctionKind.COROUTINE):
            return returned
        yielded = self._payload(use, 'yielded')
        anything = self._imports.take('typing', 'Any')
        if kind is FunctionKind.ASYNC_GENERATOR:
            items = f'{yielded} | {returned}' if yielded and returned else anything
            return f'{self._imports.take("typing", "AsyncGenerator")}[{items}, {anything}]'
        generator = self._imports.take('typing', 'Generator')
        # A timer's generator only ends: what it returns means nothing.
        is_timer = any(binding.kind and binding.kind.is_timed for binding, _ in use.bindings)
        ended = anything if is_timer else returned or anything
        return f'{generator}[{yielded or anything}, {anything}, {ended}]'

    def _payload(self, use: FunctionUse, key: str) -> str | None:
        """Return the type of a payload; `None` if anything may be returned somewhere."""
        options: dict[str, None] = {}
        # Nothing is published where nothing is returned; a service needs its response.
        may_be_none = key == 'yielded'
        for binding, wire in use.bindings:
            name = getattr(wire, key)
            if name is None:
                return None
            options[self._imports.payload(name)] = None
            may_be_none |= getattr(binding.key, key) == PUBLISHED
        return ' | '.join([*options, *(['None'] if may_be_none else [])])


def _after(node: ast.arg | ast.expr, wanted: str, lines: list[str]) -> _Edit:
    line = node.end_lineno or node.lineno
    end = count_characters(lines[line - 1], node.end_col_offset or 0)
    return _Edit(line, end, end, f': {wanted!r}')


def _annotate(
    argument: ast.arg, wanted: str, lines: list[str], *, is_node: bool
) -> Iterator[_Edit]:
    if argument.annotation is None:
        yield _after(argument, wanted, lines)
        return
    given = argument.annotation
    written = given.value if isinstance(given, ast.Constant) else ast.unparse(given)
    if is_node and written in _GENERAL and given.lineno == given.end_lineno:
        start = count_characters(lines[given.lineno - 1], given.col_offset)
        end = count_characters(lines[given.lineno - 1], given.end_col_offset or 0)
        yield _Edit(given.lineno, start, end, f"'{wanted}'")


def _annotate_return(function: FunctionNode, wanted: str, lines: list[str]) -> Iterator[_Edit]:
    """Write the type of what a function returns after its parameters."""
    source = '\n'.join(lines[function.lineno - 1 :])
    depth = 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.OP and token.string in '([{':
            depth += 1
        elif token.type == tokenize.OP and token.string in ')]}':
            depth -= 1
            if depth == 0:
                line = function.lineno + token.end[0] - 1
                yield _Edit(line, token.end[1], token.end[1], f" -> '{wanted}'")
                return


# What asks what a value is.
_TESTS = frozenset({'hasattr', 'isinstance', 'issubclass', 'callable', 'type'})
# What has no places of its own, and what is no value that can be asked for.
_NOT_ASKED = (ast.JoinedStr, ast.Lambda, ast.arguments, ast.pattern, ast.stmt)
_NOT_VALUES = (
    *(ast.Constant, ast.Dict, ast.Lambda, ast.List, ast.NamedExpr, ast.Set, ast.Slice),
    *(ast.Starred, ast.Tuple, ast.Yield, ast.YieldFrom),
)
# What may catch errors of what is in it, or hold for some types alone.
_CATCHING = (ast.Match, ast.Try, ast.TryStar, ast.With)


@record
class ReportedPlace:
    """The syntax at the place of a report, and whether it is left alone."""

    copy: AnnotatedCopy
    report: TypeReport
    places: Places

    @cached_property
    def _start(self) -> tuple[int, int]:
        line = self.report.line
        return line, self.copy.original_column(line, self.report.column)

    @property
    def nodes(self) -> list[ast.AST]:
        """The syntax nodes that begin where the report is, outermost first."""
        return self.copy.nodes.get(self._start, [])

    @property
    def values(self) -> list[ast.expr]:
        """The expressions that begin where the report is, outermost first."""
        return [node for node in self.nodes if isinstance(node, ast.expr)]

    @property
    def whole(self) -> list[ast.expr]:
        """The expressions that are just where the report is."""
        line = self.report.end_line
        end = line, self.copy.original_column(line, self.report.end_column)
        return [each for each in self.values if self.copy.end(each) == end]

    @property
    def calls(self) -> list[ast.Call]:
        """The calls that the report is in, innermost first."""
        return [node for node in self.around if isinstance(node, ast.Call)]

    @cached_property
    def around(self) -> list[ast.AST]:
        """The syntax nodes that the report is in, innermost first."""
        start, end = self.copy.start, self.copy.end
        found = self.nodes or [
            node
            for place, nodes in self.copy.nodes.items()
            for node in nodes
            if place <= self._start <= end(node)
        ]
        if not found:
            return []
        # Of those that begin together, the inner ones come last.
        _, _, node = max((start(each), index, each) for index, each in enumerate(found))
        chain = [node]
        while (above := self.copy.parents.get(id(chain[-1]))) is not None:
            chain.append(above)
        return chain

    @property
    def parts(self) -> list[ast.expr]:
        """The values in the statement that the report is in, or in its head."""
        inner = next((each for each in self.around if isinstance(each, ast.stmt)), None)
        heads = [] if inner is None else list_children(inner)
        pending = [each for each in heads if not isinstance(each, ast.stmt)]
        # Whose attribute is missing; other parts of a chain have to stay together, for what is
        # known of the whole.
        is_missing = self.report.kind == 'missing-attribute'
        named = [each for each in self.values if isinstance(each, ast.Attribute)]
        found: list[ast.expr] = [each.value for each in named if is_missing]
        while pending:
            node = pending.pop()
            if isinstance(node, ast.Call):
                pending += [*node.args, *node.keywords, *list_children(node.func)]
            elif not isinstance(node, _NOT_ASKED) and not _is_chain(node):
                pending += list_children(node)
            is_read = isinstance(getattr(node, 'ctx', ast.Load()), ast.Load)
            if isinstance(node, ast.expr) and is_read and not isinstance(node, _NOT_VALUES):
                found.append(node)
        return found

    @property
    def function(self) -> FunctionNode | None:
        """The function that the report is in."""
        return next((node for node in self.around if isinstance(node, FUNCTIONS)), None)

    @property
    def lines(self) -> range:
        """The lines of the statement that the report is in, or of its head."""
        for node in self.around:
            if isinstance(node, ast.stmt) and not hasattr(node, 'body'):
                return range(node.lineno, (node.end_lineno or node.lineno) + 1)
            if isinstance(node, ast.stmt):
                break
        return range(self.report.line, self.report.line + 1)

    @property
    def is_left_alone(self) -> bool:
        """Whether what the report is about may be caught or asked for, or is never reached."""
        chain, function = self.around, self.function
        if not chain or self._standing[0]:
            return True
        asked = _asked_in(function) if function else frozenset()
        inner = next((i for i, node in enumerate(chain) if isinstance(node, ast.stmt)), 0)
        part = chain[max(0, inner - 1)] if hasattr(chain[inner], 'body') else chain[inner]
        names = {node.id for node in ast.walk(part) if isinstance(node, ast.Name)}
        return bool(names & asked)

    @property
    def is_chosen_by_file(self) -> bool:
        """Whether only the file decides whether what the report is about is reached."""
        return self._standing[1]

    @property
    def depends_on_file(self) -> bool:
        """Whether it may be reached only as the file has decided before."""
        return self._standing[2]

    @cached_property
    def _standing(self) -> tuple[bool, bool, bool]:
        """As of a `Walk`; what no behaviour comes to is left alone on any condition."""
        inside = [*itertools.takewhile(lambda node: not isinstance(node, SCOPES), self.around)]
        known = [self.places[id(node)] for node in inside if id(node) in self.places]
        if known:
            return known[0]
        is_caught = any(isinstance(node, _CATCHING) for node in inside)
        tests = [
            getattr(node, 'test', None) or getattr(node, 'values', [None])[0] for node in inside
        ]
        words = words_in(*(test for test in tests if isinstance(test, ast.expr)))
        return is_caught, bool(words & (_TESTS | {'parameters', 'name'})), True


# Reports come a function after the other.
@lru_cache(maxsize=1)
def _asked_in(function: FunctionNode) -> frozenset[str]:
    """Return the names in what a function asks of values: what they are, or have."""
    return frozenset(
        name
        for node in ast.walk(function)
        if isinstance(node, ast.Call) and getattr(node.func, 'id', '') in _TESTS
        for name in words_in(*node.args)
    )


def _is_chain(node: ast.AST) -> bool:
    return isinstance(node, ast.expr) and isinstance(owner_of(node), ast.Name)
