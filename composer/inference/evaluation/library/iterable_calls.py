"""Calls that go through something: `map`, `sorted`, `next`, and the like."""

from __future__ import annotations

import ast
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

from composer.inference.evaluation.library.known_values import (
    Computation,
    Leaf,
    NotKnownError,
    leaves_of,
)
from composer.inference.evaluation.part import Part
from composer.inference.values import (
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    Constant,
    Generated,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    constant,
    is_chosen,
    is_none,
    join,
    truth_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

# How long a `range` is that is followed number by number, and how long one is that is counted.
_MOST_NUMBERS = 16
_LONGEST_RANGE = 256
# For how many items a function is followed, one by one.
_MOST_CALLS = 16


class IterableCalls(Part):
    """Evaluates calls that go through their arguments."""

    def handlers(self) -> dict[str, Callable[[Arguments, Place], Value]]:
        """Return what evaluates each function, by its full name."""
        return {
            'builtins.enumerate': self._enumerate,
            'builtins.filter': self._filter,
            'builtins.iter': self._iterate,
            'builtins.len': self._length,
            'builtins.list': partial(self._list, list),
            'builtins.map': self._map,
            'builtins.max': partial(self._extreme, max),
            'builtins.min': partial(self._extreme, min),
            'builtins.next': self._next,
            'builtins.range': self._range,
            'builtins.reversed': self._iterate,
            'builtins.set': self._set,
            'builtins.sorted': self._sorted,
            'builtins.sum': self._sum,
            'builtins.tuple': partial(self._list, tuple),
            'builtins.zip': self._zip,
            'collections.deque': partial(self._list, deque),
            'functools.reduce': self._reduce,
            'heapq.nlargest': self._largest,
            'heapq.nsmallest': self._largest,
            'itertools.chain': self._chain,
            'itertools.chain.from_iterable': self._flatten,
            'itertools.combinations': self._pairs,
            'itertools.cycle': self._iterate,
            'itertools.dropwhile': self._filter,
            'itertools.filterfalse': self._filter,
            'itertools.groupby': self._group,
            'itertools.islice': self._iterate,
            'itertools.pairwise': self._pairs,
            'itertools.permutations': self._pairs,
            'itertools.product': self._zip,
            'itertools.starmap': self._starmap,
            'itertools.takewhile': self._filter,
            'itertools.zip_longest': self._zip,
            'random.choice': self._pick,
            'random.sample': partial(self._list, list),
        }

    # Functions that are called with items

    def _call(self, function: Value, place: Place, *items: Value) -> Value:
        arguments = Arguments(tuple(Argument(each, place) for each in items))
        return self._evaluator.calls.invoke(function, arguments, place, waits=False)

    def _items(self, argument: Argument | None) -> list[Leaf] | None:
        """Return the items of an argument, if all are known and they are few."""
        try:
            found = leaves_of(argument.value, argument.place) if argument else None
        except NotKnownError:
            return None
        return found if found is not None and len(found) <= _MOST_CALLS else None

    def _item(self, argument: Argument | None) -> Value:
        return self._evaluator.item_of(argument.value) if argument else UNKNOWN

    def _map(self, arguments: Arguments, place: Place) -> Value:
        if not arguments.positional:
            return UNKNOWN
        function, *iterated = arguments.positional
        known = [self._items(each) for each in iterated]
        with self._evaluator.run.condition():
            if known and all(known) and not arguments.is_open:
                rows = zip(*(each for each in known if each), strict=False)
                found = [
                    self._call(function.value, place, *(each.value for each in row))
                    for row in rows
                ]
                return Generated(join(found), NONE, items=tuple(found))
            items = [self._item(each) for each in iterated]
            return Generated(self._call(function.value, place, *items), NONE)

    def _starmap(self, arguments: Arguments, place: Place) -> Value:
        function, row = arguments.get(0, ''), self._item(arguments.get(1, ''))
        if function is None or not isinstance(row, Sequence) or not row.is_whole:
            self._evaluator.calls.escape_all(arguments)
            return UNKNOWN
        with self._evaluator.run.condition():
            items = [value for value, _ in row.items]
            return Generated(self._call(function.value, place, *items), NONE)

    def _filter(self, arguments: Arguments, place: Place) -> Value:
        function, iterated = arguments.get(0, ''), arguments.get(1, '')
        if function is None or iterated is None:
            return UNKNOWN
        items = self._items(iterated)
        if items is None:
            if not is_none(function.value):
                with self._evaluator.run.condition():
                    self._call(function.value, place, self._item(iterated))
            return Generated(self._item(iterated), NONE)
        kept: list[Value] = []
        is_open = False
        for each in items:
            said = each.value
            if not is_none(function.value):
                with self._evaluator.run.condition():
                    said = self._call(function.value, place, each.value)
            truth = None if is_chosen(said) else truth_of(said)
            is_open |= truth is None
            if truth is not False:
                kept.append(each.value)
        return Generated(join(kept), NONE, items=None if is_open else tuple(kept))

    def _reduce(self, arguments: Arguments, place: Place) -> Value:
        function, iterated, first = (arguments.get(index, '') for index in range(3))
        if function is None or iterated is None:
            return UNKNOWN
        item = self._item(iterated)
        so_far = first.value if first else item
        with self._evaluator.run.condition():
            with self._evaluator.run.silence():
                so_far = join([so_far, self._call(function.value, place, so_far, item)])
            so_far = join([so_far, self._call(function.value, place, so_far, item)])
        return _kind_of(so_far)

    def _keys(self, arguments: Arguments, items: Iterable[Value], place: Place) -> list[Value]:
        """Return what the function `key` says of each item."""
        key = dict(arguments.named).get('key')
        if key is None or is_none(key.value):
            return list(items)
        with self._evaluator.run.condition():
            return [self._call(key.value, place, each) for each in items]

    def _sorted(self, arguments: Arguments, place: Place) -> Value:
        return self.sorted(arguments.get(0, ''), arguments, place)

    def sorted(self, iterated: Argument | None, arguments: Arguments, place: Place) -> Sequence:
        """Return what `sorted` and `list.sort` make."""
        items = self._items(iterated)
        if items is None:
            item = self._item(iterated)
            self._keys(arguments, [item], place)
            return Sequence([(item, place)], list, is_open=True)
        keys = self._keys(arguments, [each.value for each in items], place)
        backwards = dict(arguments.named).get('reverse')
        is_backwards = truth_of(backwards.value) if backwards else False
        any_item = join(each.value for each in items)
        mixed = Sequence([(any_item, each.place) for each in items], list)
        if is_backwards is None:
            return mixed
        made = Computation(place)
        try:
            plain = [made.python(each) for each in keys]
            order = sorted(range(len(items)), key=plain.__getitem__, reverse=is_backwards)
        except (NotKnownError, TypeError):
            return mixed
        return Sequence([(items[at].value, items[at].place) for at in order], list)

    def _extreme(
        self, choose: Callable[[list[Any]], Any], arguments: Arguments, place: Place
    ) -> Value:
        """Return what `min` and `max` return."""
        default = dict(arguments.named).get('default')
        others = [default.value] if default else []
        if len(arguments.positional) > 1:
            values = [each.value for each in arguments.positional]
            self._keys(arguments, values, place)
            return join([*map(_kind_of, values), *others])
        iterated = arguments.get(0, '')
        if 'key' not in dict(arguments.named):
            return join([_kind_of(self._item(iterated)), *others])
        items = self._items(iterated) or [Leaf(self._item(iterated), place)]
        keys = self._keys(arguments, [each.value for each in items], place)
        try:
            made = Computation(place)
            plain = [made.python(each) for each in keys]
            return items[plain.index(choose(plain))].value
        except (NotKnownError, TypeError, ValueError):
            several = join(each.value for each in items)
            return join([several if len(items) == 1 else _in_doubt(several), *others])

    def _largest(self, arguments: Arguments, place: Place) -> Value:
        item = self._item(arguments.get(1, ''))
        self._keys(arguments, [item], place)
        return Sequence([(item, place)], list, is_open=True)

    # Items in another form

    def _iterate(self, arguments: Arguments, _: Place) -> Value:
        if len(arguments.positional) > 1:
            # `iter` calls the first, and `islice` takes numbers.
            self._evaluator.calls.escape_all(arguments)
        return Generated(self._item(arguments.get(0, '')), NONE)

    def _list(self, kind: type, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, 'iterable')
        # Of a `deque` with a limit, items go by themselves.
        is_open = bool(arguments.named) or len(arguments.positional) > 1 or arguments.is_open
        if first is None:
            return Sequence([], kind, is_open)
        if isinstance(first.value, Sequence) and first.value.is_lost:
            return UNKNOWN
        items = [(self._item(first), place)]
        if isinstance(first.value, Sequence) and first.value.is_whole:
            # The order of a set is not known.
            return Sequence(items * len(first.value.items), kind, is_open)
        return Sequence(items, kind, is_open=True)

    def _set(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        if first is None:
            return Sequence([], set)
        return Sequence([(self._item(first), place)], set, is_open=True)

    def _enumerate(self, arguments: Arguments, place: Place) -> Value:
        item = self._item(arguments.get(0, 'iterable'))
        return Generated(Sequence([(Scalar(int), place), (item, place)], tuple), NONE)

    def _zip(self, arguments: Arguments, place: Place) -> Value:
        items = [(self._item(each), place) for each in arguments.positional]
        is_open = arguments.is_open or bool(arguments.named)
        return Generated(Sequence(items, tuple, is_open), NONE)

    def _pairs(self, arguments: Arguments, place: Place) -> Value:
        count = arguments.get(1, 'r')
        times = count.value.value if count and isinstance(count.value, Constant) else 2
        item = self._item(arguments.get(0, ''))
        is_known = isinstance(times, int) and times <= _MOST_CALLS
        items = [(item, place)] * (times if is_known else 1)
        return Generated(Sequence(items, tuple, is_open=not is_known), NONE)

    def _chain(self, arguments: Arguments, _: Place) -> Value:
        return Generated(join(map(self._item, arguments.positional)), NONE)

    def _flatten(self, arguments: Arguments, _: Place) -> Value:
        return Generated(self._evaluator.item_of(self._item(arguments.get(0, ''))), NONE)

    def _group(self, arguments: Arguments, place: Place) -> Value:
        item = self._item(arguments.get(0, ''))
        key = arguments.get(1, 'key')
        with self._evaluator.run.condition():
            name = self._call(key.value, place, item) if key else item
        group = Generated(item, NONE)
        return Generated(Sequence([(name, place), (group, place)], tuple), NONE)

    def _pick(self, arguments: Arguments, _: Place) -> Value:
        return _in_doubt(self._item(arguments.get(0, '')))

    def _next(self, arguments: Arguments, _: Place) -> Value:
        """Return the next item; which one that is, is known of an iterator made right here."""
        iterator, default = arguments.get(0, ''), arguments.get(1, '')
        if iterator is None:
            return UNKNOWN
        others = [default.value] if default else []
        value = iterator.value
        if isinstance(value, Generated) and value.items is not None:
            is_new = not isinstance(iterator.place.node, ast.Name | ast.Attribute)
            if is_new or not value.items:
                return join([*value.items[:1], *(others if not value.items else ())])
            return join([_in_doubt(value.yielded), *others])
        return join([self._item(iterator), *others])

    # Numbers

    def _range(self, arguments: Arguments, place: Place) -> Value:
        limits = [each.value for each in arguments.positional]
        known = [each.value for each in limits if isinstance(each, Constant) and each.kind is int]
        if len(known) == len(limits) > 0 and 0 not in known[2:]:
            numbers = range(*known)
            chosen = max(map(is_chosen, limits))
            if len(numbers) <= _MOST_NUMBERS:
                items = [(constant(each, is_chosen=chosen), place) for each in numbers]
                return Sequence(list(items), range)
            if len(numbers) <= _LONGEST_RANGE:
                return Sequence([(Scalar(int), place)] * len(numbers), range)
        return Sequence([(Scalar(int), place)], range, is_open=True)

    def _length(self, arguments: Arguments, _: Place) -> Value:
        first = arguments.get(0, '')
        value = first.value if first else UNKNOWN
        if isinstance(value, Sequence) and value.is_whole and value.kind is not set:
            held = [item for item, _ in value.items]
            return constant(len(held), is_chosen=max(map(is_chosen, held), default=0))
        return Scalar(int, is_chosen(value))

    def _sum(self, arguments: Arguments, _: Place) -> Value:
        start = arguments.get(1, 'start')
        item = self._item(arguments.get(0, ''))
        values = [*alternatives(item), *(alternatives(start.value) if start else ())]
        kinds = {each.kind for each in values if isinstance(each, Constant | Scalar)}
        is_number = all(isinstance(each, Constant | Scalar) for each in values)
        if not is_number or not kinds <= {bool, int, float}:
            return UNKNOWN
        return Scalar(float if float in kinds else int)


def _kind_of(value: Value) -> Value:
    """Return what is known of one of several numbers: its type."""
    return join(
        Scalar(each.kind, each.is_chosen)
        if isinstance(each, Constant | Scalar) and each.kind in (int, float)
        else UNKNOWN
        if isinstance(each, Constant)
        else each
        for each in alternatives(value)
    )


def _in_doubt(value: Value) -> Value:
    """Return one of several values, of which nobody knows whether it is a certain one."""
    return join(
        Scalar(each.kind, each.is_chosen) if isinstance(each, Constant) else each
        for each in alternatives(value)
    )
