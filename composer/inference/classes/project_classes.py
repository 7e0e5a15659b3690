"""Classes of the project: their objects, and what those have."""

from __future__ import annotations

import ast
from pydoc import locate
from typing import TYPE_CHECKING, Any, NamedTuple

from composer.inference.classes.class_bodies import ClassBodies
from composer.inference.classes.enumerations import Enumerations
from composer.inference.classes.made_fields import MadeFields
from composer.inference.evaluation.part import Part
from composer.inference.values import (
    UNKNOWN,
    Argument,
    Arguments,
    BoundMethod,
    Class,
    Constant,
    Descriptor,
    External,
    Function,
    Instance,
    Mapping,
    MessageClass,
    NodeValue,
    Partial,
    PartOfNode,
    Place,
    Primitive,
    Scalar,
    Sequence,
    Value,
    alternatives,
    constant,
    held_by,
    is_none,
    join,
)
from composer.python_source.annotations import dotted_name
from composer.python_source.changed_names import ALL, NOTHING
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.inference.classes.attribute_stores import AttributeStore

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
# What a class and a function have that tells their name.
CLASS_NAMES = ('__name__', '__qualname__')
# Decorators that give a class no attributes but special ones.
_DECORATORS = {'dataclass', 'final', 'unique', 'total_ordering', 'runtime_checkable', 'verify'}
_OF_ENUMERATIONS = {'name', 'value', '_name_', '_value_'}


class _NamedTuple(NamedTuple):
    """One without fields, for what all of them have."""


# What an object keeps, wherever else something is stored in it.
_LASTING = (
    Primitive,
    *(NodeValue, PartOfNode, BoundMethod, Function, Instance, Class, MessageClass, Partial),
)


