"""What a type checker reports, as findings: by their rules, with their places and words.

A report that says nothing certain of a node or a message is none.
"""

from __future__ import annotations

import ast
import re
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

from composer.diagnostics import Span, diagnostic_at
from composer.interfaces.descriptions import FieldType
from composer.interfaces.field_errors import unknown_field
from composer.interfaces.field_values import INTEGER_RANGES, OCTET_KINDS
from composer.interfaces.message_types import PARTS, in_python
from composer.node_uses.message_uses import advise_float, advise_text, explain_unknown
from composer.node_uses.names import Chain, Class, External, Instance
from composer.node_uses.node_calls import OF_RCLPY
from composer.node_uses.reading import SENDING_METHODS
from composer.python_source.syntax import (
    owner_of,
    stored_names,
    words_in,
)
from composer.records import record
from composer.spelling import did_you_mean, find_nearest, is_typo, suggest
from composer.stubs.checking.annotated_copies import ReportedPlace
from composer.stubs.checking.origins import INTERFACE, OF_PYTHON, Origins
from composer.stubs.message_stubs import PARTS_OF_KINDS
from composer.stubs.node_stubs import SENDING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Related
    from composer.interfaces.descriptions import MessageDescription
    from composer.language.specs import NodeSpec
    from composer.stubs.checking.annotated_copies import (
        AnnotatedCopy,
        FunctionKey,
        FunctionUse,
    )
    from composer.stubs.checking.type_checker import TypeReport
    from composer.stubs.node_stubs import NodeShape

# Where something is wrong, its rule, and the message with the help.
_Problem: TypeAlias = 'tuple[ast.expr, str, str, str | None]'

_ATTRIBUTE = re.compile(r'(?:Object of class|Class) `(\w+)` has no (?:class )?attribute `(\w+)`')
_ARGUMENT = re.compile(
    r'Argument `([^`]+)` is not assignable to parameter `(\w+)` with type `([^`]+)` '
    r'in function `([\w.]+)`'
)
_RETURNED = re.compile(r'(?:Returned|Yielded) type `([^`]+)`')
_OPERANDS = re.compile(r'`([^`]+)` is not supported between `([^`]+)` and `([^`]+)`')
_FUNCTION = re.compile(r'in function `([\w.]+)`')
_KEYWORD = re.compile(r'Unexpected keyword argument `(\w+)`')
_MEANT = re.compile(r'Did you mean `(\w+)`')
_MESSAGE = re.compile(r'^(\w+)\.(msg|srv|action)\.(\w+)\.(\w+)$')
_LITERAL = re.compile(r"Literal\[('[^']*'|-?\d+|True|False|b'[^']*')\]")
_TIME = re.compile(r'^rclpy\.\w+\.Rclpy(Time|Duration)\.__init__$')
_MISSING = re.compile(r'Missing argument `(\w+)` in function `(?:\w+\.)*(\w+)\.__init__`')
_UNBOUND = re.compile(r'`(\w+)` is uninitialized')
_OVERLOADED = re.compile(r'No matching overload found for function `([\w.]+)`')
_UNARY = re.compile(r'Type `([^`]+)` is not iterable')
_COMPARED = re.compile(r'between incompatible types `([^`]+)` and `([^`]+)`')
_INDEXED = re.compile(r'Cannot (?:index into|set item in) `(\w+)[^`]*`')
_PARTS = {
    'Logger': 'the logger',
    'Goal': 'a goal',
    'RclpyTime': 'a time of rclpy',
    'RclpyDuration': 'a duration of rclpy',
    'End': 'a subscription',
    'Publisher': 'a publisher',
}
# What arguments of the node's methods may be.
_TAKEN = {
    'behaviour': 'a function',
    'qos': 'a depth, the name of a profile, a mapping or a QoSProfile',
}
_FLOATS = ('float32', 'float64')
_SCALARS = frozenset({'bool', 'bytes', 'float', 'int', 'str'})
_TYPES_OF_DISPLAYS: dict[type, str] = {
    ast.Dict: 'dict',
    ast.List: 'list',
    ast.Set: 'set',
    ast.Tuple: 'tuple',
    ast.JoinedStr: 'str',
}
# The times of rclpy, as the stubs call them, and the messages that they make.
_TIMES = {f'Rclpy{each}': f'builtin_interfaces/msg/{each}' for each in ('Time', 'Duration')}
# What makes something else of an object.
_CONVERTING = {
    '__array__',
    '__float__',
    '__getitem__',
    '__index__',
    '__int__',
    '__iter__',
    'to_msg',
}
_CONTAINERS = {'collections', 'defaultdict', 'deque', 'dict', 'list', 'set'}
_COLLECTIONS = frozenset({'array', 'dict', 'frozenset', 'list', 'NDArray', 'set', 'tuple'})
# Classes of Python, of which fields and parameters are.
_PLAIN_OWNERS = _SCALARS | {'array', 'list', 'Mapping'}


