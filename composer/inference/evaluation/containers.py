"""Dictionaries, lists and texts: what their methods do."""

from __future__ import annotations

from contextlib import nullcontext

from composer.inference.evaluation.library.known_values import NotKnownError, leaves_of
from composer.inference.evaluation.part import Part
from composer.inference.values import (
    UNKNOWN,
    Arguments,
    ArrayField,
    BoundMethod,
    Constant,
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
    chosen_by,
    is_chosen,
)
from composer.spelling import suggest

# Methods of an array that give its items in another form.
SAME = ('copy', 'flatten', 'ravel', 'reshape', 'tobytes')


class Containers(Part):
    """Evaluates methods of dictionaries, lists, texts and parts of the node."""

    def call_method(self, method: BoundMethod, arguments: Arguments, place: Place) -> Value:
        """Return what a method may return."""
        owner, name = method.owner, method.name
        first = arguments.get(0, '')
        self._evaluator.read_only.check_method(owner, name, place)
        match owner:
            case PartOfNode(name='parameters' | 'changes'):
                return self._evaluator.node_calls.read_parameters(owner, name, arguments)
            case PartOfNode(name='own_state'):
                return self._evaluator.node_calls.call_own_state(name, arguments)
            case PartOfNode(name='time' | 'duration' as part) if name == 'to_msg':
                return Message(f'builtin_interfaces/msg/{part.title()}')
            case PartOfNode(name='logger') if name == 'get_child':
                return owner
            case Mapping() | Sequence() | Constant() | Scalar() | Instance():
                return self._evaluator.methods.call(owner, name, arguments, place)
            case ArrayField(is_made=True, type=made) if name in SAME and not made.nested:
                return Scalar(bytes) if name == 'tobytes' else owner
            case ArrayField() if name == 'copy':
                return self._evaluator.read_only.copy_of(owner, place)
            case ArrayField() if name == 'tolist':
                return Sequence([(self._evaluator.item_of(owner), place)], list, is_open=True)
            case ArrayField() if name in ('append', 'insert'):
                item = arguments.get(int(name == 'insert'), '')
                if item is not None and isinstance(item.value, Message):
                    payloads = self._evaluator.payloads
                    payloads.check_item(owner.type.item, item.value, item.place)
        if name == 'get_fields_and_field_types' and isinstance(owner, Message | MessageClass):
            return self._fields_of(owner, place)
        if first is not None:
            self._evaluator.calls.escape_all(arguments)
        is_view = self._evaluator.read_only.is_view(owner, name)
        return Unknown(max(is_chosen(owner), chosen_by(arguments)), is_read_only=is_view)

    def _fields_of(self, owner: Message | MessageClass, place: Place) -> Value:
        description = self._evaluator.run.types.describe(owner.type)
        if description is None:
            return UNKNOWN
        entries: dict[object, tuple[Value, Place]] = {
            field.name: (Scalar(str), place) for field in description.fields
        }
        return Mapping(entries)

    def update_mapping(self, owner: Mapping, value: Value, place: Place) -> None:
        """Add the entries of another mapping."""
        several = alternatives(value)
        for each in several:
            if isinstance(each, Mapping) and not each.is_lost:
                # Of several, only one has these entries.
                with self._evaluator.run.condition() if len(several) > 1 else nullcontext():
                    for key, (held, where) in each.entries.items():
                        self.set_item(owner, key, held, where)
                owner.has_unknown |= each.has_unknown
                if each.others is not None:
                    owner.set_other(each.others)
            else:
                self._add_pairs(owner, each, place)

    def _add_pairs(self, owner: Mapping, value: Value, place: Place) -> None:
        """Add entries that are given as pairs: `dict([('x', 1.0)])`."""
        try:
            pairs = [each.value for each in leaves_of(value, place)]
        except NotKnownError:
            pairs = [UNKNOWN]
        for pair in pairs:
            match pair:
                case Sequence(items=[(Constant() as key, at), (held, _)]) if pair.is_whole:
                    self.set_item(owner, key.value, held, key.origin or at)
                case _:
                    self._evaluator.escape(pair)
                    owner.is_open = True

    def set_item(self, owner: Mapping, key: object, value: Value, place: Place) -> None:
        """Store an entry of a dictionary."""
        self._evaluator.run.changes += 1
        owner.set(key, value, place, self._evaluator.run.conditions)

    def check_key(self, owner: Value, key: Value, place: Place) -> None:
        """Report a key that a dictionary does not have, if all that it has is known."""
        match owner, key:
            case Mapping(is_lost=False, is_open=False, entries=entries), Constant(value=value):
                if entries and value not in entries:
                    help_text = suggest(value, entries, 'it has')
                    text = f'there is no key {value!r}'
                    self._evaluator.run.report('bad-index', place, text, help_text)

    def check_index(self, owner: Value, index: Value, place: Place) -> None:
        """Report an index that an array or sequence does not have, whatever is in it."""
        size = None
        if isinstance(owner, ArrayField) and owner.type.array == 'fixed':
            size = owner.type.array_bound
        elif isinstance(owner, Sequence) and owner.is_whole and owner.kind is tuple:
            size = len(owner.items)
        if size is None or not isinstance(index, Constant) or index.kind is not int:
            return
        if not -size <= index.value < size:
            text = f'there is no item {index.value}: this has {size}, from 0 to {size - 1}'
            self._evaluator.run.report('bad-index', place, text)

    def store_item(self, owner: Value, index: Value, value: Value, place: Place) -> None:
        """Store `owner[index] = value`."""
        self._evaluator.run.changes += 1
        for each in alternatives(owner):
            self.check_index(each, index, place)
            if getattr(each, 'is_lost', False):
                self._evaluator.escape(value)
            match each:
                case Mapping():
                    if isinstance(index, Constant):
                        self.set_item(each, index.value, value, place)
                    else:
                        each.set_other(value)
                        self._evaluator.escape(value)
                case Sequence():
                    each.items.append((value, place))
                    each.is_open = True
                case PartOfNode(name='parameters'):
                    self._evaluator.attributes.store_item(index, place)
                case PartOfNode(name='state'):
                    self._evaluator.attributes.refuse_item(index, place)
                case PartOfNode(name='own_state'):
                    keys = [key for key in alternatives(index) if isinstance(key, Constant)]
                    reading = self._evaluator.run.reading
                    reading.own_state_set |= {str(key.value) for key in keys}
                    reading.is_own_state_open |= not keys
                    for key in keys:
                        self._evaluator.keep(f'[{key.value}]', value)
                case _:
                    self._evaluator.escape(value)

    def extend(self, owner: Sequence, value: Value, place: Place) -> None:
        """Add the items of another sequence."""
        self._evaluator.run.changes += 1
        if isinstance(value, Sequence) and not value.is_lost:
            owner.items += value.items
            owner.is_open |= value.is_open or bool(self._evaluator.run.conditions)
        else:
            owner.items.append((self._evaluator.item_of(value), place))
            owner.is_open = True