class Classes(Part):
    """Evaluates classes."""

    def __init__(self, evaluator: Any) -> None:
        super().__init__(evaluator)
        self.bodies = ClassBodies(evaluator)
        self.fields = MadeFields(evaluator)
        self.enumerations = Enumerations(evaluator)
        self._made: list[Instance] = []

    # Objects

    def instantiate(self, of: Class, arguments: Arguments) -> Value:
        """Return an object of a class."""
        if self.enumerations.is_one(of):
            return self.enumerations.member_of_value(of, arguments)
        if 'typing.TypedDict' in self.bodies.externals(of):
            place = Place(of.module, of.definition)
            made: Value = self._evaluator.library.call('builtins.dict', arguments, place)
            return made
        is_made_anew = self.bodies.find(of, '__new__') is None
        instance = Instance(of, is_shared=self._evaluator.run.is_at_top or not is_made_anew)
        self._made.append(instance)
        init = self.class_attribute(of, '__init__', instance)
        if isinstance(init, Function):
            self._evaluator.functions.follow(init, arguments, waits=True)
        elif self.fields.has_fields(of):
            self.fields.store(instance, arguments)
        else:
            self._evaluator.calls.escape_all(arguments)
        return instance

    def mention_held(self) -> None:
        """Note the texts in objects: methods that were not followed may use them as names."""
        followed = self._evaluator.run.modules.followed
        for instance in self._made:
            line = [each for each in self.bodies.line_of(instance.of) if isinstance(each, Class)]
            methods = [each for one in line for each in one.definition.body]
            if any(isinstance(each, _FUNCTIONS) and id(each) not in followed for each in methods):
                for value in instance.attributes.values():
                    self._mention(value)

    def _mention(self, value: Value) -> None:
        for each in alternatives(value):
            if isinstance(each, Constant) and each.kind is str:
                self._evaluator.run.reading.mentioned.add(each.value)
            elif isinstance(each, Mapping | Sequence):
                held = each.entries.values() if isinstance(each, Mapping) else each.items
                for one, _ in held:
                    if isinstance(one, Constant):
                        self._mention(one)

    # Attributes

    def class_attribute(
        self, of: Class, name: str, owner: Value | None, after: Class | None = None
    ) -> Value | None:
        """Return what a class stores under a name, `None` if nothing; methods are bound.

        Args:
            owner: The object that it is read of; `None` if it is read of the class.
            after: The base after which it is looked for, as `super()` does.
        """
        found = self.bodies.find(of, name, after)
        if found is None:
            return None
        value, home = found
        if self.enumerations.is_one(of) and not isinstance(value, Function | Descriptor):
            return self.enumerations.member(home, name, value)
        match value:
            case Function(owner=None):
                return _method(value, home, owner)
            case Descriptor():
                return self._read_descriptor(value, home, of, owner)
            case Instance():
                getter = self.class_attribute(value.of, '__get__', value)
                return value if getter is None else self._follow(getter, owner or UNKNOWN, of)
        is_open = of.is_open and not _is_lasting(value)
        if not is_open and not self._changes(of, name, value, is_shared=True):
            return value
        # Other behaviours may have stored something else, or nothing yet.
        return join([UNKNOWN, *self._stored_in_classes(of, name)])

    def _stored_in_classes(self, of: Class, name: str) -> list[Value]:
        line = [each for each in self.bodies.line_of(of) if isinstance(each, Class)]
        return [each.attributes[name] for each in line if name in each.attributes]

    def store_in_class(self, of: Class, name: str, value: Value) -> None:
        """Store an attribute of a class."""
        if isinstance(value, Instance):
            value.is_shared = True
        else:
            self._evaluator.escape(value)
        stored = [of.attributes[name]] if name in of.attributes else []
        of.attributes[name] = join([*stored, value])

    def name_of(self, of: Class | Function) -> Value:
        """Return the name of a class or function."""
        name = getattr(of.definition, 'name', None)
        return constant(name, Place(of.module, of.definition)) if name else UNKNOWN

    def subclasses(self, of: Class) -> Value:
        """Return the classes of the same module whose base is a class."""
        found: list[tuple[Value, Place]] = []
        for statement in of.module.body:
            if isinstance(statement, ast.ClassDef) and statement.bases:
                made = self._evaluator.top_value(of.module, statement.name)
                if isinstance(made, Class) and of in self.bodies.bases_of(made):
                    found.append((made, Place(of.module, statement)))
        return Sequence(found, list, is_open=True)

    def is_instance(self, value: Instance, wanted: Value) -> bool | None:
        """Return whether an object is of a class, if that is known."""
        line = self.bodies.line_of(value.of)
        if wanted in line:
            return True
        is_closed = all(isinstance(each, Class | External) for each in line)
        return False if is_closed and isinstance(wanted, Class) else None

    def _read_descriptor(
        self, descriptor: Descriptor, home: Class, of: Class, owner: Value | None
    ) -> Value:
        function = descriptor.function
        match descriptor.kind:
            case 'staticmethod':
                return function
            case 'classmethod' if isinstance(function, Function):
                return _method(function, home, of)
            case 'property' if isinstance(function, Function) and owner is not None:
                return self._follow(_method(function, home, owner))
            case 'partialmethod' if isinstance(function, Partial) and owner is not None:
                method = function.function
                if isinstance(method, Function):
                    method = _method(method, home, owner)
                return Partial(method, function.arguments)
        return UNKNOWN

    def _follow(self, function: Value, *values: Value) -> Value:
        if not isinstance(function, Function):
            return UNKNOWN
        place = Place(function.module, function.definition)
        arguments = Arguments(tuple(Argument(each, place) for each in values))
        result: Value = self._evaluator.functions.follow(function, arguments, waits=True)
        return result

    def call_method(self, owner: Instance, name: str, *values: Value) -> Value | None:
        """Return what a special method gives, `None` if the class has none: `__enter__`."""
        method = self.class_attribute(owner.of, name, owner)
        return None if method is None else self._follow(method, *values)

    def read(self, owner: Instance, name: str) -> Value:
        """Return what an attribute of an object may be."""
        if self.enumerations.is_one(owner.of) and name in owner.attributes:
            return owner.attributes[name]
        found = self.class_attribute(owner.of, name, owner)
        held = self.bodies.find(owner.of, name)
        if held and isinstance(held[0], Descriptor):
            return found or UNKNOWN
        stored = owner.attributes.get(name)
        if name == '__dict__':
            owner.is_open = True
            return UNKNOWN
        if name == 'start' and 'threading.Thread' in self.bodies.externals(owner.of):
            run = self.class_attribute(owner.of, 'run', owner)
            if isinstance(run, Function):
                self._evaluator.functions.follow_later(run)
        if stored is None and owner.is_unmade and self._stores(name):
            return UNKNOWN
        if stored is None:
            is_kept = found is None or not owner.is_open or _is_lasting(found)
            kept = found if is_kept else UNKNOWN
            return kept if kept is not None else self._read_of_proxy(owner, name)
        if name in owner.doubtful and found is not None:
            stored = join([stored, found])
        held_now = alternatives(stored)
        if owner.is_shared and any(each.inside == ALL for each in self._every_store(name)):
            for each in held_now:
                if isinstance(each, Instance):
                    self._evaluator.escape(each)
        if any(map(_is_lasting, held_now)) and all(_is_lasting(e) or is_none(e) for e in held_now):
            return stored
        if owner.is_open:
            return join(map(_widen, alternatives(stored)))
        if not self._is_changed_inside(owner, name, stored):
            is_once = len(self._stores(name)) == 1
            if is_once or not self._changes(owner.of, name, stored, is_shared=owner.is_shared):
                return stored
        return UNKNOWN if owner.is_shared else join(map(_widen, alternatives(stored)))

    def explain_missing(self, of: Class, name: str) -> tuple[str, str, str | None] | None:
        """Return the problem of an attribute that nothing gives to a class or to its objects."""
        line = [each for each in self.bodies.line_of(of) if isinstance(each, Class)]
        given = {each for one in line for each in _attributes_given(one.definition)}
        if name.startswith('__') or name in given or self._every_store(name):
            return None
        own = any(self.bodies.find(of, each) for each in (name, '__getattr__', '__getattribute__'))
        bases = self.bodies.externals(of)
        if own or not all(_is_plain(each.definition) for each in line):
            return None
        if self.enumerations.is_one(of) and name in _OF_ENUMERATIONS:
            return None
        if 'types.SimpleNamespace' in bases or any(_has(each, name) for each in bases):
            return None
        known = [each for each in given if not each.startswith('__')]
        text = f"'{of.definition.name}' has no attribute '{name}'"
        return 'unknown-attribute', text, suggest(name, known)

    def _is_changed_inside(self, owner: Instance, name: str, stored: Value) -> bool:
        held = [each for each in alternatives(stored) if isinstance(each, Mapping | Sequence)]
        # It may have other names.
        names = [
            other
            for other, value in owner.attributes.items()
            if other == name or any(each in (value, *held_by(value)) for each in held)
        ]
        return bool(held and owner.is_shared) and any(
            self._changes(owner.of, each, stored, is_shared=True) for each in names
        )

    def _read_of_proxy(self, owner: Instance, name: str) -> Value:
        """Return what `__getattr__` gives; that there is nothing, is for it to say."""
        with self._evaluator.run.guard(is_guard=True):
            return self.call_method(owner, '__getattr__', constant(name)) or UNKNOWN

    def store(self, owner: Instance, name: str, value: Value) -> None:
        """Store an attribute of an object."""
        held = self.bodies.find(owner.of, name)
        if held and isinstance(held[0], Descriptor) and isinstance(held[0].setter, Function):
            self._follow(_method(held[0].setter, held[1], owner), value)
            return
        setter = self.bodies.find(owner.of, '__setattr__')
        if setter is not None and isinstance(setter[0], Function):
            self._evaluator.escape(value)
            value = UNKNOWN
        if self._evaluator.run.conditions:
            owner.doubtful.add(name)
        owner.set(name, value)

    def _every_store(self, name: str) -> list[AttributeStore]:
        found: list[AttributeStore] = self._evaluator.run.modules.stores_of(name)
        return found

    def _stores(self, name: str) -> list[AttributeStore]:
        return [each for each in self._every_store(name) if each.inside == NOTHING]

    def _changes(self, of: Class, name: str, value: Value, *, is_shared: bool) -> bool:
        """Return whether an attribute may be something else than what was stored in it.

        Args:
            is_shared: Whether other behaviours may change what it holds.
        """
        stores = self._stores(name)
        held = [each for each in alternatives(value) if isinstance(each, Mapping | Sequence)]
        if is_shared and held:
            inner = [one for each in held for one in held_by(each)]
            is_deep = any(isinstance(each, Mapping | Sequence | Instance) for each in inner)
            stores = self._every_store(name)
            stores = [each for each in stores if each.inside in (ALL, NOTHING) or is_deep]
        line = [each.definition for each in self.bodies.line_of(of) if isinstance(each, Class)]
        return any(
            each.owner is None or (each.owner in line and not each.is_made) for each in stores
        )

    def fields_of(self, owner: Instance) -> dict[str, tuple[Value, Place]] | None:
        """Return the fields of an object of a dataclass or named tuple, and their places."""
        return self.fields.fields_of(owner)