@record
class OwnCode:
    """What is known of a project's own code.

    Attributes:
        names: Those of classes that it defines, changes, or imports from elsewhere.
        stored: The attributes that it gives to classes and objects; with an empty text, any.
        classes: Those that have what is written out, or what their bases have, alone.
        bases: What its classes inherit from.
        kept: The attributes that are of one type, beside `None`.
    """

    names: frozenset[str]
    stored: frozenset[str]
    classes: Mapping[str, ast.ClassDef]
    bases: frozenset[str]
    kept: frozenset[str]


@record
class TypeFindings:
    """Turns reports into findings.

    Attributes:
        nodes: The nodes of each class in the stub, by their keys.
        shapes: What each of these classes has.
        functions: What is known of the project's functions.
        messages: The full names of messages, by their classes; of one that several have, empty.
        modules: The names of its modules.
        types: Those of values that were asked for, by the identities of their syntax trees.
    """

    context: CheckContext
    nodes: Mapping[str, Mapping[str, NodeSpec]]
    shapes: Mapping[str, NodeShape]
    functions: Mapping[FunctionKey, FunctionUse]
    messages: Mapping[str, str]
    modules: frozenset[str]
    own: OwnCode
    types: dict[int, str] = field(default_factory=dict)

    @cached_property
    def _plain(self) -> frozenset[str]:
        """The classes whose objects stand for nothing else."""
        return frozenset(
            name
            for name, each in self.own.classes.items()
            if words_in(*each.bases) <= {'ABC', 'Enum', 'Flag', 'object'}
            and not {getattr(part, 'name', '') for part in each.body} & _CONVERTING
        )

    @cached_property
    def _origins(self) -> Origins:
        return Origins(self.context.modules, self.functions.values(), self.own.kept)

    def ask(self, copy: AnnotatedCopy, reports: Sequence[TypeReport]) -> list[ast.expr]:
        """Return the values whose types tell more of reports."""
        asked: dict[int, ast.expr] = {}
        for report in reports:
            place = ReportedPlace(copy, report, self.context.behaviours.places)
            if report.kind not in self._readers or place.is_left_alone:
                continue
            for value in place.parts:
                if self._origins.doubts(place, value):
                    self.types[id(value)] = 'Any'
                else:
                    asked[id(value)] = value
        return [*asked.values()]

    def learn(
        self, copy: AnnotatedCopy, asked: Sequence[ast.expr], reports: Sequence[TypeReport]
    ) -> None:
        """Read the types of the values that were asked for."""
        values = {(copy.start(value), copy.end(value)): value for value in asked}
        for report in reports:
            start = report.line, copy.original_column(report.line, report.column)
            end_column = copy.original_column(report.end_line, report.end_column - 1)
            value = values.get((start, (report.end_line, end_column)))
            if report.kind == 'reveal-type' and value is not None:
                # What is known of its attributes comes last.
                shown = report.message.removeprefix('revealed type: ').partition(' (_.')[0]
                self.types[id(value)] = shown.removeprefix('Self@')

    def explain_all(
        self, copy: AnnotatedCopy, reports: Sequence[TypeReport]
    ) -> Iterator[tuple[Diagnostic, range]]:
        """Yield the findings in a module, with the lines of the statements that they are in."""
        for report in reports:
            place = ReportedPlace(copy, report, self.context.behaviours.places)
            reader = self._readers.get(report.kind)
            problem = reader(place) if reader and not place.is_left_alone else None
            if problem and place.is_chosen_by_file and not self._is_in_any_system(place, problem):
                continue
            if problem:
                yield self._finding(copy, self._use(place), problem), place.lines

    def _is_in_any_system(self, place: ReportedPlace, problem: _Problem) -> bool:
        """Return whether it is of a message that the function makes, or of a call's arguments."""
        node, rule, *_ = problem
        if place.report.kind in ('bad-argument-count', 'unexpected-keyword'):
            return True
        if 'parameters' in words_in(node):
            return False
        if rule == 'never-equal':
            left = self._origins.find(place, getattr(node, 'left', node))
            return not isinstance(left, Chain)
        if rule not in ('field-type', 'unknown-field'):
            return False
        used: list[ast.expr] = [node, *place.calls]
        for each in place.around:
            used += each.targets if isinstance(each, ast.Assign) else []
        origins = (self._origins.find(place, owner_of(each)) for each in used)
        return any(isinstance(each, Chain) and each.path[0] == 'made' for each in origins)

    @cached_property
    def _readers(self) -> Mapping[str, Callable[[ReportedPlace], _Problem | None]]:
        return {
            'bad-argument-count': self._count,
            'bad-argument-type': self._argument,
            'bad-index': self._index,
            'bad-return': self._return,
            'bad-specialization': self._bound,
            'incompatible-comparison': self._comparison,
            'invalid-yield': self._return,
            'missing-argument': self._missing,
            'missing-attribute': self._attribute,
            'no-matching-overload': self._argument,
            'not-callable': self._called,
            'not-iterable': self._iteration,
            'unbound-name': self._unbound,
            'unexpected-keyword': self._keyword,
            'unsupported-operation': self._operation,
        }

    def _finding(
        self, copy: AnnotatedCopy, use: FunctionUse | None, problem: _Problem
    ) -> Diagnostic:
        node, rule, message, advice = problem
        related: list[Related] = []
        for binding, _ in use.bindings[:1] if use else ():
            text = f'{binding.owner} is bound to it here'
            related.append(self.context.related_value(binding.behaviour.path, text))
        span = _span(copy, node, rule, message)
        return diagnostic_at(span, rule, message, help=advice, related=related)

    def _use(self, place: ReportedPlace) -> FunctionUse | None:
        uses = (use for use in self.functions.values() if use.definition in place.around)
        return next(uses, None)

    def _is_message(self, given: str) -> bool:
        """Return whether a class is that of one message, and of nothing in the project."""
        return bool(self.messages.get(given)) and given not in self.own.names

    # Attributes

    def _attribute(self, place: ReportedPlace) -> _Problem | None:
        match = _ATTRIBUTE.search(place.report.message)
        owner, name = match.groups() if match else ('', '_')
        found = (node for node in place.nodes if getattr(node, 'attr', '') == name)
        node, meant = next(found, None), _MEANT.search(place.report.message)
        if name.startswith('__' if owner in self.own.names else '_') or name in place.copy.asked:
            return None
        if not isinstance(node, ast.Attribute) or isinstance(node.ctx, ast.Del):
            return None
        advice = did_you_mean(meant[1] if meant else None)
        of_node = owner.removesuffix('Parameters').removesuffix('State')
        is_part = owner in ('Coroutine', *_PARTS)
        if owner in self.own.names or not (
            is_part or owner in self.messages or of_node in self.nodes
        ):
            return self._attribute_elsewhere(place, owner, node, meant[1] if meant else '')
        if not self._is_certain(place, node.value):
            return None
        if of_node in self.nodes:
            # The walk of behaviours finds other names that nodes do not have.
            is_found = owner != f'{of_node}Parameters' or place.depends_on_file
            return None if is_found else self._unknown_parameter(of_node, name, node)
        if owner in self.messages and not is_part:
            full_name = self.messages[owner]
            return self._unknown_field(full_name, name, node) if full_name else None
        rule, message = 'unknown-attribute', f"{_PARTS.get(owner)} has no attribute '{name}'"
        if owner == 'Coroutine':
            rule, advice = 'missing-await', 'put await before the call'
            message = f"'{name}' is read of a coroutine, which has not been awaited"
        return node, rule, message, advice

    def _attribute_elsewhere(
        self, place: ReportedPlace, owner: str, node: ast.Attribute, meant: str
    ) -> _Problem | None:
        """Return an attribute that a class of the project, or of Python, does not have."""
        name, imports = node.attr, place.copy.module.source.imports
        advice = did_you_mean(meant or None)
        of_interface = INTERFACE.search(imports.get(owner, ''))
        is_certain = bool(meant) and name not in self.own.stored and _is_misspelt(name, meant)
        if owner == 'object' and isinstance(node.value, ast.Call):
            # Of `super()`: no base has it.
            classes = (each for each in place.around if isinstance(each, ast.ClassDef))
            of = getattr(next(classes, None), 'name', '')
            is_certain = of in self.own.classes and of not in self.own.bases
            advice = 'remove it: the class inherits from nothing'
        elif owner in _PLAIN_OWNERS and not is_certain:
            is_certain = self._is_certain(place, node.value)
            advice = 'this is the value itself' if name == 'value' else advice
        elif owner in self.own.names and (of := self.own.classes.get(owner)):
            is_certain |= self._is_certain(place, node.value)
            # Types of Python leave out private names, and the object may be of a class that
            # inherits from this one.
            is_open = bool({name, ''} & self.own.stored) or (name[0] == '_' and bool(of.bases))
            made = self._origins.find(place, node.value)
            is_own = place.function in of.body or not isinstance(made, Instance | Class)
            is_certain &= not (is_open or (is_own and owner in self.own.bases))
        elif owner in self.own.names and not of_interface:
            is_certain = False
        elif of_interface and place.report.message.startswith('Class '):
            is_certain = True
            parts = PARTS_OF_KINDS.get(of_interface[1], ())
            advice = did_you_mean(find_nearest(name, parts), f'it has {", ".join(parts)}')
        if owner == 'Mapping' and is_certain:
            owner = ast.unparse(node.value)
            advice = f"write {owner}['{name}']"
        elif not is_certain:
            return None
        advice = self._place_of_constant(owner, name) or OF_RCLPY.get(name, advice)
        return node, 'unknown-attribute', f"'{owner}' has no attribute '{name}'", advice

    def _place_of_constant(self, owner: str, name: str) -> str | None:
        """Return the help for a constant that a part of a service or an action has."""
        for part in PARTS:
            if name in self.context.types.constants(self.messages.get(f'{owner}_{part}', '')):
                return f'write {owner}.{part}.{name}'
        return None

    def _name_of(self, owner: str) -> str:
        return next(iter(self.nodes[owner].values())).name

    def _unknown_parameter(self, owner: str, name: str, node: ast.expr) -> _Problem:
        message = f"node '{self._name_of(owner)}' declares no parameter '{name}'"
        known = dict(self.shapes[owner].parameters)
        advice = suggest(name, known, None, "declare it under 'parameters:'")
        return node, 'unknown-parameter', message, advice

    def _unknown_field(self, full_name: str, name: str, node: ast.expr) -> _Problem | None:
        description = self.context.types.describe(full_name)
        if description is None or description.field(name) is not None:
            return None
        problem = explain_unknown(self.context.types, description, name)
        return (node, 'unknown-field', *problem) if problem else None

    def _is_certain(self, place: ReportedPlace, value: ast.expr) -> bool:
        """Return whether a value has one type, beside `None`, however the code came there."""
        # What is calculated with an unset value is unknown.
        types = {*_alternatives(self.types.get(id(value), ''))} - {'None', 'Unknown'}
        is_open = len(types) > 1 or 'Any' in types
        return not (is_open or self._origins.doubts(place, value))

    # Arguments

    def _argument(self, place: ReportedPlace) -> _Problem | None:
        matches = _ARGUMENT.findall(place.report.message)
        if not matches:
            return None
        # If the name does not fit, the payload is compared with that of another name.
        wrong_names = [match for match in matches if match[1] == 'name']
        given, parameter, wanted, function = (wrong_names or matches)[-1]
        module, _, method = function.rpartition('.')
        owner = module.rpartition('.')[2]
        is_sent = owner in self.nodes and method in SENDING
        if is_sent and parameter in ('', 'name', 'payload'):
            return self._sent(place, owner, method, given)
        if not place.values:
            return self._overload(place)
        value, match = _assigned(place) or place.values[0], _MESSAGE.match(function)
        if match is not None:
            field = parameter if match[4] == '__init__' else match[4]
            description = self.context.types.describe(f'{match[1]}/{match[2]}/{match[3]}')
            if description is None:
                return None
            wanted_field = description.field(field)
            if wanted_field is None:
                return None
            return self._entry(description, field, wanted_field.type, value, given, is_stored=True)
        if function == 'list.append' and self._is_item(place, value, wanted, given):
            message = f'expected {self._shown(wanted)}, got {self._shown(given)}'
            return value, 'field-type', message, _call_of(value, given)
        return self._passed(place, value, given, wanted, parameter, function)

    def _is_item(self, place: ReportedPlace, value: ast.expr, wanted: str, given: str) -> bool:
        """Return whether a list that something is appended to takes only other types."""
        func = place.calls[0].func if place.calls else value
        of = self._origins.find(place, func.value) if isinstance(func, ast.Attribute) else None
        is_of_message = isinstance(of, Chain) and of.path[0] in ('message', 'made')
        is_wanted = is_of_message and (self._is_message(wanted) or wanted in _SCALARS)
        several = _alternatives(self.types.get(id(value), given))
        return is_wanted and all(map(self._is_known, several))

    def _overload(self, place: ReportedPlace) -> _Problem | None:
        """Return a message that a function of Python is given, which takes none."""
        function = _OVERLOADED.search(place.report.message)
        if function is None or function[1].partition('.')[0] not in OF_PYTHON:
            return None
        for call in place.calls[:1]:
            for value in call.args:
                given = self.types.get(id(value), '')
                if self._is_message(given) and self._is_certain(place, value):
                    message = f'{function[1]}() does not take {self._shown(given)}'
                    return value, 'bad-call', message, None
        return None

    def _passed(
        self,
        place: ReportedPlace,
        value: ast.expr,
        given: str,
        wanted: str,
        parameter: str,
        function: str,
    ) -> _Problem | None:
        """Return that a function of Python or of the node is given what it cannot take."""
        names, method = _certain(given), function.rpartition('.')[2]
        package = function.partition('.')[0]
        is_certain = self._is_certain(place, value)
        call = place.calls[0] if place.calls else None
        if call is not None and isinstance(value, ast.Constant):
            # What is called is of a message.
            func = call.func
            is_certain = isinstance(func, ast.Attribute) and self._is_certain(place, func)
        if package in ('composer', 'composer_stubs'):
            message = f"{method}() takes {_TAKEN.get(parameter, wanted)} as '{parameter}', got "
            if parameter == 'behaviour' and isinstance(value, ast.Call) and '|' not in given:
                function = ast.unparse(value.func)
                message += f'what {function}() returns'
                return value, 'bad-call', message, f'give the function itself: {function}'
            if names is None or not (is_certain or isinstance(value, ast.Constant)):
                return None
            return value, 'bad-call', f'{message}{self._shown(given)}', None
        # Functions of the same module have no module before their names.
        own = {name for _, name in self.functions}
        packages = {each.partition('.')[0] for each in self.modules}
        # A list of its own takes anything.
        if function in own or package in packages | _CONTAINERS:
            return None
        if given in self.nodes or (self.messages.get(given) and given not in self.own.names):
            what = 'a node' if given in self.nodes else self._shown(given)
            is_certain = self._is_certain(place, value)
        else:
            what = self._shown(given)
            is_certain &= names is not None and package in OF_PYTHON
        message = f'{function.removeprefix("builtins.")}() does not take {what}'
        return (value, 'bad-call', message, None) if is_certain else None

    def _sent(self, place: ReportedPlace, owner: str, method: str, given: str) -> _Problem | None:
        calls = (call for call in place.calls if getattr(call.func, 'attr', '') == method)
        call = next(calls, None)
        if call is None or any(isinstance(each, ast.Starred) for each in call.args):
            return None
        keywords = {each.arg: each.value for each in call.keywords}
        values = dict(zip(('name', 'payload'), call.args, strict=False)) | keywords
        name, payload = values.get('name'), values.get('payload')
        if None in keywords or name is None:
            return None
        section, part, _ = SENDING[method]
        noun = SENDING_METHODS[method]
        known = dict(getattr(self.shapes[owner], section))
        if not isinstance(name, ast.Constant):
            of_name = self.types.get(id(name), given)
            is_swapped = isinstance(payload, ast.Constant) and payload.value in known
            if not (self._is_message(of_name) or (is_swapped and given in _SCALARS - {'str'})):
                return None
            message = f'{method}(name, payload) takes the name first, got {self._shown(given)}'
            advice = 'swap the arguments' if is_swapped else suggest('', known, 'it declares')
            return name, 'bad-call', message, advice
        if name.value not in known:
            if '' in known or place.depends_on_file:
                return None
            message = f"node '{self._name_of(owner)}' declares no {noun} {name.value!r}"
            return name, f'unknown-{noun.replace(" ", "-")}', message, suggest(name.value, known)
        types = known[name.value]
        if payload is None or len(types) != 1 or not types[0]:
            return None
        problem = self._payload(f'{types[0]}{part}', payload, given)
        of_type = self.messages.get(self.types.get(id(payload), given))
        meant = [each for each, several in known.items() if f'{several[0]}{part}' == of_type]
        if problem and meant:
            problem = *problem[:3], f"'{meant[0]}' is of this type"
        return problem

    def _return(self, place: ReportedPlace) -> _Problem | None:
        use = self._use(place)
        if use is None or use.is_called:
            return None
        key = 'yielded' if place.report.kind == 'invalid-yield' else 'returned'
        names = {getattr(wire, key) for _, wire in use.bindings}
        full_name = names.pop() if len(names) == 1 else None
        match = _RETURNED.search(place.report.message)
        if full_name is None or match is None or match[1] == 'None' or not place.values:
            return None
        # `None` publishes nothing.
        return self._payload(full_name, place.values[0], match[1].removesuffix(' | None'))

    def _payload(self, full_name: str, value: ast.expr, given: str) -> _Problem | None:
        """Return what keeps a payload from becoming a message."""
        description = self.context.types.describe(full_name)
        if description is None:
            return None
        if isinstance(value, ast.Dict):
            return self._display(description, value)
        given = self.types.get(id(value), given)
        if len(description.fields) == 1:
            return self._misfit(description, description.fields[0].name, value, given)
        if self._may_fit(FieldType('message', full_name), given, is_stored=False):
            return None
        fields = ', '.join(field.name for field in description.fields)
        named = f'give its fields by name: {fields}' if fields else 'it has no fields: write {}'
        advice: str | None = named
        if self._is_message(given):
            advice = _field_of(description, self.messages[given])
        message = f'expected {in_python(full_name)}, got {self._shown(given)}'
        return value, 'field-type', message, _call_of(value, given) or advice

    def _display(self, description: MessageDescription, value: ast.Dict) -> _Problem | None:
        """Return what is wrong in a mapping that is written out: a key, or a value."""
        if not all(isinstance(key, ast.Constant) for key in value.keys):
            return None
        for key, entry in zip(value.keys, value.values, strict=True):
            name = str(getattr(key, 'value', ''))
            field = description.field(name)
            if field is None:
                names = [each.name for each in description.fields]
                error = unknown_field(in_python(description.name), name, names)
                return (key or entry), 'unknown-field', str(error), error.help
            problem = self._entry(description, name, field.type, entry)
            if problem:
                return problem
        return None

    def _entry(
        self,
        description: MessageDescription,
        name: str,
        of_type: FieldType,
        value: ast.expr,
        given: str = '',
        *,
        is_stored: bool = False,
    ) -> _Problem | None:
        """Return what is wrong with the value of a field, or with one of its items."""
        nested = of_type.nested and self.context.types.describe(of_type.nested)
        if isinstance(value, ast.List) and of_type.array:
            found = [
                self._entry(
                    description, name, of_type.item, each, is_stored=is_stored and _keeps(of_type)
                )
                for each in value.elts
            ]
            if any(found):
                return next(filter(None, found))
        if isinstance(value, ast.Dict) and nested and not (of_type.array or is_stored):
            return self._display(nested, value)
        given = self.types.get(id(value), '') or _type_of(value) or given
        given = given or _TYPES_OF_DISPLAYS.get(type(value), '')
        return self._misfit(description, name, value, given, of_type, is_stored=is_stored)

    def _misfit(
        self,
        description: MessageDescription,
        name: str,
        value: ast.expr,
        given: str,
        of_type: FieldType | None = None,
        *,
        is_stored: bool = False,
    ) -> _Problem | None:
        """Return what is wrong if no value of the type that is given fits a field, or its item."""
        field = description.field(name)
        if field is None:
            return None
        of_type, given = of_type or field.type, self.types.get(id(value), given)
        is_none = given == 'None' and is_stored and isinstance(value, ast.Constant)
        if not is_none and self._may_fit(of_type, given, is_stored=is_stored):
            return None
        advice = _call_of(value, given)
        names = _certain(given) or {''}
        if names == {'int'} and of_type.kind in _FLOATS:
            advice = advise_float(value)
        elif names <= {'bool', 'float', 'int'} and of_type.kind in ('string', 'wstring'):
            advice = advise_text(value)
        if given in _TIMES and _TIMES[given] == of_type.nested:
            text = ast.unparse(value)
            advice = (
                f'write ({text}).to_msg()' if isinstance(value, ast.BinOp) else 'write .to_msg()'
            )
        expected = in_python(of_type.nested) if of_type.nested else str(of_type)
        expected += '[]' if of_type.nested and of_type.array else ''
        message = f'{in_python(description.name)}: {name}: expected {expected}'
        return value, 'field-type', f'{message}, got {self._shown(given)}', advice

    def _may_fit(self, wanted: FieldType, given: str, *, is_stored: bool) -> bool:
        """Return whether a value of a type, or of one of several, may be a field's value."""
        return any(self._may_be(wanted, each, is_stored) for each in _without_none(given))

    def _may_be(self, wanted: FieldType, given: str, is_stored: bool) -> bool:  # noqa: FBT001
        base, _, inner = given.removesuffix(']').partition('[')
        nested = self.context.types.describe(wanted.nested) if wanted.nested else None
        if given in _TIMES:
            return not is_stored and not wanted.array and wanted.nested == _TIMES[given]
        if self._is_message(given) and nested and nested.name == self.messages[given]:
            return not wanted.array
        if base == 'dict':
            return bool(nested) and not (wanted.array or is_stored)
        if wanted.array and base in _COLLECTIONS:
            is_plain = base in ('list', 'set') and bool(inner)
            is_kept = is_stored and _keeps(wanted)
            return not is_plain or self._may_fit(wanted.item, inner, is_stored=is_kept)
        if wanted.nested and not wanted.array:
            if nested and len(nested.fields) == 1 and not is_stored:
                return self._may_be(nested.fields[0].type, given, is_stored)
            return nested is None or not self._is_known(given)
        if given in _SCALARS:
            return self._fits(wanted, given, is_stored)
        return not self._is_known(given)

    def _is_known(self, given: str) -> bool:
        """Return whether a type is one that no field takes, if it is not its own."""
        base = given.partition('[')[0]
        is_plain = given in self._plain or given in _SCALARS or base in _COLLECTIONS
        return is_plain or base == 'type' or _is_function(given) or self._is_message(given)

    def _fits(self, field_type: FieldType, given: str, is_stored: bool) -> bool:  # noqa: FBT001
        kind = field_type.kind
        if field_type.array:
            return given == 'bytes' and kind in OCTET_KINDS
        if kind in ('string', 'wstring'):
            return given == 'str'
        if kind in _FLOATS:
            return given == 'float' or (given in {'bool', 'int'} and not is_stored)
        if kind == 'byte':
            return given == 'bytes' or (given == 'int' and not is_stored)
        is_integer = kind in INTEGER_RANGES
        return given in {'bool', 'int'} if is_integer else given not in {'str', 'bytes', 'float'}

    def _shown(self, given: str) -> str:
        names = [
            in_python(self.messages.get(each, '')) or _PARTS.get(each, each)
            for each in _without_none(given)
        ]
        return 'a function' if _is_function(given) else ' | '.join(dict.fromkeys(names))

    # Calls, operators and comparisons

    def _keyword(self, place: ReportedPlace) -> _Problem | None:
        message = place.report.message
        keyword, function = _KEYWORD.search(message), _FUNCTION.search(message)
        if keyword is None or function is None or not place.calls:
            return None
        match = _MESSAGE.match(function[1])
        if match and match[4] == '__init__':
            value = [*place.values, *place.calls][0]
            return self._unknown_field(f'{match[1]}/{match[2]}/{match[3]}', keyword[1], value)
        method = function[1].removesuffix('.__init__').rpartition('.')[2]
        is_known = function[1].startswith(('composer_stubs.', 'composer.', 'rclpy.'))
        if not (is_known or method in self.own.classes):
            return None
        method = method.removeprefix('Rclpy')
        return place.calls[0], 'bad-call', f"{method}() takes no argument '{keyword[1]}'", None

    def _missing(self, place: ReportedPlace) -> _Problem | None:
        """Return that an object of the project is made without one of its values."""
        found = _MISSING.search(place.report.message)
        if found is None or found[2] not in self.own.classes or not place.calls:
            return None
        message = f"{found[2]}() is called without '{found[1]}'"
        return place.calls[0], 'bad-call', message, None

    def _unbound(self, place: ReportedPlace) -> _Problem | None:
        """Return a name that a function gives a value only later."""
        found = _UNBOUND.match(place.report.message)
        if found is None or not place.values:
            return None
        # The last round of a loop may have given it one.
        again = (each for each in place.around if isinstance(each, ast.For | ast.While))
        if any(found[1] in stored_names(each) for each in again):
            return None
        return place.values[0], 'undefined-name', f"'{found[1]}' has no value here yet", None

    def _count(self, place: ReportedPlace) -> _Problem | None:
        function = _FUNCTION.search(place.report.message)
        match = _MESSAGE.match(function[1]) if function else None
        time = _TIME.match(function[1]) if function else None
        if time and place.calls:
            advice = f'write {time[1]}(seconds=…)'
            return place.calls[0], 'bad-call', f'{time[1]} takes its values by name only', advice
        if function and function[1].startswith('composer_stubs.Logger.') and place.calls:
            advice = "put the values into it: f'{value}'"
            return place.calls[0], 'bad-call', 'the logger takes one text', advice
        if match is None or match[4] != '__init__' or not place.calls:
            return None
        full_name = in_python(f'{match[1]}/{match[2]}/{match[3]}')
        return place.calls[0], 'bad-call', f'{full_name} takes its fields by name only', None

    def _operation(self, place: ReportedPlace) -> _Problem | None:
        if _INDEXED.search(place.report.message):
            return self._index(place)
        match = _OPERANDS.search(place.report.message)
        values = [each for each in place.whole if isinstance(each, ast.BinOp | ast.Compare)]
        if match is None or not values:
            return None
        several = [_alternatives(each) for each in (match[2], match[3])]
        given = [each[0].partition('[')[0] if len(each) == 1 else '' for each in several]
        known = {*_TIMES, *filter(self._is_message, self.messages)}
        if not {*given} <= _PLAIN_OWNERS | known:
            return None
        parts = [node for node in ast.iter_child_nodes(values[0]) if isinstance(node, ast.expr)]
        parts = [part for part in parts if not isinstance(part, ast.Constant | ast.List)]
        if len(parts) == len(given):
            # No message goes with anything else.
            both = zip(parts, given, strict=True)
            parts = [part for part, each in both if self._is_message(each)] or parts
        if not all(self._is_certain(place, part) for part in parts):
            return None
        left, right = map(self._shown, given)
        message = f"'{match[1]}' is not possible between {left} and {right}"
        stamps = [each for each in given if self.messages.get(each) in _TIMES.values()]
        advice = f'write {stamps[0]}.from_msg(…)' if stamps else None
        return values[0], 'bad-call', message, advice

    def _bound(self, place: ReportedPlace) -> _Problem | None:
        """Return a message that a function compares, as `min` does."""
        given = re.match(r'`(\w+)` is not assignable to upper bound', place.report.message)
        if given is None or not place.calls or not self._is_message(given[1]):
            return None
        return place.calls[0], 'bad-call', f'{self._shown(given[1])} cannot be compared', None

    def _index(self, place: ReportedPlace) -> _Problem | None:
        """Return an item that a message, a number or an array does not have."""
        given = _INDEXED.search(place.report.message)
        values = [node for node in place.values if isinstance(node, ast.Subscript)]
        if given is None or not values or not self._is_certain(place, values[0].value):
            return None
        owner, key = given[1], values[0].slice
        if self._is_message(owner):
            advice = None
            if isinstance(key, ast.Constant) and isinstance(key.value, str):
                advice = f'write .{key.value}'
            return values[0], 'bad-call', f'{self._shown(owner)} has no items', advice
        if owner in ('array', 'list') and isinstance(key, ast.Constant):
            if isinstance(key.value, int):
                return None
            message = f'an array has items by number, not by {type(key.value).__name__}'
            return key, 'bad-call', message, None
        message = f"'{owner}' has no items"
        return (values[0], 'bad-call', message, None) if owner in _SCALARS - {'str'} else None

    def _iteration(self, place: ReportedPlace) -> _Problem | None:
        given = _UNARY.search(place.report.message)
        values: list[ast.expr] = [
            node for node in place.values if isinstance(node, ast.Attribute | ast.Name)
        ]
        for node in place.around:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
                values = [node.value]
        if given is None or not values or not self._is_certain(place, values[0]):
            return None
        if given[1] not in {'bool', 'float', 'int'} and not self._is_message(given[1]):
            return None
        return values[0], 'bad-call', f'{self._shown(given[1])} is not iterable', None

    def _called(self, place: ReportedPlace) -> _Problem | None:
        """Return an attribute that is no method, and is called."""
        owner = re.search(r'got `(\w+)`', place.report.message)
        what = owner[1] if owner and owner[1] not in self.own.names else ''
        for node in place.values:
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                is_certain = what in _SCALARS and self._is_certain(place, node.func)
                is_certain |= self._is_message(what)
                if is_certain or (what in _PARTS and isinstance(node.func.value, ast.Name)):
                    message = f"'{node.func.attr}' is {self._shown(what)}: no method"
                    return node.func, 'bad-call', message, None
        return None

    def _comparison(self, place: ReportedPlace) -> _Problem | None:
        """Return a field or a parameter that is compared with a constant of another type."""
        types = _COMPARED.search(place.report.message)
        # It is at what is compared, or at the constant.
        near = [*place.values, *place.around[:3]]
        found = [node for node in near if isinstance(node, ast.Compare)]
        if types is None or not found or len(found[0].ops) > 1:
            return None
        left, right = found[0].left, found[0].comparators[0]
        names = [_certain(types[1]), _certain(types[2])]
        of_interface = self._origins.find(place, right)
        is_constant = isinstance(right, ast.Constant) or isinstance(of_interface, External)
        is_plain = isinstance(left, ast.Attribute | ast.Name) and is_constant
        if not all(names) or not is_plain:
            return None
        if not self._is_certain(place, left):
            return None
        shown = ' and '.join(' | '.join(sorted(each or ())) for each in names)
        message = f'values of these types are never equal: {shown}'
        return found[0], 'never-equal', message, None


