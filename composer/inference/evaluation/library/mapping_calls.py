"""Calls that make dictionaries and copies."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from composer.inference.evaluation.library.known_values import Leaf, NotKnownError, leaves_of
from composer.inference.evaluation.part import Part
from composer.inference.values import (
    NONE,
    UNKNOWN,
    Argument,
    Arguments,
    Constant,
    Instance,
    Mapping,
    Message,
    Place,
    Scalar,
    Sequence,
    Value,
    alternatives,
    join,
)

if TYPE_CHECKING:
    from collections.abc import Callable

_PAIR = 2


class MappingCalls(Part):
    """Evaluates calls that make dictionaries and copies."""

    def handlers(self) -> dict[str, Callable[[Arguments, Place], Value]]:
        """Return what evaluates each function, by its full name."""
        return {
            'builtins.dict': self._dict,
            'builtins.dict.fromkeys': self._from_keys,
            'builtins.vars': self._own_dict,
            'collections.OrderedDict': self._dict,
            'collections.OrderedDict.fromkeys': self._from_keys,
            'collections.ChainMap': self._chain,
            'collections.defaultdict': self._default,
            'copy.copy': self._copy,
            'copy.deepcopy': self._copy_deeply,
            'copy.replace': self._replace,
            'dataclasses.asdict': self._vars,
            'dataclasses.replace': self._replace,
            'types.MappingProxyType': lambda given, _: given.positional[0].value,
        }

    def _new(self, *, is_open: bool = False) -> Mapping:
        return Mapping({}, is_open, self._evaluator.run.conditions)

    def _dict(self, arguments: Arguments, _: Place) -> Value:
        made = self._new(is_open=arguments.is_open)
        containers = self._evaluator.containers
        for argument in arguments.positional:
            containers.update_mapping(made, argument.value, argument.place)
        for name, argument in arguments.named:
            containers.set_item(made, name, argument.value, argument.place)
        return made

    def _from_keys(self, arguments: Arguments, _: Place) -> Value:
        keys, value = arguments.get(0, ''), arguments.get(1, '')
        made = self._new()
        if keys is None:
            return made
        held = value.value if value else NONE
        for key, place in self._keys(keys, made):
            made.set(key, held, place, made.depth)
        return made

    def _keys(self, given: Argument, made: Mapping) -> list[tuple[object, Place]]:
        """Return the keys that something iterated gives; note it if there may be others."""
        value = given.value
        try:
            leaves = leaves_of(value, given.place)
        except NotKnownError:
            items = value.items if isinstance(value, Sequence) and not value.is_lost else []
            leaves = [Leaf(*each) for each in items]
            made.is_open |= not (isinstance(value, Sequence) and value.is_whole)
        known = [each for each in leaves if isinstance(each.value, Constant)]
        made.is_open |= len(known) < len(leaves)
        return [
            (each.value.value, each.place) for each in known if isinstance(each.value, Constant)
        ]

    def _chain(self, arguments: Arguments, place: Place) -> Value:
        """Of the mappings of a `ChainMap`, the first that has a key counts."""
        made = self._dict(Arguments(arguments.positional[::-1], (), True), place)
        self._evaluator.calls.escape_all(arguments)
        return made

    def _default(self, arguments: Arguments, place: Place) -> Value:
        self._evaluator.calls.escape_all(Arguments(arguments.positional[:1]))
        made = self._dict(Arguments(arguments.positional[1:], arguments.named), place)
        if isinstance(made, Mapping):
            made.is_open = True
        return made

    def _own_dict(self, arguments: Arguments, place: Place) -> Value:
        """Return what `vars` gives; who has it may store other attributes."""
        found = self._vars(arguments, place)
        self._evaluator.calls.escape_all(arguments)
        return found

    def _vars(self, arguments: Arguments, place: Place) -> Value:
        """Return the attributes of objects; those of others are not known."""
        first = arguments.get(0, '')
        several = alternatives(first.value) if first else (UNKNOWN,)
        found = [self._attributes_of(each, place) for each in several]
        if UNKNOWN in found:
            self._evaluator.calls.escape_all(arguments)
        return join(found)

    def _attributes_of(self, value: Value, place: Place) -> Value:
        if not isinstance(value, Instance):
            return UNKNOWN
        found = self._evaluator.classes.fields_of(value)
        if found is None:
            return UNKNOWN
        made = self._new(is_open=not value.attributes.keys() <= found.keys())
        for name, (held, where) in found.items():
            inner = [self._attributes_of(each, place) for each in alternatives(held)]
            value = held if UNKNOWN in inner else join(inner)
            made.set(name, value, where, made.depth)
        return made

    def _copy(self, arguments: Arguments, _: Place) -> Value:
        first = arguments.get(0, 'x')
        return join(map(self.copied, alternatives(first.value if first else UNKNOWN)))

    def _copy_deeply(self, arguments: Arguments, _: Place) -> Value:
        first = arguments.get(0, 'x')
        several = alternatives(first.value if first else UNKNOWN)
        return join(self.copied(each, is_deep=True) for each in several)

    def copied(self, value: Value, *, is_deep: bool = False) -> Value:
        """Return a copy of a value: what is changed in one is not in the other."""
        match value:
            case Mapping() as given:
                depth = self._evaluator.run.conditions
                return Mapping(
                    dict(given.entries), given.has_unknown, depth, given.is_lost, given.others
                )
            case Sequence() as given:
                items = [
                    (self.copied(each) if is_deep and isinstance(each, Message) else each, at)
                    for each, at in given.items
                ]
                return Sequence(items, given.kind, given.is_open, given.is_lost)
            case Instance() as given:
                return Instance(given.of, dict(given.attributes))
            case Message():
                return replace(value, is_read_only=False)
            case Constant() | Scalar():
                return value
        return UNKNOWN

    def lasting_copy(self, value: Value) -> Value:
        """Return containers as they are now; other values stay what they are."""
        is_container = isinstance(value, Mapping | Sequence)
        return self.copied(value) if is_container else value

    def _replace(self, arguments: Arguments, place: Place) -> Value:
        first = arguments.get(0, '')
        made = self.copied(first.value) if first else UNKNOWN
        del place
        if isinstance(made, Instance) and not arguments.is_open:
            for name, argument in arguments.named:
                made.attributes[name] = argument.value
            return made
        self._evaluator.calls.escape_all(arguments)
        return UNKNOWN
