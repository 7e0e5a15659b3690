"""Calls: of the node, of messages' classes, of functions of the project, of Python's own."""

from __future__ import annotations

import ast
from collections import abc
from typing import TYPE_CHECKING

from composer.inference.known_functions import KNOWN_RESULTS
from composer.inference.message_types import in_python
from composer.inference.reading import RemoteParameter
from composer.inference.run import name_place, span_of
from composer.inference.signatures import explain_misfit, signature_of
from composer.inference.values import (
    CHOSEN,
    NODE,
    NONE,
    UNKNOWN,
    Alternatives,
    Argument,
    Arguments,
    Awaitable,
    BoundMethod,
    Class,
    Constant,
    External,
    Function,
    Generated,
    Instance,
    Mapping,
    Message,
    MessageClass,
    Partial,
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
from composer.interfaces.field_errors import unknown_field

if TYPE_CHECKING:
    from collections.abc import Callable

    from composer.inference.evaluator import Evaluator
    from composer.inference.scopes import Scope

_SECTIONS = {
    'publish': ('publishers', 'publisher'),
    'call': ('service_clients', 'service client'),
    'call_async': ('service_clients', 'service client'),
    'send_goal': ('action_clients', 'action client'),
}
_LONGEST_RANGE = 256
_TEXT_METHODS = frozenset(
    {
        'capitalize',
        'format',
        'join',
        'lower',
        'lstrip',
        'replace',
        'rstrip',
        'strip',
        'title',
        'upper',
    }
)


class Calls:
    """Evaluates calls.

    Args:
        evaluator: Evaluates what is in them, and knows the run.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator

    def call(self, node: ast.Call, scope: Scope, *, is_awaited: bool = False) -> Value:
        """Return what a call may return."""
        function = self._evaluator.evaluate(node.func, scope)
        arguments = self._arguments(node, scope)
        place = Place(scope.module, node)
        if function == External('builtins.super') or function == External('builtins.locals'):
            return UNKNOWN
        method = node.func.attr if isinstance(node.func, ast.Attribute) else ''
        if isinstance(function, Unknown) and method in _SECTIONS:
            # It may be the node, in another guise.
            name = arguments.get(0, 'name')
            if name is None or not isinstance(name.value, Constant):
                self._evaluator.run.reading.open_kinds.add(_SECTIONS[method][1])
        self._evaluator.call_places.append(place)
        try:
            return join(
                self.invoke(each, arguments, place, waits=scope.waits, is_awaited=is_awaited)
                for each in alternatives(function)
            )
        finally:
            self._evaluator.call_places.pop()

    def _arguments(self, node: ast.Call, scope: Scope) -> Arguments:
        positional: list[Argument] = []
        named: list[tuple[str, Argument]] = []
        is_open = False
        for each in node.args:
            place = Place(scope.module, each)
            if isinstance(each, ast.Starred):
                value = self._evaluator.evaluate(each.value, scope)
                if isinstance(value, Sequence) and not value.is_lost and not value.is_open:
                    positional += [Argument(*item) for item in value.items]
                else:
                    is_open = True
                    self._evaluator.escape(value)
            else:
                positional.append(Argument(self._evaluator.evaluate(each, scope), place))
        for keyword in node.keywords:
            value = self._evaluator.evaluate(keyword.value, scope)
            if keyword.arg is not None:
                place = Place(scope.module, keyword)
                named.append((keyword.arg, Argument(value, place)))
            elif isinstance(value, Mapping) and not value.is_lost:
                is_open = is_open or value.is_open
                named += [
                    (key, Argument(*held))
                    for key, held in value.entries.items()
                    if isinstance(key, str)
                ]
            else:
                is_open = True
                self._evaluator.escape(value)
        return Arguments(tuple(positional), tuple(named), is_open)

    def invoke(
        self,
        function: Value,
        arguments: Arguments,
        place: Place,
        *,
        waits: bool = True,
        is_awaited: bool = False,
    ) -> Value:
        """Return what a call of a value may return.

        Args:
            waits: Whether who calls the behaviour waits for the call.
            is_awaited: Whether its result is awaited at once.
        """
        match function:
            case BoundMethod(owner=owner, name=name) if owner == NODE:
                if not self._fits('node', name, arguments, place):
                    return UNKNOWN
                return self._call_node(name, arguments, waits=waits, is_awaited=is_awaited)
            case BoundMethod():
                if isinstance(function.owner, PartOfNode):
                    self._fits(function.owner.name, function.name, arguments, place)
                return self._call_method(function, arguments, place)
            case MessageClass():
                return self._construct(function, arguments)
            case Function():
                is_late = self._evaluator.is_coroutine(function) and not is_awaited
                return self._evaluator.follow(function, arguments, waits=waits and not is_late)
            case Partial():
                merged = Arguments(
                    (*function.arguments.positional, *arguments.positional),
                    (*function.arguments.named, *arguments.named),
                    function.arguments.is_open or arguments.is_open,
                )
                return self.invoke(
                    function.function, merged, place, waits=waits, is_awaited=is_awaited
                )
            case Class():
                return self._evaluator.instantiate(function, arguments)
            case Instance():
                method = self._evaluator.class_attribute(function.of, '__call__', function)
                if isinstance(method, Function):
                    return self._evaluator.follow(method, arguments, waits=waits)
            case External():
                return self._call_library(function.name, arguments, place)
            case Message() | Constant() | Scalar() | Generated() | Mapping() | PartOfNode():
                self._refuse(function, place)
        self.escape_all(arguments)
        return CHOSEN if is_chosen(function) or _are_chosen(arguments) else UNKNOWN

    def _refuse(self, function: Value, place: Place) -> None:
        """Report a call of what cannot be called; `None` may be something else later."""
        if is_none(function) or getattr(function, 'is_lost', False):
            return
        called = place.node.func if isinstance(place.node, ast.Call) else place.node
        text = 'this cannot be called'
        self._evaluator.run.report('bad-call', Place(place.module, called), text)

    def _fits(self, owner: str, name: str, arguments: Arguments, place: Place) -> bool:
        """Return whether a method can be called so; report it if not."""
        signature = signature_of(owner, name)
        misfit = explain_misfit(signature, arguments) if signature else None
        if misfit is None:
            return True
        shown = str(signature)
        self._evaluator.run.report(
            'bad-call', place, f'{name}{shown} is called with other arguments: {misfit}'
        )
        return False

    def invoke_later(self, partial: Partial) -> None:
        """Note that something unknown may call a function with these arguments and others."""
        given = partial.arguments
        arguments = Arguments(given.positional, given.named, is_open=True)
        function = partial.function
        if (isinstance(function, Function) and given.positional) or (
            function == BoundMethod(NODE, 'publish') and given.positional
        ):
            with self._evaluator.run.condition():
                self.invoke(function, arguments, given.positional[0].place, waits=False)
        else:
            self._evaluator.escape(function)
            self.escape_all(given)

    def escape_all(self, arguments: Arguments) -> None:
        """Note that something unknown has the arguments."""
        for argument in arguments.all():
            self._evaluator.escape(argument.value)

    # The node

    def _call_node(
        self, method: str, arguments: Arguments, *, waits: bool, is_awaited: bool
    ) -> Value:
        if method == 'now':
            return PartOfNode('time')
        if method in ('set_parameters', 'get_parameters'):
            return self._call_parameters(method, arguments)
        if method not in _SECTIONS:
            return UNKNOWN
        section, kind = _SECTIONS[method]
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
        for each in alternatives(name.value):
            if not isinstance(each, Constant) or not isinstance(each.value, str):
                self._evaluator.run.reading.open_kinds.add(kind)
                results.append(UNKNOWN)
                continue
            waited = waits_here and method in ('call', 'call_async')
            self._evaluator.run.use(kind, each.value, name_place(name, each), waits=waited)
            type_name = self._evaluator.run.facts.type_of(section, each.value)
            results.append(self._send(method, type_name, payload, arguments))
        result = join(results)
        return Awaitable(result) if method == 'call_async' else result

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
            return UNKNOWN
        node_name, values = arguments.get(0, 'node_name'), arguments.get(1, 'values')
        if node_name is None or values is None:
            return NONE
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
                            is_certain=not self._evaluator.run.doubts,
                        )
                    )

    # Messages

    def _construct(self, function: MessageClass, arguments: Arguments) -> Value:
        """Check the fields that a message is made with."""
        evaluator = self._evaluator
        description = evaluator.run.types.describe(function.type)
        made = Message(function.type, is_made=True)
        if description is None:
            self.escape_all(arguments)
            return made
        shown = in_python(function.type)
        if arguments.positional:
            evaluator.run.report(
                'bad-call',
                arguments.positional[0].place,
                f'{shown} takes its fields by name only',
                'write the name of the field before the value: name=value',
            )
        for name, argument in arguments.named:
            field = description.field(name)
            if field is not None:
                evaluator.payloads.check_field(
                    function.type, field, argument.value, argument.place
                )
            elif name != 'check_fields':
                names = [each.name for each in description.fields]
                error = unknown_field(function.type, name, names)
                message = str(error).replace(function.type, shown)
                evaluator.run.report('unknown-field', argument.place, message, error.help)
        return made

    # Dictionaries, lists and texts

    def _call_method(self, method: BoundMethod, arguments: Arguments, place: Place) -> Value:
        owner, name = method.owner, method.name
        first = arguments.get(0, '')
        match owner:
            case PartOfNode(name='parameters' | 'changes'):
                return self._read_parameters(owner, name, arguments)
            case PartOfNode(name='own_state'):
                return self._call_own_state(name, arguments)
            case PartOfNode(name='time') if name == 'to_msg':
                return Message('builtin_interfaces/msg/Time')
            case PartOfNode(name='goal') if name in ('result', 'result_async'):
                result: Value = Message(f'{owner.type}_Result') if owner.type else UNKNOWN
                return Awaitable(result) if name == 'result_async' else result
            case PartOfNode(name='logger') if name == 'get_child':
                return owner
            case Mapping():
                return self._call_mapping(owner, name, arguments, place)
            case Sequence():
                return self._call_sequence(owner, name, arguments)
            case Constant() | Scalar() if owner.kind is str:
                self.escape_all(arguments)
                if name in _TEXT_METHODS:
                    return Scalar(str, is_chosen(owner))
                if name in ('split', 'rsplit', 'splitlines'):
                    return Sequence([(Scalar(str), place)], list, is_open=True, origin=place)
                return Scalar(bytes) if name == 'encode' else UNKNOWN
        if name == 'get_fields_and_field_types' and isinstance(owner, Message | MessageClass):
            return self._fields_of(owner, place)
        if first is not None:
            self.escape_all(arguments)
        return CHOSEN if is_chosen(owner) or _are_chosen(arguments) else UNKNOWN

    def _fields_of(self, owner: Message | MessageClass, place: Place) -> Value:
        description = self._evaluator.run.types.describe(owner.type)
        if description is None:
            return UNKNOWN
        entries: dict[object, tuple[Value, Place]] = {
            field.name: (Scalar(str), place) for field in description.fields
        }
        return Mapping(entries)

    def _call_own_state(self, name: str, arguments: Arguments) -> Value:
        """Note which keys are set; what is kept there is known only right after that."""
        reading = self._evaluator.run.reading
        key, value = arguments.get(0, ''), arguments.get(1, '')
        if name == 'update':
            reading.own_state_set |= {each for each, _ in arguments.named}
            for argument in arguments.positional:
                if isinstance(argument.value, Mapping) and not argument.value.is_open:
                    reading.own_state_set |= {str(each) for each in argument.value.entries}
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
        kept = value.value if value else UNKNOWN
        found = alternatives(key.value) if key else ()
        keys = [str(each.value) for each in found if isinstance(each, Constant)]
        if isinstance(kept, Instance):
            for name_of_key in keys:
                self._evaluator.keep(f'[{name_of_key}]', kept)
        if isinstance(kept, Instance | Message):
            return kept
        if name in ('get', 'setdefault') and len(keys) == 1:
            held = self._evaluator.kept.get(f'[{keys[0]}]')
            if held is not None:
                return held
        self.escape_all(arguments)
        return UNKNOWN

    def _read_parameters(self, owner: PartOfNode, name: str, arguments: Arguments) -> Value:
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
                    found.append(constant(None, is_chosen=True))
                else:
                    found.append(CHOSEN)
            else:
                run.reading.open_kinds.add('parameter')
                found.append(UNKNOWN)
        return join(found)

    def _call_mapping(
        self, owner: Mapping, name: str, arguments: Arguments, place: Place
    ) -> Value:
        first, second = arguments.get(0, ''), arguments.get(1, '')
        if owner.is_lost:
            self.escape_all(arguments)
            return UNKNOWN
        match name:
            case 'update':
                for argument in arguments.positional:
                    self.update_mapping(owner, argument.value, argument.place)
                for field, argument in arguments.named:
                    self._set(owner, field, argument.value, argument.place)
                owner.is_open |= arguments.is_open
                return NONE
            case 'setdefault' if first and second:
                key = first.value
                held = owner.entries.get(key.value) if isinstance(key, Constant) else None
                if held is None:
                    self.store_item(owner, first.value, second.value, first.place)
                    return second.value
                return join([held[0], second.value])
            case 'get' | 'pop' if first:
                key = first.value
                found = owner.entries.get(key.value) if isinstance(key, Constant) else None
                if name == 'pop':
                    self._evaluator.escape(owner)
                if found:
                    return found[0] if not second else join([found[0], second.value])
                if isinstance(key, Constant) and not owner.is_open:
                    return second.value if second else NONE
                values = [value for value, _ in owner.entries.values()]
                return join([*values, *([second.value] if second else [])] or [UNKNOWN])
            case 'copy':
                return Mapping(dict(owner.entries), owner.is_open, self._evaluator.run.conditions)
            case 'items':
                keys: list[Value] = [constant(key) for key in owner.entries if _is_simple(key)]
                values = [value for value, _ in owner.entries.values()]
                if owner.is_open or not keys:
                    return UNKNOWN
                pair = Sequence([(join(keys), place), (join(values), place)], tuple)
                return Generated(pair, NONE)
            case 'keys':
                keys = [constant(key) for key in owner.entries if _is_simple(key)]
                return Generated(UNKNOWN if owner.is_open else join(keys), NONE)
            case 'values':
                values = [value for value, _ in owner.entries.values()]
                return Generated(UNKNOWN if owner.is_open else join(values), NONE)
        self._evaluator.escape(owner)
        self.escape_all(arguments)
        return UNKNOWN

    def update_mapping(self, owner: Mapping, value: Value, place: Place) -> None:
        """Add the entries of another mapping."""
        if isinstance(value, Mapping) and not value.is_lost:
            for key, (held, where) in value.entries.items():
                self._set(owner, key, held, where)
            owner.is_open |= value.is_open
        else:
            del place
            self._evaluator.escape(value)
            owner.is_open = True

    def _set(self, owner: Mapping, key: object, value: Value, place: Place) -> None:
        owner.set(key, value, place, self._evaluator.run.conditions)

    def store_item(self, owner: Value, index: Value, value: Value, place: Place) -> None:
        """Store `owner[index] = value`."""
        for each in alternatives(owner):
            match each:
                case Mapping():
                    if isinstance(index, Constant):
                        self._set(each, index.value, value, place)
                    else:
                        each.is_open = True
                        self._evaluator.escape(value)
                case Sequence():
                    each.items.append((value, place))
                    each.is_open = True
                case PartOfNode(name='parameters'):
                    self._evaluator.attributes.store_item(index, place)
                case PartOfNode(name='own_state'):
                    keys = [key for key in alternatives(index) if isinstance(key, Constant)]
                    reading = self._evaluator.run.reading
                    reading.own_state_set |= {str(key.value) for key in keys}
                    reading.is_own_state_open |= not keys
                    for key in keys:
                        self._evaluator.keep(f'[{key.value}]', value)
                case _:
                    self._evaluator.escape(value)

    def _call_sequence(self, owner: Sequence, name: str, arguments: Arguments) -> Value:
        first = arguments.get(0, '')
        is_certain = not self._evaluator.run.conditions
        if first and name in ('append', 'add'):
            owner.items.append((first.value, first.place))
            owner.is_open |= not is_certain
            return NONE
        if first and name == 'extend':
            self.extend(owner, first.value, first.place)
            return NONE
        if name in ('count', 'index'):
            return Scalar(int)
        if name == 'copy':
            return Sequence(list(owner.items), owner.kind, owner.is_open, owner.is_lost)
        self._evaluator.escape(owner)
        self.escape_all(arguments)
        return UNKNOWN

    def extend(self, owner: Sequence, value: Value, place: Place) -> None:
        """Add the items of another sequence."""
        if isinstance(value, Sequence) and not value.is_lost:
            owner.items += value.items
            owner.is_open |= value.is_open or bool(self._evaluator.run.conditions)
        else:
            owner.items.append((self._evaluator.item_of(value), place))
            owner.is_open = True

    # Python's own functions, and those of libraries

    def _call_library(self, name: str, arguments: Arguments, place: Place) -> Value:
        method: Callable[[Arguments, Place], Value] | None
        method = getattr(self, f'_call_{name.replace(".", "_")}', None)
        if method is not None:
            return method(arguments, place)
        if name in KNOWN_RESULTS:
            if not name.startswith('builtins.is'):
                self._escape_functions(arguments)
            result = KNOWN_RESULTS[name]
            if isinstance(result, Scalar) and _are_chosen(arguments):
                return Scalar(result.kind, is_chosen=True)
            return result
        self.escape_all(arguments)
        return CHOSEN if _are_chosen(arguments) else UNKNOWN

    def _escape_functions(self, arguments: Arguments) -> None:
        """Follow functions that are called back; nothing else is kept or changed."""
        for argument in arguments.all():
            if isinstance(argument.value, Function | Partial | BoundMethod):
                self._evaluator.escape(argument.value)

    def _call_builtins_getattr(self, arguments: Arguments, place: Place) -> Value:
        owner, name = arguments.get(0, ''), arguments.get(1, '')
        if owner is None or name is None:
            return UNKNOWN
        has_default = len(arguments.positional) > 2  # noqa: PLR2004
        found: list[Value] = []
        for each in alternatives(name.value):
            if not isinstance(each, Constant) or not isinstance(each.value, str):
                self._evaluator.escape(owner.value)
                return UNKNOWN
            with self._evaluator.run.guard(is_guard=has_default):
                where = name_place(name, each)
                found.append(self._evaluator.attributes.read(owner.value, each.value, where))
        del place
        return UNKNOWN if has_default else join(found)

    def _call_builtins_setattr(self, arguments: Arguments, place: Place) -> Value:
        owner, name, value = (arguments.get(index, '') for index in range(3))
        if owner is None or name is None or value is None:
            return NONE
        if isinstance(name.value, Constant) and isinstance(name.value.value, str):
            where = name_place(name, name.value)
            self._evaluator.attributes.store(owner.value, name.value.value, value.value, where)
        elif owner.value == PartOfNode('state'):
            self._evaluator.run.reading.is_state_open = True
        del place
        return NONE

    def _call_builtins_hasattr(self, arguments: Arguments, place: Place) -> Value:
        owner, name = arguments.get(0, ''), arguments.get(1, '')
        del place
        if owner is None or name is None or not isinstance(name.value, Constant):
            return Scalar(bool)
        if owner.value == PartOfNode('state'):
            self._evaluator.run.reading.state_tested.add(str(name.value.value))
        if isinstance(owner.value, Message):
            description = self._evaluator.run.types.describe(owner.value.type)
            if description is not None and not str(name.value.value).startswith('_'):
                has = description.field(str(name.value.value)) is not None
                return constant(has) if has or not str(name.value.value).isupper() else UNKNOWN
        return Scalar(bool)

    def _call_builtins_isinstance(self, arguments: Arguments, place: Place) -> Value:
        value, classes = arguments.get(0, ''), arguments.get(1, '')
        del place
        if value is None or classes is None:
            return Scalar(bool)
        wanted = classes.value
        several = [item for item, _ in wanted.items] if isinstance(wanted, Sequence) else [wanted]
        answers = {_is_instance(value.value, each) for each in several}
        if True in answers:
            return constant(value=True)
        return Scalar(bool) if None in answers else constant(value=False)

    def _call_builtins_vars(self, arguments: Arguments, place: Place) -> Value:
        self.escape_all(arguments)
        del place
        return UNKNOWN

    def _call_builtins_dict(self, arguments: Arguments, place: Place) -> Value:
        made = Mapping({}, arguments.is_open, self._evaluator.run.conditions)
        for argument in arguments.positional:
            self.update_mapping(made, argument.value, argument.place)
        for name, argument in arguments.named:
            self._set(made, name, argument.value, argument.place)
        del place
        return made

    def _call_builtins_list(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        if first is None:
            return Sequence([], list)
        if isinstance(first.value, Sequence):
            given = first.value
            return Sequence(list(given.items), list, given.is_open, given.is_lost)
        return Sequence([(self._evaluator.item_of(first.value), place)], list, is_open=True)

    _call_builtins_tuple = _call_builtins_list

    def _call_builtins_sorted(self, arguments: Arguments, place: Place) -> Value:
        self._call_key(arguments, place)
        return self._call_builtins_list(Arguments(arguments.positional[:1]), place)

    def _call_key(self, arguments: Arguments, place: Place) -> None:
        """Follow the function `key` of `sorted`, `min` and `max`."""
        key, first = dict(arguments.named).get('key'), arguments.get(0, '')
        if key is not None and first is not None:
            item = Argument(self._evaluator.item_of(first.value), first.place)
            self.invoke(key.value, Arguments((item,)), place, waits=False)

    def _call_builtins_map(self, arguments: Arguments, place: Place) -> Value:
        function, *iterated = arguments.positional
        items = tuple(
            Argument(self._evaluator.item_of(each.value), each.place) for each in iterated
        )
        with self._evaluator.run.condition():
            result = self.invoke(function.value, Arguments(items), place, waits=False)
        return Generated(result, NONE)

    def _call_builtins_filter(self, arguments: Arguments, place: Place) -> Value:
        if len(arguments.positional) != 2:  # noqa: PLR2004
            return UNKNOWN
        self._call_builtins_map(arguments, place)
        return Generated(self._evaluator.item_of(arguments.positional[1].value), NONE)

    def _call_builtins_range(self, arguments: Arguments, place: Place) -> Value:
        limits = [each.value for each in arguments.positional]
        known = [each.value for each in limits if isinstance(each, Constant) and each.kind is int]
        if len(known) == len(limits) > 0 and 0 not in known[2:]:
            length = len(range(*known))
            if length <= _LONGEST_RANGE:
                return Sequence([(Scalar(int), place)] * length, range)
        return Sequence([(Scalar(int), place)], range, is_open=True)

    def _call_builtins_enumerate(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, 'iterable')
        item = self._evaluator.item_of(first.value) if first else UNKNOWN
        return Generated(Sequence([(Scalar(int), place), (item, place)], tuple), NONE)

    def _call_builtins_zip(self, arguments: Arguments, place: Place) -> Value:
        items = [(self._evaluator.item_of(each.value), place) for each in arguments.positional]
        return Generated(Sequence(items, tuple, arguments.is_open), NONE)

    def _call_builtins_reversed(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        return Generated(self._evaluator.item_of(first.value) if first else UNKNOWN, NONE)

    _call_builtins_iter = _call_builtins_reversed

    def _call_builtins_abs(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        found = alternatives(first.value) if first else (UNKNOWN,)
        return join(
            Scalar(each.kind, each.is_chosen)
            if isinstance(each, Constant | Scalar) and each.kind in (int, float)
            else UNKNOWN
            for each in found
        )

    def _call_builtins_max(self, arguments: Arguments, place: Place) -> Value:
        if len(arguments.positional) < 2 or arguments.is_open:  # noqa: PLR2004
            first = arguments.get(0, '')
            self._call_key(arguments, place)
            return self._evaluator.item_of(first.value) if first else UNKNOWN
        return join(
            self._call_builtins_abs(Arguments((each,)), place) for each in arguments.positional
        )

    _call_builtins_min = _call_builtins_max

    def _call_builtins_type(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        del place
        if first is not None and isinstance(first.value, Message):
            return MessageClass(first.value.type)
        return UNKNOWN

    def _call_builtins_round(self, arguments: Arguments, place: Place) -> Value:
        del place
        return Scalar(int) if len(arguments.positional) == 1 else UNKNOWN

    def _call_copy_copy(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, 'x')
        del place
        match first.value if first else UNKNOWN:
            case Mapping() as given:
                entries = dict(given.entries)
                return Mapping(
                    entries, given.is_open, self._evaluator.run.conditions, given.is_lost
                )
            case Sequence() as given:
                return Sequence(list(given.items), given.kind, given.is_open, given.is_lost)
            case Message() | Constant() | Scalar() as given:
                return given
        return UNKNOWN

    _call_copy_deepcopy = _call_copy_copy

    def _call_functools_partial(self, arguments: Arguments, place: Place) -> Value:
        del place
        if not arguments.positional:
            return UNKNOWN
        rest = Arguments(arguments.positional[1:], arguments.named, arguments.is_open)
        return Partial(arguments.positional[0].value, rest)


def _are_chosen(arguments: Arguments) -> bool:
    """Return whether the file decides on one of the arguments."""
    values = [argument.value for argument in arguments.all()]
    return any(is_chosen(each.yielded if isinstance(each, Generated) else each) for each in values)


def _is_simple(key: object) -> bool:
    return isinstance(key, str | int | float | bool)


def _is_instance(value: Value, wanted: Value) -> bool | None:
    """Return whether a value is of a class, if that is known."""
    found = {_is_one_instance(each, wanted) for each in alternatives(value)}
    return found.pop() if len(found) == 1 else None


def _is_one_instance(value: Value, wanted: Value) -> bool | None:
    if isinstance(value, Message) and isinstance(wanted, MessageClass):
        # Of two packages with the same type, either may be meant.
        same = value.type.rpartition('/')[2] == wanted.type.rpartition('/')[2]
        return value.type == wanted.type or (None if same else False)
    if isinstance(value, Message) and isinstance(wanted, External):
        return False if wanted.name.startswith('builtins.') else None
    if isinstance(value, Mapping) and wanted == External('builtins.dict'):
        return True
    return None