def _is_misspelt(name: str, meant: str) -> bool:
    """Return whether a name looks like another one; `_name` of Python is no `name`."""
    return is_typo(name, meant) and name.startswith('_') == meant.startswith('_')


def _assigned(place: ReportedPlace) -> ast.expr | None:
    """Return what is assigned, where a report is at its target."""
    is_target = isinstance(getattr(place.values[0], 'ctx', None), ast.Store)
    assigned = (each.value for each in place.around if isinstance(each, ast.Assign))
    return next(assigned, None) if is_target else None


def _field_of(description: MessageDescription, of_type: str) -> str | None:
    """Return the help for a message that is one of the fields of the one that is meant."""
    found = [
        each.name
        for each in description.fields
        if each.type.nested == of_type and not each.type.array
    ]
    return f'give it by the name of its field: {found[0]}' if found else None


def _keeps(array: FieldType) -> bool:
    """Return whether a message keeps the items of an array as they are; it converts numbers."""
    return bool(array.nested) or array.kind == 'byte'


def _alternatives(given: str) -> list[str]:
    """Return the types of a union, with that of a literal in its place."""
    try:
        pending: list[ast.expr] = [ast.parse(given, mode='eval').body]
    except SyntaxError:
        return [given]
    found: dict[str, None] = {}
    while pending:
        match pending.pop():
            case ast.BinOp(op=ast.BitOr(), left=left, right=right):
                pending += [right, left]
            case ast.Subscript(value=ast.Name(id='Literal'), slice=inner):
                for each in inner.elts if isinstance(inner, ast.Tuple) else [inner]:
                    # Of an enumeration, its class.
                    found[_type_of(each) or ast.unparse(getattr(each, 'value', each))] = None
            case ast.Name(id='LiteralString'):
                found['str'] = None
            case each:
                found[_type_of(each) or ast.unparse(each)] = None
    return [*found]


