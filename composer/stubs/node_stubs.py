"""The nodes of a system as classes, which know the names that each node declares."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from composer.records import record
from composer.stubs.field_types import StubImports, is_writable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.stubs.node_shapes import NodeShape

_TIMEOUT = 'timeout: float | None = 5.0'
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


def write_nodes(module: str, classes: Mapping[str, NodeShape]) -> Iterator[str]:
    """Yield the lines of a stub with nodes.

    Args:
        module: Its dotted name.
        classes: The shape of each node, by the name of its class; equal shapes are one class.
    """
    imports = StubImports(module)
    first: dict[NodeShape, str] = {}
    lines: list[str] = []
    for name, shape in classes.items():
        if shape in first:
            lines += ['', f'{name} = {first[shape]}']
        else:
            first[shape] = name
            lines += _Writer(name, imports).node(shape)
    yield from _SETTINGS
    yield from imports.lines()
    yield from lines


@record
class _Writer:
    """Writes the classes of one node."""

    name: str
    imports: StubImports

    def node(self, shape: NodeShape) -> Iterator[str]:
        yield from self._parameters(shape)
        yield from self._state(shape)
        yield from ('', f'class {self.name}({self.imports.take("composer", "Node")}):')
        yield from self._property('parameters', f'{self.name}Parameters')
        yield from self._property('state', f'{self.name}State')
        yield from self._property('logger', self.imports.support('Logger'))
        yield from self._overloaded(
            self._publish(name, types) for name, types in shape.publishers
        ) or [self._method('publish', 'Never', 'Never', '', 'None')]
        for method in ('call', 'call_async'):
            yield from self._overloaded(
                self._call(method, name, types) for name, types in shape.service_clients
            ) or [self._method(method, 'Never', 'Never', f', {_TIMEOUT}', 'None')]
        yield from self._overloaded(
            self._send_goal(name, types) for name, types in shape.action_clients
        ) or [self._method('send_goal', 'Never', 'Never', f', {_TIMEOUT}', 'None')]

    def _property(self, name: str, of_type: str) -> Iterator[str]:
        yield '    @property'
        yield f'    def {name}(self) -> {of_type}: ...'

    def _parameters(self, shape: NodeShape) -> Iterator[str]:
        anything = self.imports.take('typing', 'Any')
        mapping = self.imports.take('typing', 'Mapping')
        yield from ('', f'class {self.name}Parameters({mapping}[str, {anything}]):')
        types = {name: ' | '.join(map(self._value, each)) for name, each in shape.parameters}
        # A parameter may have the name of a type, which means the parameter in the class.
        for hidden in _OF_PYTHON & types.keys():
            alias = self.imports.take('builtins', hidden)
            types = {name: re.sub(rf'\b{hidden}\b', alias, each) for name, each in types.items()}
        for name, of_type in types.items():
            if is_writable(name) and name not in _OF_MAPPINGS and not name.startswith('__'):
                yield from self._property(name, of_type)
        yield f'    def __call__(self, prefix: str) -> dict[str, {anything}]: ...'
        yield from self._overloaded(
            f'    def __getitem__(self, name: {self._literal(name)}, /) -> {of_type}: ...'
            for name, of_type in types.items()
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
        yield from (f'    {each}: {anything}' for each in shape.state or () if is_writable(each))

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

    def _overloaded(self, methods: Iterable[str]) -> list[str]:
        several = list(methods)
        if len(several) <= 1:
            return several
        decorator = f'    @{self.imports.take("typing", "overload")}'
        return [line for method in several for line in (decorator, method)]

    def _payloads(self, types: Sequence[str], part: str = '') -> str:
        if '' in types:
            return self.imports.take('typing', 'Any')
        return ' | '.join(self.imports.payload(f'{each}{part}') for each in types)

    def _literal(self, name: str) -> str:
        if not name:
            return 'str'
        return f'{self.imports.take("typing", "Literal")}[{name!r}]'

    def _value(self, of_type: str) -> str:
        return self.imports.take('typing', 'Any') if of_type == 'Any' else of_type
