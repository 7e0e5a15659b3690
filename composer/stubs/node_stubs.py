"""The nodes of a system as classes, which know the names that each node declares."""

from __future__ import annotations

import re
from itertools import chain
from typing import TYPE_CHECKING

from composer.records import record
from composer.stubs.field_types import StubImports, is_writable
from composer.stubs.node_shapes import parameter_types

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.language.specs import NodeSpec
    from composer.stubs.node_shapes import NodeShape, Types

_TIMEOUT = 'timeout: float | None = 5.0'
_NO_PARAMETER = 'the node declares no such parameter, or one of another type'
# What a mapping has of its own: `node.parameters.keys` is no parameter.
_OF_MAPPINGS = frozenset({'get', 'items', 'keys', 'values'})
# The types of Python that parameters have.
_OF_PYTHON = frozenset({'bool', 'bytes', 'float', 'int', 'list', 'str'})
# The classes of a system narrow what `composer.Node` allows.
_SETTINGS = (
    '# mypy: disable-error-code="misc, override, overload-overlap, overload-cannot-match"',
    '# mypy: disable-error-code="assignment, empty-body, no-overload-impl"',
    '# pyright: reportIncompatibleMethodOverride=false, reportIncompatibleVariableOverride=false',
    '# pyright: reportOverlappingOverload=false, reportInconsistentOverload=false',
    '# pyright: reportNoOverloadImplementation=false',
)


def write_nodes(
    module: str, classes: Mapping[str, NodeShape], nodes: Iterable[NodeSpec]
) -> Iterator[str]:
    """Yield the lines of a stub with nodes.

    Args:
        module: Its dotted name.
        classes: The shape of each node, by the name of its class; equal shapes are one class.
        nodes: Those whose parameters behaviours may set and get.
    """
    imports = StubImports(module)
    first: dict[NodeShape, str] = {}
    lines = [*_write_base(imports, nodes)]
    for name, shape in classes.items():
        if shape in first:
            lines += ['', f'{name} = {first[shape]}']
        else:
            first[shape] = name
            lines += _Writer(name, imports).node(shape)
    yield from _SETTINGS
    yield from imports.lines()
    yield from lines


def _write_base(imports: StubImports, nodes: Iterable[NodeSpec]) -> Iterator[str]:
    """Yield the class that the nodes of a system have in common: it knows their parameters."""
    known = _names_by_parameters([*nodes])
    anything, mapping = imports.take('typing', 'Any'), imports.take('typing', 'Mapping')
    of_dict, names_of = imports.take('typing', 'TypedDict'), imports.take('typing', 'Iterable')
    # The names of nodes, those of parameters, the type of their values, and a decorator.
    rows: list[tuple[str, str, str, str]] = []
    for number, (types, names) in enumerate(known.items()):
        fields = {name: _named(imports, ' | '.join(each)) for name, each in types}
        entries = ', '.join(f'{name!r}: {of_type}' for name, of_type in fields.items())
        yield from ('', f'_Values{number} = {of_dict}(')
        yield f"    '_Values{number}', {{{entries}}}, total=False"
        yield ')'
        literals = _literal(imports, names), _literal(imports, fields)
        rows.append((*literals, f'_Values{number}', ''))
    if known:
        # Composer raises an error then. Names of other nodes, and computed ones, are not known.
        literal, every = imports.take('typing', 'LiteralString'), chain(*known.values())
        decorator = f'    @{imports.take("typing_extensions", "deprecated")}({_NO_PARAMETER!r})\n'
        values = f'{mapping}[{literal}, {anything}]'
        rows.append((_literal(imports, every), literal, values, decorator))
    rows.append(('str', 'str', f'{mapping}[str, {anything}]', ''))
    yield from ('', f'class _SystemNode({imports.take("composer", "Node")}):')
    getters = (
        f'{decorator}    def get_parameters(self, node_name: {node}, names: {names_of}[{names}], '
        f'{_TIMEOUT}) -> dict[str, {anything}]: ...'
        for node, names, _, decorator in rows
    )
    setters = (
        f'{decorator}    def set_parameters(self, node_name: {node}, values: {values}, '
        f'{_TIMEOUT}) -> None: ...'
        for node, _, values, decorator in rows
    )
    yield from _overloaded(imports, getters)
    yield from _overloaded(imports, setters)


def _names_by_parameters(nodes: Sequence[NodeSpec]) -> dict[Types, list[str]]:
    """Return the names of nodes by the parameters that they declare."""
    known: dict[Types, list[str]] = {}
    is_flat = all(node.full_name.count('/') == 1 for node in nodes)
    for node in nodes:
        if not node.allow_undeclared_parameters:
            # In a namespace, a name without a slash may mean another node.
            names = [node.full_name, *([node.full_name[1:]] if is_flat else [])]
            known.setdefault(parameter_types(node), []).extend(names)
    return known


def _overloaded(imports: StubImports, methods: Iterable[str]) -> list[str]:
    several = list(methods)
    if len(several) <= 1:
        return several
    decorator = f'    @{imports.take("typing", "overload")}'
    return [line for method in several for line in (decorator, method)]


def _literal(imports: StubImports, names: Iterable[str]) -> str:
    return f'{imports.take("typing", "Literal")}[{", ".join(map(repr, names))}]'


