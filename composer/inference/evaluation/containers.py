"""Dictionaries, lists and texts: what their methods do."""

from __future__ import annotations

from composer.inference.evaluation.part import Part
from composer.inference.values import (
    CHOSEN,
    NONE,
    UNKNOWN,
    Arguments,
    BoundMethod,
    Constant,
    Generated,
    Mapping,
    Message,
    MessageClass,
    PartOfNode,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    are_chosen,
    constant,
    is_chosen,
    join,
)

# Those whose results are short if the text is.
_COMPUTED = frozenset(
    {'endswith', 'isdigit', 'lower', 'lstrip', 'removeprefix', 'removesuffix', 'rstrip'}
    | {'startswith', 'strip', 'title', 'upper'}
)
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


class Containers(Part):
    """Evaluates methods of dictionaries, lists, texts and parts of the node."""

    def call_method(self, method: BoundMethod, arguments: Arguments, place: Place) -> Value:
        """Return what a method may return."""
        owner, name = method.owner, method.name
        first = arguments.get(0, '')
        match owner:
            case PartOfNode(name='parameters' | 'changes'):
                return self._evaluator.node_calls.read_parameters(owner, name, arguments)
            case PartOfNode(name='own_state'):
                return self._evaluator.node_calls.call_own_state(name, arguments)
            case PartOfNode(name='time') if name == 'to_msg':
                return Message('builtin_interfaces/msg/Time')
            case PartOfNode(name='logger') if name == 'get_child':
                return owner
            case Mapping():
                return self._call_mapping(owner, name, arguments, place)
            case Sequence():
                return self._call_sequence(owner, name, arguments)
            case Constant() | Scalar() if owner.kind is str:
                self._evaluator.calls.escape_all(arguments)
                known = _call_text(owner, name, arguments)
                if known is not None:
                    return known
                if name in _TEXT_METHODS:
                    return Scalar(str, is_chosen(owner))
                if name in ('split', 'rsplit', 'splitlines'):
                    return Sequence([(Scalar(str), place)], list, is_open=True, origin=place)
                return Scalar(bytes) if name == 'encode' else UNKNOWN
        if name == 'get_fields_and_field_types' and isinstance(owner, Message | MessageClass):
            return self._fields_of(owner, place)
        if first is not None:
            self._evaluator.calls.escape_all(arguments)
        return CHOSEN if is_chosen(owner) or are_chosen(arguments) else UNKNOWN

    def _fields_of(self, owner: Message | MessageClass, place: Place) -> Value:
        description = self._evaluator.run.types.describe(owner.type)
        if description is None:
            return UNKNOWN
        entries: dict[object, tuple[Value, Place]] = {
            field.name: (Scalar(str), place) for field in description.fields
        }
        return Mapping(entries)

    def _call_mapping(
        self, owner: Mapping, name: str, arguments: Arguments, place: Place
    ) -> Value:
        first, second = arguments.get(0, ''), arguments.get(1, '')
        if owner.is_lost:
            self._evaluator.calls.escape_all(arguments)
            return UNKNOWN
        match name:
            case 'update':
                for argument in arguments.positional:
                    self.update_mapping(owner, argument.value, argument.place)
                for field, argument in arguments.named:
                    self.set_item(owner, field, argument.value, argument.place)
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
                pairs = [
                    Sequence([(constant(key, where), place), (value, where)], tuple)
                    for key, (value, where) in owner.entries.items()
                ]
                return Generated(pair, NONE, items=tuple(pairs))
            case 'keys':
                keys = [constant(key) for key in owner.entries if _is_simple(key)]
                return _generated(keys, is_open=owner.is_open)
            case 'values':
                values = [value for value, _ in owner.entries.values()]
                return _generated(values, is_open=owner.is_open)
        self._evaluator.escape(owner)
        self._evaluator.calls.escape_all(arguments)
        return UNKNOWN

    def update_mapping(self, owner: Mapping, value: Value, place: Place) -> None:
        """Add the entries of another mapping."""
        if isinstance(value, Mapping) and not value.is_lost:
            for key, (held, where) in value.entries.items():
                self.set_item(owner, key, held, where)
            owner.is_open |= value.is_open
        else:
            del place
            self._evaluator.escape(value)
            owner.is_open = True

    def set_item(self, owner: Mapping, key: object, value: Value, place: Place) -> None:
        """Store an entry of a dictionary."""
        owner.set(key, value, place, self._evaluator.run.conditions)

    def store_item(self, owner: Value, index: Value, value: Value, place: Place) -> None:
        """Store `owner[index] = value`."""
        for each in alternatives(owner):
            match each:
                case Mapping():
                    if isinstance(index, Constant):
                        self.set_item(each, index.value, value, place)
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
        self._evaluator.calls.escape_all(arguments)
        return UNKNOWN

    def extend(self, owner: Sequence, value: Value, place: Place) -> None:
        """Add the items of another sequence."""
        if isinstance(value, Sequence) and not value.is_lost:
            owner.items += value.items
            owner.is_open |= value.is_open or bool(self._evaluator.run.conditions)
        else:
            owner.items.append((self._evaluator.item_of(value), place))
            owner.is_open = True


def _generated(values: list[Value], *, is_open: bool) -> Generated:
    if is_open:
        return Generated(UNKNOWN, NONE)
    return Generated(join(values), NONE, items=tuple(values))


def _is_simple(key: object) -> bool:
    return isinstance(key, str | int | float | bool)


def _call_text(owner: Constant | Scalar, name: str, arguments: Arguments) -> Value | None:
    """Return what a method of a text returns, if all is known."""
    given = [argument.value for argument in arguments.all()]
    if name not in _COMPUTED or not isinstance(owner, Constant) or arguments.named:
        return None
    if arguments.is_open or not all(isinstance(each, Constant) for each in given):
        return None
    values = [each.value for each in given if isinstance(each, Constant)]
    try:
        result = getattr(owner.value, name)(*values)
    except (TypeError, ValueError):
        return None
    return constant(result, is_chosen=max(map(is_chosen, [owner, *given])))
