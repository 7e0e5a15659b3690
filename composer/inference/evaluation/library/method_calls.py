"""Methods of dictionaries, lists, texts and numbers."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from composer.inference.evaluation.library.known_functions import METHODS, call_method
from composer.inference.evaluation.part import Part
from composer.inference.values import (
    ANY,
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    Constant,
    Generated,
    Instance,
    Mapping,
    Place,
    Scalar,
    Sequence,
    Value,
    chosen_by,
    constant,
    held_by,
    is_chosen,
    join,
    pattern_of,
)
from composer.python_source.changed_names import CHANGING

if TYPE_CHECKING:
    from collections.abc import Callable

# How many parts `partition` makes.
_PARTS = 3
_REPLACED = re.compile(r'\{[^{}]*\}')
_VIEWS: dict[str, type] = {
    'items': type({}.items()),
    'keys': type({}.keys()),
    'values': type({}.values()),
}


class MethodCalls(Part):
    """Evaluates methods of dictionaries, lists, texts and numbers."""

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self._of_mappings: dict[str, Callable[[Mapping, Arguments, Place], Value]] = {
            'copy': self._copy,
            'get': self._get,
            'items': self._items,
            'keys': self._keys,
            'pop': self._take,
            'setdefault': self._set_default,
            'update': self._update,
            'values': self._values,
        }
        self._of_sequences: dict[str, Callable[[Sequence, Arguments, Place], Value]] = {
            'add': self._append,
            'append': self._append,
            'appendleft': self._prepend,
            'clear': self._clear,
            'copy': self._copy,
            'extend': self._extend,
            'insert': self._insert,
            'pop': self._pop,
            'popleft': self._pop_first,
            'reverse': self._reverse,
            'sort': self._sort,
            'update': self._extend,
        }

    def call(
        self,
        owner: Mapping | Sequence | Constant | Scalar | Instance,
        name: str,
        arguments: Arguments,
        place: Place,
    ) -> Value:
        """Return what a method may return."""
        if isinstance(owner, Instance):
            if name in ('_asdict', '_replace'):
                function = {'_asdict': 'dataclasses.asdict', '_replace': 'dataclasses.replace'}
                me = Arguments((Argument(owner, place), *arguments.positional), arguments.named)
                result: Value = self._evaluator.library.call(function[name], me, place)
                return result
            self._evaluator.calls.escape_all(arguments)
            return UNKNOWN
        if getattr(owner, 'is_lost', False):
            self._evaluator.calls.escape_all(arguments)
            return UNKNOWN
        if isinstance(owner, Mapping):
            method = self._of_mappings.get(name)
            if method is not None:
                self._evaluator.run.changes += name in CHANGING
                return method(owner, arguments, place)
        if isinstance(owner, Sequence) and name in self._of_sequences:
            self._evaluator.run.changes += name in CHANGING
            return self._of_sequences[name](owner, arguments, place)
        return self._call_plain(owner, name, arguments, place)

    def _call_plain(
        self,
        owner: Mapping | Sequence | Constant | Scalar,
        name: str,
        arguments: Arguments,
        place: Place,
    ) -> Value:
        """Return what a method returns that changes nothing."""
        kind = dict if isinstance(owner, Mapping) else owner.kind
        result = METHODS.get(set if kind is frozenset else kind, {}).get(name)
        if result is not None:
            me = Argument(owner, place)
            whole = Arguments((me, *arguments.positional), arguments.named, arguments.is_open)
            known: Value | None = self._evaluator.library.compute(call_method(name), whole, place)
            if known is not None:
                return known
            self._evaluator.library.refuse(call_method(name), whole, place)
        pattern = _pattern(owner, name, arguments)
        self._evaluator.calls.escape_all(arguments)
        if result is list:
            return Sequence([(Scalar(str), place)], list, is_open=True, origin=place)
        if result is tuple:
            return Sequence([(Scalar(str), place)] * _PARTS, tuple, origin=place)
        if result is set:
            return Sequence([], set, is_open=True)
        if result is not None:
            chosen = max(is_chosen(owner), chosen_by(arguments))
            return Scalar(result, chosen, pattern=pattern)
        if not isinstance(owner, Constant | Scalar):
            self._evaluator.escape(owner)
        return UNKNOWN

    # Dictionaries

    def _update(self, owner: Mapping, arguments: Arguments, _: Place) -> Value:
        containers = self._evaluator.containers
        for argument in arguments.positional:
            containers.update_mapping(owner, argument.value, argument.place)
        for field, argument in arguments.named:
            containers.set_item(owner, field, argument.value, argument.place)
        owner.is_open |= arguments.is_open
        return NONE

    def _set_default(self, owner: Mapping, arguments: Arguments, _: Place) -> Value:
        first, second = arguments.get(0, ''), arguments.get(1, '')
        if first is None or second is None:
            return self._lose(owner, arguments)
        key = first.value
        held = owner.entries.get(key.value) if isinstance(key, Constant) else None
        if held is None:
            self._evaluator.containers.store_item(owner, key, second.value, first.place)
            return second.value
        return join([held[0], second.value])

    def _get(self, owner: Mapping, arguments: Arguments, _: Place) -> Value:
        first, second = arguments.get(0, ''), arguments.get(1, '')
        if first is None:
            return UNKNOWN
        found = owner.value_of(first.value)
        if found is None:
            return second.value if second else NONE
        # One that is not there is an error elsewhere.
        is_there = isinstance(first.value, Constant) and first.value.value in owner.entries
        others = [second.value] if second else [] if is_there else [NONE]
        return join([found, *others])

    def _take(self, owner: Mapping, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        value = self._get(owner, arguments, place)
        key = first.value if first else UNKNOWN
        is_certain = not self._evaluator.run.conditions and not owner.is_open
        if isinstance(key, Constant) and is_certain:
            owner.entries.pop(key.value, None)
        else:
            self._evaluator.escape(owner)
        return value

    def _copy(self, owner: Mapping | Sequence, _: Arguments, __: Place) -> Value:
        copied: Value = self._evaluator.library.mappings.copied(owner)
        return copied

    def _items(self, owner: Mapping, _: Arguments, place: Place) -> Value:
        pairs: list[tuple[Value, Place]] = [
            (Sequence([(constant(key, at), at), (value, at)], tuple), at)
            for key, (value, at) in owner.entries.items()
        ]
        return self._view('items', owner, pairs, place)

    def _keys(self, owner: Mapping, _: Arguments, place: Place) -> Value:
        keys = [(constant(key, at), at) for key, (_, at) in owner.entries.items()]
        return self._view('keys', owner, list(keys), place)

    def _values(self, owner: Mapping, _: Arguments, place: Place) -> Value:
        return self._view('values', owner, list(owner.entries.values()), place)

    def _view(
        self, name: str, owner: Mapping, items: list[tuple[Value, Place]], place: Place
    ) -> Value:
        if owner.is_open or not items:
            # It shows what is stored later, too.
            value = owner.any_value()
            pair = Sequence([(UNKNOWN, place), (value, place)], tuple)
            of_view = {'keys': UNKNOWN, 'values': value, 'items': pair}
            return Generated(of_view[name], NONE)
        return Sequence(items, _VIEWS[name], origin=place)

    def _lose(self, owner: Mapping | Sequence, arguments: Arguments) -> Value:
        self._evaluator.escape(owner)
        self._evaluator.calls.escape_all(arguments)
        return UNKNOWN

    # Lists and sets

    def _append(self, owner: Sequence, arguments: Arguments, place: Place) -> Value:
        return self._add(owner, len(owner.items), arguments.get(0, ''), place)

    def _prepend(self, owner: Sequence, arguments: Arguments, place: Place) -> Value:
        return self._add(owner, 0, arguments.get(0, ''), place)

    def _insert(self, owner: Sequence, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        index = first.value if first else UNKNOWN
        if not isinstance(index, Constant) or index.kind is not int:
            owner.is_open = True
            return self._add(owner, 0, arguments.get(1, ''), place)
        return self._add(owner, index.value, arguments.get(1, ''), place)

    def _add(self, owner: Sequence, index: int, item: Argument | None, _: Place) -> Value:
        if item is not None:
            owner.items.insert(index, (item.value, item.place))
        owner.is_open |= bool(self._evaluator.run.conditions) or item is None
        return NONE

    def _extend(self, owner: Sequence, arguments: Arguments, place: Place) -> Value:
        for argument in arguments.positional:
            self._evaluator.containers.extend(owner, argument.value, argument.place)
        del place
        return NONE

    def _pop(self, owner: Sequence, arguments: Arguments, _: Place) -> Value:
        first = arguments.get(0, '')
        index: Value = first.value if first else constant(-1)
        if owner.kind in (set, frozenset) or not isinstance(index, Constant):
            return self._lose(owner, arguments)
        value = owner.item_at(index.value)
        is_certain = owner.is_whole and not self._evaluator.run.conditions
        if is_certain and -len(owner.items) <= index.value < len(owner.items):
            del owner.items[index.value]
        else:
            owner.is_lost = True
        return value

    def _pop_first(self, owner: Sequence, _: Arguments, place: Place) -> Value:
        return self._pop(owner, Arguments((Argument(constant(0), place),)), place)

    def _clear(self, owner: Sequence, arguments: Arguments, _: Place) -> Value:
        if self._evaluator.run.conditions:
            return self._lose(owner, arguments)
        owner.items.clear()
        owner.is_open = False
        return NONE

    def _reverse(self, owner: Sequence, _: Arguments, __: Place) -> Value:
        if self._evaluator.run.conditions or owner.is_open:
            item = owner.item()
            owner.items[:] = [(item, at) for _, at in owner.items]
        owner.items.reverse()
        return NONE

    def _sort(self, owner: Sequence, arguments: Arguments, place: Place) -> Value:
        made = self._evaluator.library.iterables.sorted(Argument(owner, place), arguments, place)
        if self._evaluator.run.conditions or owner.is_open:
            item = owner.item()
            owner.items[:] = [(item, at) for _, at in owner.items]
        else:
            owner.items[:] = made.items
        return NONE


def _pattern(owner: Value, name: str, arguments: Arguments) -> str:
    """Return what is known of the text that `format` or `join` makes."""
    first = arguments.get(0, '')
    if isinstance(owner, Constant) and name == 'format':
        return _REPLACED.sub(ANY, owner.value)
    if isinstance(owner, Constant) and name == 'join' and first and not arguments.is_open:
        is_known = isinstance(first.value, Sequence) and first.value.is_whole
        return owner.value.join(map(pattern_of, held_by(first.value))) if is_known else ''
    return ''
