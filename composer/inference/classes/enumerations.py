"""Enumerations: their members, and the values of these."""

from __future__ import annotations

import ast
from typing import Any

from composer.inference.evaluation.part import Part
from composer.inference.values import (
    UNKNOWN,
    Arguments,
    Class,
    Constant,
    Descriptor,
    Function,
    Instance,
    Place,
    Scalar,
    Value,
    constant,
    join,
)
from composer.spelling import suggest

_ENUMERATIONS = {'enum.Enum', 'enum.IntEnum', 'enum.StrEnum', 'enum.Flag', 'enum.IntFlag'}
_FLAGS = {'enum.Flag', 'enum.IntFlag'}
# Those whose members are nothing else.
_PLAIN = {'enum.Enum', 'enum.Flag', 'abc.ABC', 'builtins.object'}
_CONVERSIONS = ('__eq__', '__index__', '__int__', '__float__', '__iter__', '__array__')
# Those whose members are texts and numbers themselves.
_MIXINS = {'enum.StrEnum', 'enum.IntEnum', 'builtins.str', 'builtins.int', 'builtins.float'}


class Enumerations(Part):
    """Evaluates the members of enumerations."""

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self._members: dict[tuple[int, str], Value] = {}

    def is_one(self, of: Class) -> bool:
        """Return whether a class is an enumeration."""
        return bool(self._evaluator.classes.bodies.externals(of) & _ENUMERATIONS)

    def members(self, of: Class) -> list[Value]:
        """Return all members of an enumeration."""
        names = self._evaluator.classes.bodies.names_of(of)
        return [
            self.member(of, name, value)
            for name, value in names.items()
            if not name.startswith('_') and not isinstance(value, Function | Descriptor | Class)
        ]

    def member(self, of: Class, name: str, value: Value) -> Value:
        """Return a member by its name."""
        if name.startswith('_'):
            return value
        externals = self._evaluator.classes.bodies.externals(of)
        if value == UNKNOWN:
            # Of `auto()`.
            texts = 'enum.StrEnum' in externals
            value = constant(name.lower(), _place_of(of, name)) if texts else UNKNOWN
        if externals & _MIXINS:
            if isinstance(value, Constant):
                return Constant(value.kind, value.value, 0, value.origin, (of, name))
            return Scalar(int) if 'enum.IntEnum' in externals else UNKNOWN
        key = (id(of.definition), name)
        if key not in self._members:
            held = {'value': value, 'name': constant(name)}
            self._members[key] = Instance(
                of,
                held,
                is_shared=True,
                is_member=True,
                is_no_value=self._is_plain(of),
            )
        return self._members[key]

    def _is_plain(self, of: Class) -> bool:
        """Return whether members are neither numbers nor texts, and are not taken as such."""
        bodies = self._evaluator.classes.bodies
        is_known = UNKNOWN not in bodies.line_of(of) and bodies.externals(of) <= _PLAIN
        return is_known and all(bodies.find(of, name) is None for name in _CONVERSIONS)

    def read(self, member: Constant, name: str) -> Value | None:
        """Return what a member has that is a text or a number; `None` for what these have."""
        of, own_name = member.member
        if name in ('value', '_value_'):
            return Constant(member.kind, member.value, 0, member.origin)
        if name in ('name', '_name_'):
            return constant(own_name)
        found: Value | None = self._evaluator.classes.class_attribute(of, name, member)
        return found

    def member_of_value(self, of: Class, arguments: Arguments) -> Value:
        """Return the member that has a value."""
        members = self.members(of)
        given = arguments.get(0, 'value')
        if given is None or not isinstance(given.value, Constant) or len(arguments.positional) > 1:
            return join(members) if members else UNKNOWN
        values = [_value_of(each) for each in members]
        is_known = all(isinstance(each, Constant) for each in values)
        is_closed = is_known and not self._evaluator.classes.bodies.externals(of) & _FLAGS
        wanted = given.value.value
        found = [m for m, v in zip(members, values, strict=True) if _is_value(v, wanted)]
        if not found and is_closed and not self._evaluator.classes.bodies.find(of, '_missing_'):
            text = f"'{of.definition.name}' has no member whose value is {wanted!r}"
            shown = [each.value for each in values if isinstance(each, Constant)]
            self._evaluator.run.report(
                'bad-call', given.place, text, suggest(wanted, shown, 'it has')
            )
        return found[0] if found else UNKNOWN

    def member_of_name(self, of: Class, index: Value) -> Value:
        """Return the member that has a name."""
        names = self._evaluator.classes.bodies.names_of(of)
        if isinstance(index, Constant) and index.value in names:
            return self.member(of, index.value, names[index.value])
        return join(self.members(of)) if names else UNKNOWN


def _place_of(of: Class, name: str) -> Place | None:
    for statement in of.definition.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=stored) as target]) if stored == name:
                return Place(of.module, target)
    return None


def _is_value(value: Value | None, wanted: object) -> bool:
    return isinstance(value, Constant) and value.value == wanted


def _value_of(member: Value) -> Value | None:
    return member.attributes.get('value') if isinstance(member, Instance) else member