def _without_none(given: str) -> list[str]:
    """Return the types of a union beside `None`, unless that is all."""
    several = _alternatives(given)
    return [each for each in several if each != 'None'] or several


def _certain(given: str) -> set[str] | None:
    """Return the plain types that a value has; `None` if it may have others."""
    names = {*_alternatives(given)}
    return names if names <= _SCALARS else None


def _type_of(value: ast.expr) -> str:
    """Return the type of a constant, empty for anything else."""
    while isinstance(value, ast.UnaryOp):
        value = value.operand
    if not isinstance(value, ast.Constant):
        return ''
    return 'None' if value.value is None else type(value.value).__name__


def _is_function(given: str) -> bool:
    return '->' in given


def _call_of(value: ast.expr, given: str) -> str | None:
    """Return the help for a function or class that stands where its result is meant."""
    is_meant = _is_function(given) or given.startswith('type[')
    return f'call it: {ast.unparse(value)}()' if is_meant else None


def _span(copy: AnnotatedCopy, node: ast.expr, rule: str, message: str) -> Span:
    source = copy.module.source.source
    (line, column), (end_line, end) = copy.start(node), copy.end(node)
    if isinstance(node, ast.Attribute) and f"'{node.attr}'" in message:
        return Span(source, end_line, end - len(node.attr), len(node.attr))
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and rule != 'field-type':
        text = source.line(line)[column - 1 : end - 1]
        return Span(source, line, column, max(len(text), 1)).narrowed_to(node.value)
    return Span(source, line, column, max(end - column, 1) if line == end_line else 1)
