"""Calls of the node: what is sent, and which names are used."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.entity_kinds import KIND_OF_NOUN
from composer.inference.current_run import name_place, span_of
from composer.inference.evaluation.library.known_values import Computation, NotKnownError
from composer.inference.evaluation.part import Part
from composer.inference.reading import (
    CREATING_METHODS,
    SENDING_METHODS,
    CreatedEntity,
    RemoteParameter,
)
from composer.inference.values import (
    BY_PARAMETER,
    BY_STATE,
    CHOSEN,
    NODE,
    NONE,
    UNKNOWN,
    Alternatives,
    Argument,
    Arguments,
    Awaitable,
    Constant,
    Generated,
    Instance,
    Mapping,
    Message,
    MessageClass,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Unknown,
    Value,
    alternatives,
    constant,
    is_chosen,
    is_none,
    join,
)
from composer.schema.structure import find_problem

if TYPE_CHECKING:
    from collections import abc

    from composer.entity_kinds import EntityKind
    from composer.inference.reading import Waited


class NodeCalls(Part):
    """Evaluates calls of the node."""

    def call(self, method: str, arguments: Arguments, *, waits: bool, is_awaited: bool) -> Value:
        """Return what a method of the node may return."""
        if method == 'sleep' and (length := arguments.get(0, 'seconds')):
            self._evaluator.sleeping.sleep(length, length.place)
            return UNKNOWN
        if method == 'now':
            return PartOfNode('time')
        if method in ('set_parameters', 'get_parameters'):
            return self._call_parameters(method, arguments)
        if method in CREATING_METHODS:
            return self._create(method, arguments)
        if method not in SENDING_METHODS:
            return UNKNOWN
        kind = SENDING_METHODS[method]
        section = KIND_OF_NOUN[kind].section
        name = arguments.get(0, 'name')
        payload = arguments.get(1, 'payload')
        if name is None:
            self._evaluator.run.reading.open_kinds.add(kind)
            return UNKNOWN
        waits_here = waits and (method != 'call_async' or is_awaited)
        results: list[Value] = []
        if payload is not None and isinstance(name.value, Alternatives):
            # Name and payload may have been chosen together.
            payload = Argument(join(alternatives(payload.value)), payload.place)
        self._evaluator.run.decide(name.value)
        # Of names by conditions that the file decides on, none is sure.
        is_sure = waits_here and method != 'publish' and self._evaluator.run.is_sure
        waited: Waited = 'answer' if is_sure else ''
        several = alternatives(name.value)
        among = tuple(str(each.value) for each in several if isinstance(each, Constant))
        if len(several) > 1 and (len(among) < len(several) or is_chosen(name.value)):
            waited = ''
        for each in several:
            if not isinstance(each, Constant) or not isinstance(each.value, str):
                self._evaluator.run.use_any(kind, each, name.place)
                results.append(UNKNOWN)
                continue
            # Of several names, conditions may leave out some, unless they are chosen right here.
            is_doubt = len(several) > 1 and not isinstance(name.place.node, ast.IfExp)
            with self._evaluator.run.condition(is_doubt=is_doubt):
                self._evaluator.run.use(
                    kind,
                    each.value,
                    name_place(name, each),
                    waits=waited,
                    among=among,
                    is_guess=is_chosen(each) in (BY_PARAMETER, BY_STATE),
                )
            type_name = self._type_of(section, each.value)
            result = self._send(method, type_name, payload, arguments)
            if isinstance(result, PartOfNode):
                result = PartOfNode(result.name, result.type, each.value)
            results.append(result)
        found = join(results)
        return Awaitable(found) if method == 'call_async' else found

    def _type_of(self, section: str, name: str) -> str | None:
        """Return the type of an entity that is declared, or that a behaviour creates."""
        facts = self._evaluator.run.facts
        declared = facts.type_of(section, name)
        if declared is not None or name in getattr(facts.node, section):
            return declared
        several = alternatives(facts.kept_value(f'{section}/{name}'))
        created = [each.type for each in several if isinstance(each, MessageClass)]
        return created[0] if len(created) == 1 else None

    def _create(self, method: str, arguments: Arguments) -> Value:
        """Note the entity that a call creates, and read its behaviour."""
        run = self._evaluator.run
        noun, position = CREATING_METHODS[method]
        kind = KIND_OF_NOUN[noun]
        of_type = arguments.get(0, 'msg_type') or arguments.get(0, 'srv_type')
        type_name = type_place = None
        if kind.channel and of_type is not None:
            type_name, type_place = _type_named(of_type.value), span_of(of_type.place)
        self._check_options(kind, arguments)
        channel = arguments.get(1, 'topic') or arguments.get(1, 'srv_name')
        if kind.channel and channel is not None:
            run.decide(channel.value)
            asked = dict(arguments.named).get('name', channel)
            names = _texts(asked.value)
            texts = _texts(channel.value)
            if is_chosen(channel.value):
                # A parameter may have another value than the file gives it.
                texts.append(None)
            for text in texts:
                for name in names if len(names) == 1 else [None]:
                    made = CreatedEntity(noun, name, text, type_name, type_place)
                    run.reading.created.append(made)
                    if name and type_name:
                        run.reading.kept[f'{kind.section}/{name}'] = MessageClass(type_name)
        behaviour = None if position is None else arguments.get(position, 'behaviour')
        if behaviour is not None:
            given: list[Value] = [NODE]
            if kind.channel:
                part = '_Request' if kind.channel == 'service' else ''
                given.append(Message(f'{type_name}{part}') if type_name else UNKNOWN)
            called = Arguments(tuple(Argument(each, behaviour.place) for each in given))
            with run.condition():
                answer = self._evaluator.calls.invoke(
                    behaviour.value, called, behaviour.place, waits=False
                )
            if kind.channel == 'service' and type_name:
                answer = join(getattr(each, 'result', each) for each in alternatives(answer))
                self._evaluator.payloads.check(f'{type_name}_Response', answer, behaviour.place)
            publish = dict(arguments.named).get('publish')
            if kind.publishes and publish is not None:
                self._publish_results(publish, answer, behaviour.place)
        for argument in arguments.all():
            if argument is not behaviour:
                self._evaluator.escape(argument.value)
        return UNKNOWN

    def _publish_results(self, publish: Argument, answer: Value, place: Place) -> None:
        """Note the publisher of what a behaviour returns, and check that against its type."""
        run = self._evaluator.run
        run.decide(publish.value)
        names = alternatives(publish.value)
        # Nothing is published for `None`.
        results = [
            join(each for each in alternatives(part) if not is_none(each))
            for part in _results_of(answer)
            if not all(map(is_none, alternatives(part)))
        ]
        for name in names:
            if not isinstance(name, Constant) or not isinstance(name.value, str):
                run.use_any('publisher', name, publish.place)
                continue
            is_guess = is_chosen(name) in (BY_PARAMETER, BY_STATE)
            with run.condition(is_doubt=len(names) > 1):
                at = name_place(publish, name)
                run.use('publisher', name.value, at, is_guess=is_guess)
                type_name = self._type_of('publishers', name.value)
                for result in results if type_name else ():
                    self._evaluator.payloads.check(type_name, result, place)

    def _check_options(self, kind: EntityKind, arguments: Arguments) -> None:
        """Check the keys that an entity is created with: they are those of the file."""
        for name, argument in arguments.named:
            if name in ('name', 'msg_type', 'srv_type', 'srv_name'):
                continue
            try:
                value = Computation(argument.place).python(argument.value)
            except NotKnownError:
                value = None
            entity = {**kind.stand_in, name: value}
            problem = find_problem({'nodes': {'node': {kind.section: {'created': entity}}}})
            if problem and (value is not None or problem.startswith('unknown key')):
                text = problem.replace("'created'", f"'{kind.noun}'")
                self._evaluator.run.report('bad-call', argument.place, text)

    def call_goal(self, owner: PartOfNode, method: str, place: Place, *, waits: bool) -> Value:
        """Return what a method of a goal may return."""
        if method == 'cancel':
            return Scalar(bool)
        run = self._evaluator.run
        if owner.entity and waits and run.is_sure:
            name = owner.entity
            run.use('action client', name, place, waits='end', among=(name,))
        result: Value = Message(f'{owner.type}_Result') if owner.type else UNKNOWN
        return Awaitable(result) if method == 'result_async' else result

    def _send(
        self, method: str, type_name: str | None, payload: Argument | None, arguments: Arguments
    ) -> Value:
        payloads = self._evaluator.payloads
        replies: dict[str, tuple[str, Value]] = {
            'publish': ('', NONE),
            'call': ('_Request', Message(f'{type_name}_Response')),
            'call_async': ('_Request', Message(f'{type_name}_Response')),
            'send_goal': ('_Goal', PartOfNode('goal', type_name or '')),
        }
        sent, result = replies[method]
        if type_name is None:
            return UNKNOWN if method != 'send_goal' else PartOfNode('goal')
        if payload is not None:
            is_left_out = is_none(payload.value) and method != 'publish'
            if not is_left_out:
                payloads.check(f'{type_name}{sent}', payload.value, payload.place)
        return result

    def _call_parameters(self, method: str, arguments: Arguments) -> Value:
        run = self._evaluator.run
        if method == 'get_parameters':
            run.reading.reads_others = True
            names = arguments.get(1, 'names')
            if names is not None and isinstance(names.value, Sequence):
                keys = [(name, place, UNKNOWN) for name, place in names.value.items]
                self._note_remote(arguments, keys)
                entries = {
                    name.value: (UNKNOWN, place)
                    for name, place, _ in keys
                    if isinstance(name, Constant)
                }
                return Mapping(
                    dict(entries), has_unknown=len(entries) < len(keys) or names.value.is_open
                )
            if names is not None and _kind_of(names.value) is str:
                run.report(
                    'bad-call',
                    names.place,
                    "'names' is a text, and has to be a list",
                    'put it in […]',
                )
            return UNKNOWN
        node_name, values = arguments.get(0, 'node_name'), arguments.get(1, 'values')
        if node_name is None or values is None:
            return NONE
        if isinstance(values.value, Sequence) or _kind_of(values.value):
            text = "'values' has to be a mapping of names to values"
            run.report('bad-call', values.place, text, 'write {name: value}')
        if isinstance(values.value, Constant | Scalar | Message | Sequence):
            run.report(
                'bad-call',
                values.place,
                'set_parameters takes the values as a dictionary',
                'write node.set_parameters(node_name, {name: value})',
            )
        if isinstance(values.value, Mapping):
            self._note_remote(
                arguments,
                [
                    (constant(key), place, value)
                    for key, (value, place) in values.value.entries.items()
                ],
            )
        return NONE

    def _note_remote(
        self, arguments: Arguments, several: abc.Sequence[tuple[Value, Place, Value]]
    ) -> None:
        """Note parameters of another node, if the code names both."""
        node_name = arguments.get(0, 'node_name')
        if node_name is not None:
            self._evaluator.run.decide(node_name.value)
        for target in alternatives(node_name.value) if node_name else ():
            if not isinstance(target, Constant) or not isinstance(target.value, str):
                continue
            at = span_of(name_place(node_name, target), target.value) if node_name else None
            for key, place, value in (
                (key, place, one) for key, place, held in several for one in alternatives(held)
            ):
                if isinstance(key, Constant) and isinstance(key.value, str) and at:
                    where = getattr(value, 'origin', None) or place
                    self._evaluator.run.reading.remote_parameters.append(
                        RemoteParameter(
                            target.value,
                            at,
                            key.value,
                            span_of(place, key.value),
                            value if isinstance(value, Constant) else None,
                            span_of(where),
                            is_certain=self._evaluator.run.is_certain,
                        )
                    )

    def call_own_state(self, name: str, arguments: Arguments) -> Value:
        """Note which keys are set; what is kept there is known only right after that."""
        reading = self._evaluator.run.reading
        key, value = arguments.get(0, ''), arguments.get(1, '')
        if name == 'update':
            reading.own_state_set |= {each for each, _ in arguments.named}
            for field, argument in arguments.named:
                self._evaluator.keep(f'[{field}]', argument.value)
            for argument in arguments.positional:
                if isinstance(argument.value, Mapping) and not argument.value.is_open:
                    reading.own_state_set |= {str(each) for each in argument.value.entries}
                    for key_of, (held, _) in argument.value.entries.items():
                        self._evaluator.keep(f'[{key_of}]', held)
                else:
                    reading.is_own_state_open = True
        elif key and name in ('get', 'setdefault', 'pop'):
            constants = [each for each in alternatives(key.value) if isinstance(each, Constant)]
            if name == 'pop' and value is None:
                for each in constants:
                    where = name_place(key, each)
                    self._evaluator.run.use_own_state(str(each.value), where)
            reading.own_state_set |= {str(each.value) for each in constants}
            reading.is_own_state_open |= not constants
        given = value.value if value else NONE
        found = alternatives(key.value) if key else ()
        keys = [str(each.value) for each in found if isinstance(each, Constant)]
        if name == 'setdefault':
            for name_of_key in keys:
                self._evaluator.keep(f'[{name_of_key}]', given)
        is_member = isinstance(given, Instance) and given.is_member
        if isinstance(given, Instance | Message) and not is_member:
            return given
        if name in ('get', 'pop', 'setdefault') and len(keys) == 1:
            held = self._evaluator.kept_value(f'[{keys[0]}]')
            if not isinstance(held, Unknown):
                return join([held, given]) if name != 'setdefault' else held
        self._evaluator.calls.escape_all(arguments)
        if name == 'setdefault' and isinstance(given, Sequence):
            # Of what is in it, other calls have a say.
            return Sequence([], given.kind, is_lost=True)
        return UNKNOWN

    def read_parameters(self, owner: PartOfNode, name: str, arguments: Arguments) -> Value:
        """Return what a method of `node.parameters` may return, or of what has changed of it."""
        run = self._evaluator.run
        asked = arguments.get(0, 'key')
        if name != 'get' or asked is None:
            run.reading.open_kinds.add('parameter')
            return UNKNOWN
        default = arguments.get(1, 'default')
        found: list[Value] = []
        for each in alternatives(asked.value):
            if isinstance(each, Constant) and isinstance(each.value, str):
                place = name_place(asked, each)
                run.use(
                    'parameter',
                    each.value,
                    place,
                    is_optional=True,
                    has_default=default is not None or owner.name == 'changes',
                    is_change=owner.name == 'changes',
                )
                value = run.facts.value_of_parameter(each.value)
                if value != UNKNOWN or run.reading.reaches_ros or owner.name == 'changes':
                    found.append(value)
                elif default is None:
                    found.append(constant(None, is_chosen=BY_PARAMETER))
                else:
                    found.append(CHOSEN)
            else:
                run.reading.open_kinds.add('parameter')
                found.append(UNKNOWN)
        return join(found)


def _type_named(value: Value) -> str | None:
    """Return the full name of the interface type that a value is, if that is known."""
    if isinstance(value, MessageClass):
        return value.type
    known = isinstance(value, Constant) and isinstance(value.value, str) and not value.is_chosen
    return value.value if known else None  # type: ignore[union-attr]


def _texts(value: Value) -> list[str | None]:
    """Return the texts that a value may be; `None` is any."""
    return [
        each.value if isinstance(each, Constant) and isinstance(each.value, str) else None
        for each in alternatives(value)
    ]


def _results_of(value: Value) -> tuple[Value, ...]:
    """Return what a call of a behaviour gives away in the end."""
    match value:
        case Awaitable():
            return (value.result,)
        case Generated():
            return (value.yielded, value.returned)
    return (value,)


def _kind_of(value: Value) -> type | None:
    return value.kind if isinstance(value, Constant | Scalar) else None
