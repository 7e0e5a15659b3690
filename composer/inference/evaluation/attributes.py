"""Attributes: what is read from something, and what may be stored in it."""

from __future__ import annotations

import ast
from array import array
from dataclasses import replace
from typing import TYPE_CHECKING

from composer.inference.classes.project_classes import CLASS_NAMES
from composer.inference.current_run import name_place
from composer.inference.evaluation.containers import SAME
from composer.inference.evaluation.library.known_functions import MAPPINGS
from composer.inference.evaluation.part import Part
from composer.inference.evaluation.read_only_writes import VIEWING, WRITING
from composer.inference.message_types import PARTS, in_python, value_of
from composer.inference.ros_members import ros_members
from composer.inference.values import (
    BY_PARAMETER,
    CHOSEN,
    NODE,
    UNKNOWN,
    Argument,
    ArrayField,
    Awaitable,
    BoundMethod,
    Class,
    Constant,
    External,
    Function,
    Generated,
    Held,
    Instance,
    Mapping,
    Message,
    MessageClass,
    NodeValue,
    PartOfNode,
    Place,
    Primitive,
    ProjectModule,
    Scalar,
    Sequence,
    Super,
    Unknown,
    Value,
    alternatives,
    constant,
    is_chosen,
    is_none,
    join,
)
from composer.interfaces.field_errors import unknown_field
from composer.spelling import find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterable


# What `composer.Node` has; a test holds these names against the classes.
NODE_METHODS = frozenset(
    {
        'call',
        'call_async',
        *('create_client', 'create_publisher', 'create_service', 'create_subscription'),
        'create_timer',
        'destroy',
        'get_parameters',
        'now',
        'publish',
        'send_goal',
        'set_parameters',
        'shutdown',
        'sleep',
        'with_own_state',
    }
)
# What behaviours write for methods of rclpy's node; the others are those of `node.ros`.
_OF_RCLPY = {
    'declare_parameter': "declare it under 'parameters:' of the node",
    'get_logger': 'write node.logger',
    'get_name': 'write node.name',
    'get_parameter': 'write node.parameters.NAME',
}
NODE_ATTRIBUTES = frozenset(
    {'logger', 'name', 'own_state', 'parameters', 'ros', 'state', 'stopping'}
)
STORED_IN_NODE = NODE_ATTRIBUTES - {'logger'}
NAMES_OF_PART: dict[str, frozenset[str]] = {
    'logger': frozenset(
        {
            'debug',
            'error',
            'fatal',
            'get_child',
            'get_effective_level',
            'info',
            'is_enabled_for',
            'log',
            'name',
            'set_level',
            'warn',
            'warning',
        }
    ),
    'time': frozenset({'clock_type', 'from_msg', 'nanoseconds', 'seconds_nanoseconds', 'to_msg'}),
    'duration': frozenset({'from_msg', 'get_c_duration', 'nanoseconds', 'to_msg'}),
    'goal': frozenset({'cancel', 'feedback', 'result', 'result_async', 'status'}),
}
_SHOWN_PARTS = {
    'logger': "the node's logger",
    'duration': 'a duration',
    'time': 'a time',
    'goal': 'a goal',
    'own_state': 'own_state',
    'changes': 'the changes',
}
# What a sequence of numbers, or of texts, may be.
_ARRAYS = (list, array, memoryview)
_OF_MAPPING = frozenset({'get', 'items', 'keys', 'values'})


def _function() -> None:
    """Have the attributes of functions."""


_COROUTINE = frozenset({'close', 'send', 'throw'})


