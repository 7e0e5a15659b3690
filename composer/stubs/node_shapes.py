"""What the stub of a node needs to know: the names that the node declares, and their types."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from composer.inference.reading import CreatedEntity
    from composer.language.specs import NodeSpec, ParameterSpec

# The types of the entities of one section, by name. Behaviours create some whose name or type is
# not known: that is empty.
_Types: TypeAlias = 'tuple[tuple[str, tuple[str, ...]], ...]'

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
_ANYTHING = 'Any'


@record
class NodeShape:
    """What a node declares; equal ones need one stub.

    Attributes:
        publishers: The types of messages, by publisher.
        service_clients: The types of services, by client.
        action_clients: The types of actions, by client.
        parameters: The Python types of values, by parameter.
        state: The names that `node.state` has; `None` if it may have any.
    """

    publishers: _Types
    service_clients: _Types
    action_clients: _Types
    parameters: _Types
    state: tuple[str, ...] | None


def shape_of(
    node: NodeSpec,
    stored: Sequence[frozenset[str] | None],
    created: Sequence[CreatedEntity],
) -> NodeShape:
    """Return the shape of a node.

    Args:
        stored: The names that each module of its behaviours may set in `node.state`; `None` for
            one that may set any.
        created: What its behaviours create.
    """
    parameters = {name: (_type_of(each),) for name, each in node.parameters.items()}
    own = {name: (of_type,) for name, of_type in _OWN_PARAMETERS.items()}
    return NodeShape(
        _types(node.publishers, created, 'publisher'),
        _types(node.service_clients, created, 'service client'),
        _types(node.action_clients),
        tuple(sorted({**own, **parameters}.items())),
        None if None in stored else tuple(sorted({*node.state, *_all_of(stored)})),
    )


def _all_of(stored: Iterable[Iterable[str] | None]) -> Iterator[str]:
    return (name for names in stored for name in names or ())


def merge_shapes(shapes: Iterable[NodeShape]) -> NodeShape:
    """Return the shape that has what any of these has.

    A behaviour of several nodes may use what only some of them declare.
    """
    several = list(dict.fromkeys(shapes))
    if len(several) == 1:
        return several[0]
    states = [shape.state for shape in several]
    return NodeShape(
        _merged(shape.publishers for shape in several),
        _merged(shape.service_clients for shape in several),
        _merged(shape.action_clients for shape in several),
        _merged(shape.parameters for shape in several),
        None if None in states else tuple(sorted({*_all_of(states)})),
    )


def _merged(sections: Iterable[_Types]) -> _Types:
    merged: dict[str, dict[str, None]] = {}
    for section in sections:
        for name, types in section:
            merged.setdefault(name, {}).update(dict.fromkeys(types))
    # The first overload that fits counts, so the one for any name comes last.
    names = sorted(merged, key=lambda name: (not name, name))
    return tuple((name, tuple(merged[name])) for name in names)


def _types(
    entities: Mapping[str, Any], created: Iterable[CreatedEntity] = (), kind: str = ''
) -> _Types:
    declared = [(name, (each.type,)) for name, each in entities.items()]
    made = [(each.name or '', (each.type or '',)) for each in created if each.kind == kind]
    return _merged([(*declared, *made)])


def _type_of(parameter: ParameterSpec) -> str:
    """Return the Python type of a parameter's value.

    One that is not set has the value `None`, until somebody sets it.
    """
    if parameter.value is None or parameter.type is None:
        return _ANYTHING
    return _PARAMETER_TYPES.get(parameter.type, _ANYTHING)
