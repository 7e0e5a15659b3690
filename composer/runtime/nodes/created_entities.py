"""Entities that behaviours create while their node runs, made and guarded as declared ones.

They belong to their node: one that is created again starts without them, and edits leave them.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import KIND_OF_SECTION, TYPE_FOLDERS
from composer.errors import ComposerError, StartError
from composer.runtime.messages.qos_profiles import is_qos_profile, write_policies
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from composer.entity_kinds import EntityKind
    from composer.runtime.nodes.live_entity import LiveEntity

# The module under which a behaviour that is given as a function stands in a spec.
_CREATED = 'created'


class EntityError(ComposerError):
    """A behaviour asks for an entity that cannot be created."""


class CreatedEntity:
    """An entity that a behaviour has created; `node.destroy` removes it.

    Attributes:
        name: The name that `node.publish` and `node.call` know it by.
    """

    __slots__ = ('_entity', 'name', 'section')

    def __init__(self, section: str, name: str, entity: Any) -> None:
        self.section = section
        self.name = name
        self._entity = entity

    def is_of(self, entities: Mapping[str, Mapping[str, LiveEntity]]) -> bool:
        """Return whether it is still among the entities of its node."""
        return entities[self.section].get(self.name) is self._entity

    def remove(self) -> None:
        """Remove it from the node and the graph."""
        self._entity.destroy()


class CreatedPublisher(CreatedEntity):
    """A publisher that a behaviour has created."""

    __slots__ = ()

    def publish(self, payload: Any) -> None:
        """Publish a payload: see `Node.publish`."""
        self._entity.publish(payload)


class CreatedClient(CreatedEntity):
    """A service client that a behaviour has created."""

    __slots__ = ()

    def call(self, payload: Any = None, timeout: float | None = 5.0) -> Any:
        """Call the service: see `Node.call`."""
        client = self._entity
        return client.call({} if payload is None else payload, timeout)

    async def call_async(
        self,
        payload: Any = None,
        timeout: float | None = 5.0,  # noqa: ASYNC109 - as `Node.call_async`
    ) -> Any:
        """Call the service: see `Node.call_async`."""
        client = self._entity
        return await client.call_async({} if payload is None else payload, timeout)


class CreatedTimer(CreatedEntity):
    """A timer that a behaviour has created."""

    __slots__ = ()

    def cancel(self) -> None:
        """Stop it until it is reset."""
        self._entity.ros.cancel()

    def reset(self) -> None:
        """Begin a period now."""
        self._entity.ros.reset()


_HANDLES: dict[str, type[CreatedEntity]] = {
    'publishers': CreatedPublisher,
    'service_clients': CreatedClient,
    'timers': CreatedTimer,
}


class EntityCreation:
    """Creates and removes entities for the behaviours of one node.

    Attributes:
        node: The node, once there is one.
    """

    def __init__(self) -> None:
        # A `LiveNode`, which has this one.
        self.node: Any = None
        self._lock = threading.Lock()

    def create(
        self,
        section: str,
        data: dict[str, Any],
        default_name: str,
        behaviour: Callable[..., Any] | None = None,
    ) -> Any:
        """Create an entity as the file would declare it.

        Args:
            data: Its keys; `name` is the name that is asked for, or `None`.
            default_name: The name that it has otherwise, with a number if that is taken.
            behaviour: Its behaviour, if it has one.

        Raises:
            EntityError: Something is wrong with it, or the name is taken.
        """
        # Few nodes create entities, and the others start faster without it.
        from composer.schema.structure import find_problem

        node = self.node
        kind = KIND_OF_SECTION[section]
        asked = data.pop('name', None)
        data = {key: value for key, value in data.items() if value is not None}
        if 'type' in data and kind.channel:
            data['type'] = _name_of_type(data['type'], TYPE_FOLDERS[kind.channel])
        if is_qos_profile(data.get('qos')):
            data['qos'] = write_policies(data['qos'])
        if behaviour is not None:
            data['behaviour'] = behaviour
        given = {each.key: data[each.key] for each in kind.behaviours if each.key in data}
        for key, function in given.items():
            if not callable(function):
                message = f'a behaviour must be a function, not {function!r}'
                raise EntityError(message)
            data[key] = f'{_CREATED}:{key}'
        problem = find_problem({'nodes': {node.spec.name: {section: {'created': data}}}})
        if problem is not None:
            message = f'a {kind.noun} cannot be created: {problem}'
            raise EntityError(message)
        with self._lock:
            _check_publisher(node, kind, data.get('publish'))
            return self._make(node, section, data, (asked, default_name), given)

    def _make(
        self,
        node: Any,
        section: str,
        data: dict[str, Any],
        names: tuple[str | None, str],
        given: Mapping[str, Callable[..., Any]],
    ) -> CreatedEntity:
        from composer.language.parsing.entity_parser import parse_entity

        entities = node.entities[section]
        asked, default_name = names
        # Those that are declared may not be there yet.
        taken = {*entities, *getattr(node.spec, section)}
        if asked in taken:
            noun = KIND_OF_SECTION[section].noun
            message = f"node '{node.spec.name}' has a {noun} '{asked}' already"
            raise EntityError(message, help="give it another 'name'")
        numbered = (f'{default_name}_{number}' for number in count(2))
        name = asked or default_name
        while name in taken:
            name = next(numbered)
        for key, function in given.items():
            data[key] = f'{_created_name(section, name)}{key}'
            node.created[data[key]] = function
        path = (*node.spec.path, section, name)
        spec = parse_entity(section, node.options(), name, data, path)
        try:
            entity: Any = node.system.create_entity(node, section, spec)
        except StartError as error:
            raise EntityError(str(error), help=error.help) from error
        entities[name] = entity
        if section == 'timers' and node.gate.is_open and not node.gate.rests:
            entity.ros.reset()
        return _HANDLES.get(section, CreatedEntity)(section, name, entity)

    def is_active(self, section: str, name: str) -> bool:
        """Return whether a publisher or subscription is on the graph."""
        return hasattr(self.node.entities[section][name], 'ros')

    def activate(self, section: str, name: str, *, is_active: bool) -> None:
        """Have a declared publisher or subscription come to the graph, or leave it.

        Raises:
            EntityError: A library makes it, or it cannot be created.
        """
        node, spec = self.node, getattr(self.node.spec, section)[name]
        if spec.made_by:
            message = f"'{name}' is made by a library: whether it is there is for that to say"
            raise EntityError(message)
        with self._lock:
            if self.is_active(section, name) == is_active:
                return
            before = node.entities[section][name]
            try:
                created = node.system.create_entity(node, section, replace(spec, active=is_active))
            except StartError as error:
                raise EntityError(str(error), help=error.help) from error
            node.entities[section][name] = created
            before.destroy()

    def destroy(self, created: CreatedEntity) -> None:
        """Remove an entity; a second time does nothing."""
        node = self.node
        with self._lock:
            if not created.is_of(node.entities):
                return
            node.entities[created.section].pop(created.name)
            start = _created_name(created.section, created.name)
            for each in [each for each in node.created if each.startswith(start)]:
                del node.created[each]
        created.remove()
        node.forget(KIND_OF_SECTION[created.section].noun, created.name)


def _check_publisher(node: Any, kind: EntityKind, publisher: str | None) -> None:
    # Those that are declared may not be there yet.
    known = {*node.entities['publishers'], *node.spec.publishers}
    if publisher is not None and publisher not in known:
        message = (
            f"a {kind.noun} cannot publish: node '{node.spec.name}' has no publisher '{publisher}'"
        )
        advice = "declare it under 'publishers:', or create it first"
        raise EntityError(message, help=suggest(publisher, known, 'it has', advice))


def _created_name(section: str, name: str) -> str:
    """Return how the names of the functions of an entity begin."""
    return f'{_CREATED}:{section}/{name} '


def _name_of_type(of_type: Any, folder: str) -> Any:
    """Return the full name of an interface type that is given as its class."""
    if not isinstance(of_type, type):
        return of_type
    return f'{of_type.__module__.partition(".")[0]}/{folder}/{of_type.__name__}'