def _attributes_given(definition: ast.ClassDef) -> Iterator[str]:
    """Yield the names that the body of a class declares or stores, and those of its slots."""
    for node in ast.walk(definition):
        match node:
            case ast.Attribute(attr=name, ctx=ast.Store()) | ast.Constant(value=str(name)):
                yield name
            case ast.Name(id=name, ctx=ast.Store()):
                yield name


def _has(base: str, name: str) -> bool:
    """Return whether a class of Python has an attribute."""
    return hasattr(_NamedTuple if base == 'typing.NamedTuple' else locate(base), name)


def _is_plain(definition: ast.ClassDef) -> bool:
    """Return whether nothing gives a class further attributes."""
    words = {dotted_name(getattr(each, 'func', each)) for each in definition.decorator_list}
    return {each.rpartition('.')[2] for each in words} <= _DECORATORS


def _method(function: Function, home: Class, owner: Value | None) -> Function:
    """Return a function as a method of an object."""
    return Function(function.module, function.definition, function.outer, owner, of=home)


def _is_lasting(value: Value) -> bool:
    is_member = isinstance(value, Instance) and value.is_member
    return isinstance(value, _LASTING) and not is_member


def _widen(value: Value) -> Value:
    match value:
        case Constant(kind=kind) if kind is not type(None):
            return Scalar(kind, value.is_chosen)
        case Constant() | Mapping() | Sequence() | Instance(is_member=True):
            return UNKNOWN
    return value
