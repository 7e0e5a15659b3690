"""The nodes of a system as classes, which know the names that each node declares."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, TypeAlias

from composer.records import record
from composer.stubs.message_stubs import StubImports, is_writable
from composer.stubs.stored_types import ANYTHING, types_of_state

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.language.specs import NodeSpec, ParameterSpec
    from composer.node_uses.reading import CreatedEntity
    from composer.stubs.stored_types import StoredTypes

# The types of the entities of one section, by name. Behaviours create some whose name or type is
# not known: that is empty.
Types: TypeAlias = 'tuple[tuple[str, tuple[str, ...]], ...]'

_PARAMETER_TYPES = {
    'bool': 'bool',
    'integer': 'int',
    'double': 'float',
    'string': 'str',
    'byte_array': 'list[bytes]',
    'bool_array': 'list[bool]',
    'integer_array': 'list[int]',
    'double_array': 'list[float]',
    'string_array': 'list[str]',
}
# The parameters that rclpy declares for every node.
_OWN_PARAMETERS = {'use_sim_time': 'bool', 'start_type_description_service': 'bool'}
# Of the full name of a type: `std_msgs/msg/String`.
_SLASHES = 2
# The types of choices that a type can name.
_NAMED = (bool, int, str)


@record
class NodeShape:
    """What a node declares; equal ones need one stub.

    Parameters and state have types of Python. `state` is `None` if it may have any name.
    """

    publishers: Types
    service_clients: Types
    action_clients: Types
    parameters: Types
    state: Types | None


def shape_of(
    node: NodeSpec,
    stored: Sequence[StoredTypes],
    created: Sequence[CreatedEntity],
) -> NodeShape:
    """Return the shape of a node.

    Args:
        stored: What each module of its behaviours stores.
        created: What its behaviours create.
    """
    known = [names for names in stored if names is not None]
    parameters = {name: type_of_parameter(each) for name, each in node.parameters.items()}
    names = sorted({*node.state}.union(*known))
    values = {name: [node.state[name]] if name in node.state else [] for name in names}
    state = ((name, types_of_state(values[name], known, name)) for name in names)
    return NodeShape(
        _types(node.publishers, created, 'publisher'),
        _types(node.service_clients, created, 'service client'),
        _types(node.action_clients),
        tuple((name, (each,)) for name, each in sorted({**_OWN_PARAMETERS, **parameters}.items())),
        tuple(state) if len(known) == len(stored) else None,
    )


def merge_shapes(shapes: Iterable[NodeShape]) -> NodeShape:
    """Return the shape that has what any of these has.

    A behaviour of several nodes may use what only some of them declare.
    """
    several = list(dict.fromkeys(shapes))
    if len(several) == 1:
        return several[0]
    states = [shape.state for shape in several if shape.state is not None]
    return NodeShape(
        _merged(shape.publishers for shape in several),
        _merged(shape.service_clients for shape in several),
        _merged(shape.action_clients for shape in several),
        _merged(shape.parameters for shape in several),
        _merged(states) if len(states) == len(several) else None,
    )


def _merged(sections: Iterable[Types]) -> Types:
    merged: dict[str, dict[str, None]] = {}
    for section in sections:
        for name, types in section:
            merged.setdefault(name, {}).update(dict.fromkeys(types))
    # The first overload that fits counts, so the one for any name comes last.
    names = sorted(merged, key=lambda name: (not name, name))
    return tuple((name, tuple(merged[name])) for name in names)


def _types(
    entities: Mapping[str, Any], created: Iterable[CreatedEntity] = (), kind: str = ''
) -> Types:
    declared = [(name, (each.type,)) for name, each in entities.items()]
    made = [(each.name or '', (_full_name(each),)) for each in created if each.kind == kind]
    return _merged([(*declared, *made)])


def _full_name(created: CreatedEntity) -> str:
    """Return the type of what a behaviour creates; empty if what it gives is none."""
    return created.type if created.type and created.type.count('/') == _SLASHES else ''


def type_of_parameter(parameter: ParameterSpec) -> str:
    """Return the Python type of a parameter's value.

    One that is not set has the value `None`, until somebody sets it.
    """
    of_type = _PARAMETER_TYPES.get(parameter.type or '', ANYTHING)
    choices = parameter.choices or ()
    if of_type in ('int', 'str') and choices and all(type(each) in _NAMED for each in choices):
        of_type = f'Literal[{", ".join(map(repr, choices))}]'
    return f'{of_type} | None' if parameter.value is None and of_type != ANYTHING else of_type


# Of the methods that send something: the section of what they use, the part of its type that they
# send, and the parts that answer.
SENDING = {
    'publish': ('publishers', '', ()),
    'call': ('service_clients', '_Request', ('_Response',)),
    'call_async': ('service_clients', '_Request', ('_Response',)),
    'send_goal': ('action_clients', '_Goal', ('_Feedback', '_Result')),
}
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
    """Yield the lines of a stub with nodes; those of equal shapes are one class."""
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


def _overloaded(imports: StubImports, methods: Iterable[str]) -> list[str]:
    several = list(methods)
    if len(several) <= 1:
        return several
    decorator = f'    @{imports.take("typing", "overload")}'
    return [line for method in several for line in (decorator, method)]


def named(imports: StubImports, of_type: str) -> str:
    """Return a type with the names by which a stub knows its classes."""
    for name in ('Any', 'Literal'):
        if of_type.startswith(name):
            return imports.take('typing', name) + of_type.removeprefix(name)
    if ':' in of_type:
        return imports.of(*of_type.split(':'))
    return imports.message(of_type) if '/' in of_type else of_type


@record
class _Writer:
    """Writes the classes of one node."""

    name: str
    imports: StubImports

    def node(self, shape: NodeShape) -> Iterator[str]:
        yield from self._parameters(shape)
        yield from self._state(shape)
        yield from ('', f'class {self.name}({self.imports.take("composer", "Node")}):')
        # Type checkers narrow what is final, as by `is not None`, and no property.
        final = self.imports.take('typing', 'Final')
        yield f'    parameters: {final}[{self.name}Parameters]'
        yield f'    state: {final}[{self.name}State]'
        yield '    @property'
        yield f'    def logger(self) -> {self.imports.support("Logger")}: ...'
        for method, (section, _, _) in SENDING.items():
            senders = [self._sender(method, *entity) for entity in getattr(shape, section)]
            if not senders:
                never = self.imports.take('typing', 'Never')
                senders = [self._method(method, never, f'{never} = ...', 'None')]
            yield from _overloaded(self.imports, senders)

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
        several = [named(self.imports, each) for each in types]
        return self.imports.take('typing', 'Any') if 'Any' in types else ' | '.join(several)

    def _sender(self, method: str, name: str, types: Sequence[str]) -> str:
        """Return a method that sends something, as it is for one name."""
        _, sent, answered = SENDING[method]
        anything = self.imports.take('typing', 'Any')
        is_known = '' not in types
        payloads = [self.imports.payload(f'{each}{sent}') for each in types if is_known]
        payload = ' | '.join(payloads) or anything
        answers = [anything for _ in answered]
        if len(types) == 1 and is_known:
            answers = [self.imports.message(f'{types[0]}{part}') for part in answered]
        answer = ', '.join(answers) or 'None'
        if method == 'send_goal':
            answer = f'{self.imports.support("Goal")}[{answer}]'
        payload += '' if method == 'publish' else ' | None = None'
        return self._method(method, self._literal(name), payload, answer)

    def _method(self, method: str, name: str, payload: str, answer: str) -> str:
        word = 'async def' if method.endswith('_async') else 'def'
        end = '' if method == 'publish' else ', timeout: float | None = 5.0'
        return f'    {word} {method}(self, name: {name}, payload: {payload}{end}) -> {answer}: ...'

    def _literal(self, name: str) -> str:
        if not name:
            return 'str'
        return f'{self.imports.take("typing", "Literal")}[{name!r}]'