class Attributes(Part):
    """Reads and stores attributes."""

    # Reading

    def read(self, owner: Value, name: str, place: Place) -> Value:
        """Return what an attribute may be; one that no alternative has is a problem."""
        found: list[Value] = []
        problem: tuple[str, str, str | None] | None = None
        several = alternatives(owner)
        # What may be None is read where it is something else.
        values = [each for each in several if not is_none(each)] or several
        for each in values:
            value = self._read(each, name, place)
            if isinstance(value, tuple):
                problem = problem or value
            else:
                found.append(value)
        if problem and not found:
            rule, message, help_text = problem
            self._evaluator.run.report(rule, place, message, help_text)
        return join(found) if found and not problem else UNKNOWN

    def _read(self, owner: Value, name: str, place: Place) -> Value | tuple[str, str, str | None]:
        """Return an attribute, or a problem: the rule, what is wrong, and help."""
        if isinstance(owner, Class | Function) and name in CLASS_NAMES:
            return self._evaluator.classes.name_of(owner)
        if name.startswith('__') and not isinstance(owner, Instance | Class | Super):
            if name == '__class__' and isinstance(owner, Message):
                return MessageClass(owner.type)
            if name in ('__name__', '__qualname__') and isinstance(owner, MessageClass):
                return constant(in_python(owner.type).rpartition('/')[2].rpartition('.')[2])
            if isinstance(owner, NodeValue | PartOfNode):
                self._evaluator.escape(owner)
            if isinstance(owner, Mapping | Sequence):
                return BoundMethod(owner, name)
            # Who asks for a type's module asks which type it is.
            return CHOSEN if isinstance(owner, MessageClass) else UNKNOWN
        match owner:
            case NodeValue():
                return self._read_node(name)
            case PartOfNode():
                return self._read_part(owner, name, place)
            case Message() | MessageClass():
                return self._read_message(owner, name)
            case External():
                return self._evaluator.imports.external(f'{owner.name}.{name}')
            case ProjectModule():
                return self._read_module(owner, name)
            case Instance() if name in ('_asdict', '_replace'):
                return BoundMethod(owner, name)
            case Instance():
                self._evaluator.run.moves += name in owner.attributes
                if name == '__class__':
                    return owner.of
                is_whole = name not in owner.attributes and not owner.is_open
                problem = (
                    self._evaluator.classes.explain_missing(owner.of, name) if is_whole else None
                )
                return problem or self._evaluator.classes.read(owner, name)
            case Class():
                if name == '__subclasses__':
                    return BoundMethod(owner, name)
                classes = self._evaluator.classes
                problem = None if hasattr(type, name) else classes.explain_missing(owner, name)
                return problem or classes.class_attribute(owner, name, None) or UNKNOWN
            case Super(of=of, owner=Instance() | Class() as mine):
                whole = mine.of if isinstance(mine, Instance) else mine
                found = self._evaluator.classes.class_attribute(whole, name, mine, of)
                is_plain = name not in ('__setattr__', '__delattr__')
                return found or (External(f'builtins.object.{name}') if is_plain else UNKNOWN)
            case ArrayField():
                return self._read_array(owner, name)
            case Unknown(is_ros=True) if name[0] != '_' and ros_members():
                if name not in ros_members():
                    return _missing('node.ros', name, ros_members())
                return CHOSEN if ros_members()[name] is None else BoundMethod(owner, name)
            case Unknown(is_read_only=True) if name in WRITING or name in VIEWING:
                return BoundMethod(owner, name)
            case Primitive():
                return BoundMethod(owner, name)
            case Awaitable():
                if name in _COROUTINE or name.startswith('cr_'):
                    return UNKNOWN
                message = f"'{name}' is read of a coroutine, which has not been awaited"
                return 'missing-await', message, 'put await before the call'
            case BoundMethod(owner=NodeValue() | PartOfNode()) if not hasattr(_function, name):
                message = f"'{name}' is read of the method '{owner.name}', which is not called"
                return 'unknown-attribute', message, f'write {owner.name}().{name}'
            case Constant() | Scalar() | Mapping() | Sequence():
                return self._read_builtin(owner, name)
        return Unknown(is_chosen(owner))

    def _read_node(self, name: str) -> Value | tuple[str, str, str | None]:
        if name == 'name':
            return self._evaluator.run.facts.name()
        if name == 'ros':
            self._evaluator.run.reading.reaches_ros = True
            self._evaluator.run.reading.open_kinds.add('parameter')
            return replace(CHOSEN, is_ros=True)
        if name == 'stopping':
            return UNKNOWN
        if name in NODE_ATTRIBUTES:
            return PartOfNode(name)
        if name in NODE_METHODS:
            return BoundMethod(NODE, name)
        kind, message, help_text = _missing('the node', name, NODE_METHODS | NODE_ATTRIBUTES)
        if name in _OF_RCLPY or name in ros_members():
            help_text = _OF_RCLPY.get(name, f"did you mean 'ros.{name}'?")
        return kind, message, help_text

    def _read_part(
        self, owner: PartOfNode, name: str, place: Place
    ) -> Value | tuple[str, str, str | None]:
        run = self._evaluator.run
        match owner.name:
            case 'parameters' if name in _OF_MAPPING:
                return BoundMethod(owner, name)
            case 'parameters':
                run.use('parameter', name, place)
                return run.facts.value_of_parameter(name)
            case 'state':
                run.use_state(name, place)
                if run.probed is not None:
                    run.probed.add(Held('state', name))
                return self._evaluator.kept_value(name)
            case 'own_state' | 'changes':
                if hasattr(dict, name):
                    return BoundMethod(owner, name)
                help_text = f'it is a dictionary: write [{name!r}]'
                return (
                    'unknown-attribute',
                    f"{_SHOWN_PARTS[owner.name]} has no '{name}'",
                    help_text,
                )
        if name not in NAMES_OF_PART[owner.name]:
            return _missing(_SHOWN_PARTS[owner.name], name, NAMES_OF_PART[owner.name])
        if owner.name == 'goal' and name == 'feedback':
            return Generated(Message(f'{owner.type}_Feedback') if owner.type else UNKNOWN, UNKNOWN)
        if name in ('status', 'name'):
            return Scalar(str)
        if name == 'nanoseconds':
            return Scalar(int)
        return BoundMethod(owner, name)

    def _read_message(
        self, owner: Message | MessageClass, name: str
    ) -> Value | tuple[str, str, str | None]:
        description = self._evaluator.run.types.describe(owner.type)
        field = description.field(name) if description else None
        if field is not None:
            return value_of(field.type, owner) if isinstance(owner, Message) else UNKNOWN
        if isinstance(owner, MessageClass) and name in PARTS and '/msg/' not in owner.type:
            return MessageClass(f'{owner.type}_{name}')
        if name == 'get_fields_and_field_types':
            return BoundMethod(owner, name)
        if description is None or name == 'SLOT_TYPES' or name.startswith('_'):
            return UNKNOWN
        if self._evaluator.run.modules.is_patched(name):
            return UNKNOWN
        if name.isupper() or isinstance(owner, MessageClass):
            if self._evaluator.run.types.may_have_constant(owner.type, name):
                return UNKNOWN
            known = self._evaluator.run.types.constants(owner.type)
            # A message also has fields: ROS 1 wrote some of them in capitals.
            if isinstance(owner, MessageClass) or find_nearest(name, known):
                message = f"{in_python(owner.type)} has no constant '{name}'"
                return 'unknown-field', message, suggest(name, known, 'it has')
        error = unknown_field(owner.type, name, [each.name for each in description.fields])
        return 'unknown-field', str(error).replace(owner.type, in_python(owner.type)), error.help

    def _read_module(self, owner: ProjectModule, name: str) -> Value | tuple[str, str, str | None]:
        if self._evaluator.run.modules.has_name(owner.module, name):
            return self._evaluator.top_value(owner.module, name)
        if self._evaluator.imports.is_module_in(owner.module, name):
            return UNKNOWN
        path = owner.module.path
        known = self._evaluator.run.modules.top(owner.module).statements
        message = f"{path.name if path else 'the module'} has no '{name}'"
        return 'undefined-name', message, suggest(name, known)

    def _read_array(self, owner: ArrayField, name: str) -> Value | tuple[str, str, str | None]:
        nested = owner.type.nested
        if nested is None and owner.is_made and name not in SAME:
            return UNKNOWN
        is_known = owner.type.array == 'fixed' or any(hasattr(each, name) for each in _ARRAYS)
        if nested is None and not is_known:
            help_text = suggest(name, [each for each in dir(array) if each[0] != '_'])
            return 'unknown-attribute', f"an array of numbers has no '{name}'", help_text
        if nested is None or hasattr(list, name):
            return BoundMethod(owner, name)
        message = f"'{name}' is read of an array of {nested}"
        return 'unknown-field', message, 'read it of an item: of [0], or in a loop'

    def _read_builtin(
        self, owner: Constant | Scalar | Mapping | Sequence, name: str
    ) -> Value | tuple[str, str, str | None]:
        if isinstance(owner, Constant) and owner.member is not None:
            found = self._evaluator.classes.enumerations.read(owner, name)
            if found is not None:
                return found
        kind = dict if isinstance(owner, Mapping) else owner.kind
        if kind is type(None) or issubclass(kind, BaseException):
            return UNKNOWN
        kinds = MAPPINGS if isinstance(owner, Mapping) else (kind,)
        if any(hasattr(each, name) for each in kinds):
            return BoundMethod(owner, name)
        help_text = suggest(name, [each for each in dir(kind) if each[0] != '_'])
        return 'unknown-attribute', f"a {kind.__name__} has no attribute '{name}'", help_text

    def read_item(self, owner: Value, index: Value, place: Place) -> Value:
        """Return what `owner[index]` may be, of a part of the node."""
        run = self._evaluator.run
        if isinstance(owner, Class | Instance):
            return self._read_item_of_object(owner, index)
        if isinstance(owner, Message):
            name = index.value if isinstance(index, Constant) else '…'
            message = f'{in_python(owner.type)} is a message, and has no items'
            run.report('unknown-field', place, message, f'write .{name}')
            return UNKNOWN
        if owner == PartOfNode('state'):
            self.refuse_item(index, place)
            return UNKNOWN
        if isinstance(owner, PartOfNode) and owner.name == 'own_state':
            if isinstance(index, Constant):
                run.use_own_state(str(index.value), name_place(Argument(index, place), index))
            else:
                run.reading.is_own_state_open = True
            key = str(index.value) if isinstance(index, Constant) else ''
            return self._evaluator.kept_value(f'[{key}]')
        if not isinstance(owner, PartOfNode) or owner.name not in ('parameters', 'changes'):
            return UNKNOWN
        found: list[Value] = []
        run.decide(index)
        for each in alternatives(index):
            if isinstance(each, Constant) and isinstance(each.value, str):
                run.use(
                    'parameter',
                    each.value,
                    name_place(Argument(index, place), each),
                    is_change=owner.name == 'changes',
                )
                found.append(run.facts.value_of_parameter(each.value))
            else:
                run.use_any('parameter', each, place)
                found.append(UNKNOWN)
        return join(found)

    def _read_item_of_object(self, owner: Class | Instance, index: Value) -> Value:
        classes = self._evaluator.classes
        if isinstance(owner, Class):
            is_one = classes.enumerations.is_one(owner)
            # `Box[str]` is the class itself, unless it says otherwise.
            is_own = classes.bodies.find(owner, '__class_getitem__') is not None
            other = UNKNOWN if is_own else owner
            return classes.enumerations.member_of_name(owner, index) if is_one else other
        items = classes.fields.items_of(owner)
        if items is not None and isinstance(index, Constant) and isinstance(index.value, int):
            return items[index.value] if -len(items) <= index.value < len(items) else UNKNOWN
        return classes.call_method(owner, '__getitem__', index) or UNKNOWN

    def note_containment(self, item: Value, container: Value, place: Place) -> None:
        """`'x' in node.parameters` uses a parameter, and works without it."""
        if not isinstance(container, PartOfNode):
            return
        run = self._evaluator.run
        for each in alternatives(item):
            if not isinstance(each, Constant) or not isinstance(each.value, str):
                continue
            where = name_place(Argument(item, place), each)
            if container.name in ('parameters', 'changes'):
                is_change = container.name == 'changes'
                run.use(
                    'parameter',
                    each.value,
                    where,
                    is_optional=True,
                    has_default=True,
                    is_change=is_change,
                )
            elif container.name == 'own_state':
                run.reading.own_state_set.add(each.value)

    def contained(self, sign: ast.cmpop, item: Value, container: Value) -> Value | None:
        """Return whether a name is among the parameters, as the file decides."""
        if container != PartOfNode('parameters') or not isinstance(sign, ast.In | ast.NotIn):
            return None
        if not isinstance(item, Constant) or self._evaluator.run.reading.reaches_ros:
            return CHOSEN
        value = self._evaluator.run.facts.value_of_parameter(str(item.value))
        return constant((value != UNKNOWN) == isinstance(sign, ast.In), is_chosen=BY_PARAMETER)

    # Storing

    def store(self, owner: Value, name: str, value: Value, place: Place) -> None:
        """Store an attribute; a message holds only its fields."""
        self._evaluator.read_only.check_write(owner, place)
        owners = alternatives(owner)
        if len(owners) == 1 or all(isinstance(each, Instance) for each in owners):
            for each in owners:
                self._store(each, name, value, place)
        else:
            self._evaluator.escape(value)

    def _store(self, owner: Value, name: str, value: Value, place: Place) -> None:
        run = self._evaluator.run
        match owner:
            case PartOfNode(name='state'):
                run.reading.state_set.add(name)
                self._evaluator.waiting.fill(Held('state', name))
                self._evaluator.keep(name, value)
            case PartOfNode(name='parameters'):
                self._refuse_parameter(name, place)
            case PartOfNode(name='own_state'):
                message = f"own_state takes no attribute '{name}'"
                help_text = f'it is a dictionary: write [{name!r}]'
                run.report('unknown-attribute', place, message, help_text)
            case NodeValue() if name not in STORED_IN_NODE:
                message = f"the node takes no attribute '{name}'"
                run.report('unknown-attribute', place, message, f'keep it in node.state.{name}')
            case Message():
                self._store_field(owner, name, value, place)
            case Instance() if self._evaluator.classes.fields.is_frozen(owner.of, name):
                message = f"'{name}' cannot be set: {owner.of.definition.name} is frozen"
                run.report('unknown-attribute', place, message, 'make another one')
            case Instance():
                if owner.is_open:
                    self._evaluator.escape(value)
                run.changes += 1
                self._evaluator.classes.store(owner, name, value)
            case Class():
                self._evaluator.classes.store_in_class(owner, name, value)
            case _:
                self._evaluator.escape(value)

    def _refuse_parameter(self, name: str, place: Place) -> None:
        self._evaluator.run.report(
            'unset-parameter',
            place,
            f"this does not set the parameter '{name}'",
            f'did you mean node.set_parameters(node.name, {{{name!r}: …}})?',
        )

    def refuse_item(self, index: Value, place: Place) -> None:
        """Report `node.state['x']`."""
        name = index.value if isinstance(index, Constant) else '…'
        is_name = isinstance(name, str) and (name.isidentifier() or name == '…')
        help_text = f'write node.state.{name}' if is_name else 'write node.own_state[…]'
        message = "the node's state has attributes, and no items"
        self._evaluator.run.report('unknown-attribute', place, message, help_text)

    def store_item(self, index: Value, place: Place) -> None:
        """Refuse `node.parameters['x'] = …`."""
        name = index.value if isinstance(index, Constant) else '…'
        self._refuse_parameter(str(name), place)

    def _store_field(self, owner: Message, name: str, value: Value, place: Place) -> None:
        description = self._evaluator.run.types.describe(owner.type)
        if description is None:
            self._evaluator.escape(value)
            return
        field = description.field(name)
        if field is None:
            error = unknown_field(owner.type, name, [each.name for each in description.fields])
            message = str(error).replace(owner.type, in_python(owner.type))
            if not name.startswith('_'):
                self._evaluator.run.report('unknown-field', place, message, error.help)
            return
        self._evaluator.payloads.check_field(owner.type, field, value, place)


def _missing(owner: str, name: str, known: Iterable[str]) -> tuple[str, str, str | None]:
    message = f"{owner} has no attribute '{name}'"
    return 'unknown-attribute', message, suggest(name, known, 'it has')