def _named(imports: StubImports, of_type: str) -> str:
    """Return a type with the names by which a stub knows those of `typing`."""
    if ':' in of_type:
        return imports.of(*of_type.split(':'))
    for name in ('Any', 'Literal', 'Time'):
        if of_type.startswith(name):
            alias = imports.take('rclpy.time' if name == 'Time' else 'typing', name)
            return alias + of_type.removeprefix(name)
    return of_type


@record
class _Writer:
    """Writes the classes of one node."""

    name: str
    imports: StubImports

    def node(self, shape: NodeShape) -> Iterator[str]:
        yield from self._parameters(shape)
        yield from self._state(shape)
        yield from ('', f'class {self.name}(_SystemNode):')
        # Type checkers narrow what is final, as by `is not None`, and no property.
        yield f'    parameters: {self.imports.take("typing", "Final")}[{self.name}Parameters]'
        yield from self._property('state', f'{self.name}State')
        yield from self._property('logger', self.imports.support('Logger'))
        rest = f', {_TIMEOUT}'
        methods = {
            'publish': ([self._publish(*publisher) for publisher in shape.publishers], ''),
            **{
                each: ([self._call(each, *client) for client in shape.service_clients], rest)
                for each in ('call', 'call_async')
            },
            'send_goal': ([self._send_goal(*client) for client in shape.action_clients], rest),
        }
        for method, (lines, rest) in methods.items():
            yield from _overloaded(self.imports, lines) or [
                self._method(method, 'Never', 'Never', rest, 'None')
            ]

    def _property(self, name: str, of_type: str) -> Iterator[str]:
        yield '    @property'
        yield f'    def {name}(self) -> {of_type}: ...'

    def _parameters(self, shape: NodeShape) -> Iterator[str]:
        anything = self.imports.take('typing', 'Any')
        mapping = self.imports.take('typing', 'Mapping')
        yield from ('', f'class {self.name}Parameters({mapping}[str, {anything}]):')
        final = self.imports.take('typing', 'Final')
        types = {name: self._union(each) for name, each in shape.parameters}
        # A parameter may have the name of a type, which means the parameter in the class.
        for hidden in _OF_PYTHON & types.keys():
            alias = self.imports.take('builtins', hidden)
            types = {
                name: each if "'" in each else re.sub(rf'\b{hidden}\b', alias, each)
                for name, each in types.items()
            }
        for name, of_type in types.items():
            if is_writable(name) and name not in _OF_MAPPINGS and not name.startswith('__'):
                yield f'    {name}: {final}[{of_type}]'
        yield f'    def __call__(self, prefix: str) -> dict[str, {anything}]: ...'
        yield from _overloaded(
            self.imports,
            (
                f'    def __getitem__(self, name: {self._literal(name)}, /) -> {of_type}: ...'
                for name, of_type in types.items()
            ),
        )

    def _state(self, shape: NodeShape) -> Iterator[str]:
        anything = self.imports.take('typing', 'Any')
        # No `SimpleNamespace`, which has any name for type checkers.
        yield from ('', f'class {self.name}State:')
        yield f'    __dict__: dict[str, {anything}]'
        # A behaviour may set what no other one does yet.
        yield f'    def __setattr__(self, name: str, value: {anything}) -> None: ...'
        if shape.state is None:
            yield f'    def __getattr__(self, name: str) -> {anything}: ...'
        # Last, as a name may be that of a type.
        for name, types in shape.state or ():
            if is_writable(name):
                of_type = anything if name in _OF_PYTHON else self._union(types)
                yield f'    {name}: {of_type}'

    def _union(self, types: Iterable[str]) -> str:
        several = [_named(self.imports, each) for each in types]
        return self.imports.take('typing', 'Any') if 'Any' in types else ' | '.join(several)

    def _publish(self, name: str, types: Sequence[str]) -> str:
        return self._method('publish', self._literal(name), self._payloads(types), '', 'None')

    def _call(self, method: str, name: str, types: Sequence[str]) -> str:
        requests = self._payloads(types, '_Request')
        anything = self.imports.take('typing', 'Any')
        is_known = len(types) == 1 and types[0]
        answer = self.imports.message(f'{types[0]}_Response') if is_known else anything
        rest = f' | None = None, {_TIMEOUT}'
        return self._method(method, self._literal(name), requests, rest, answer)

    def _send_goal(self, name: str, types: Sequence[str]) -> str:
        goals = self._payloads(types, '_Goal')
        anything = self.imports.take('typing', 'Any')
        parts = [anything, anything]
        if len(types) == 1:
            parts = [self.imports.message(f'{types[0]}_{part}') for part in ('Feedback', 'Result')]
        answer = f'{self.imports.support("Goal")}[{", ".join(parts)}]'
        rest = f' | None = None, {_TIMEOUT}'
        return self._method('send_goal', self._literal(name), goals, rest, answer)

    def _method(self, method: str, name: str, payload: str, rest: str, answer: str) -> str:
        word = 'async def' if method.endswith('_async') else 'def'
        if name == 'Never':
            never = self.imports.take('typing', 'Never')
            name, payload = never, f'{never} = ...'
        return (
            f'    {word} {method}(self, name: {name}, payload: {payload}{rest}) -> {answer}: ...'
        )

    def _payloads(self, types: Sequence[str], part: str = '') -> str:
        if '' in types:
            return self.imports.take('typing', 'Any')
        return ' | '.join(self.imports.payload(f'{each}{part}') for each in types)

    def _literal(self, name: str) -> str:
        if not name:
            return 'str'
        return _literal(self.imports, [name])
