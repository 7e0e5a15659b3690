"""What a type checker reports, as findings: by their rules, with their places and words.

A report that says nothing certain of a node or a message is none.
"""

from __future__ import annotations

import ast
import builtins
import re
import sys
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias, cast

from composer.diagnostics import Span, diagnostic_at
from composer.interfaces.field_errors import unknown_field
from composer.interfaces.field_values import INTEGER_RANGES, OCTET_KINDS
from composer.interfaces.message_types import in_python
from composer.node_uses.message_uses import advise_float, advise_text, explain_unknown
from composer.node_uses.names import (
    Chain,
    Class,
    External,
    Instance,
    Names,
    Scope,
    find_stored,
)
from composer.node_uses.node_calls import OF_RCLPY
from composer.node_uses.reading import SENDING_METHODS
from composer.python_source.syntax import (
    list_arguments,
    owner_of,
    positional_names,
    stored_names,
    words_in,
)
from composer.records import record
from composer.spelling import did_you_mean, is_typo, suggest
from composer.stubs.checking.left_alone import ReportedPlace
from composer.stubs.node_stubs import SENDING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Related
    from composer.interfaces.descriptions import FieldType, MessageDescription
    from composer.language.specs import NodeSpec
    from composer.node_uses.names import Value
    from composer.python_source.module_finder import ModuleFinder
    from composer.python_source.syntax import FunctionNode
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
_DICT = re.compile(r'^dict\[str, (.*)\]$')
# A time of rclpy, which a message has beside it.
_TIME = re.compile(r'^rclpy\.\w+\.(Time|Duration)$')
_TIME_MESSAGE = re.compile(r'^builtin_interfaces\.msg\.(\w+)$')
_UNARY = re.compile(r'Type `([^`]+)` is not iterable')
_COMPARED = re.compile(r'between incompatible types `([^`]+)` and `([^`]+)`')
_ITEMS = re.compile(r'(?:list|set|tuple)\[([^\[\],]+)\]')
_INDEXED = re.compile(r'Cannot (?:index into|set item in) `(\w+)[^`]*`')
# A value that no plain field takes.
_COLLECTION = re.compile(r'(?:dict|list|set|tuple)\[[^|]*\]')
_PARTS = {
    'Logger': 'the logger',
    'Goal': 'a goal',
    'Time': 'a time',
    'Duration': 'a duration',
    'End': 'a subscription',
    'Publisher': 'a publisher',
}
# What arguments of the node's methods may be.
_TAKEN = {
    'behaviour': 'a function',
    'qos': 'a depth, the name of a profile, a mapping or a QoSProfile',
}
_INTERFACE = re.compile(r'\.(msg|srv|action)\.')
_DISPLAYS = (ast.Dict, ast.List, ast.ListComp, ast.Tuple)
_FLOATS = ('float32', 'float64')
_SCALARS = frozenset({'bool', 'bytes', 'float', 'int', 'str'})
_TIMES = frozenset({'Time', 'Duration'})
_TIME_MESSAGES = {f'msg.{each}': f'builtin_interfaces/msg/{each}' for each in sorted(_TIMES)}
# Functions and modules whose types are those of Python itself.
_OF_PYTHON = frozenset({*dir(builtins), *sys.stdlib_module_names})
# Classes of Python, of which fields and parameters are.
_PLAIN_OWNERS = _SCALARS | {'array', 'list', 'Mapping'}


class _Origins(Names):
    """What names stand for, also of what methods and sums give, and of items of anything."""

    def __init__(self, finder: ModuleFinder, functions: Iterable[FunctionUse]) -> None:
        super().__init__(finder)
        self._uses = {id(use.definition): use for use in functions}

    def find(self, place: ReportedPlace, value: ast.expr) -> Value | None:
        """Return what a value stands for at the place of a report."""
        scope = Scope(place.copy.module.source)
        for index, node in reversed([*enumerate(place.around)]):
            match node:
                case ast.FunctionDef() | ast.AsyncFunctionDef():
                    classes = (each for each in place.around if isinstance(each, ast.ClassDef))
                    of = next(classes, None)
                    instance = Instance(Class(scope.module, of)) if of else None
                    scope = Scope(scope.module, node, self._given_in(node, instance), scope)
                case ast.Lambda():
                    given = self._given_to(node, place.around[index:], scope)
                    scope = Scope(scope.module, node, given, scope)
                case ast.For(target=target) if not stored_names(target) & {*find_stored(node)}:
                    scope = _inside(ast.For(target, node.iter, [], []), scope)
                case ast.ListComp() | ast.SetComp() | ast.GeneratorExp() | ast.DictComp():
                    scope = _inside(node, scope)
        return self.value_of(value, scope)

    def _given_in(self, method: FunctionNode, instance: Instance | None) -> dict[str, Value]:
        use = self._uses.get(id(method))
        own = dict.fromkeys(positional_names(method)[:1], instance)
        return {name: each for name, each in own.items() if each} | (use.given if use else {})

    def _given_to(
        self, function: ast.Lambda, around: Sequence[ast.AST], scope: Scope
    ) -> dict[str, Value]:
        """Return what a function of one parameter is called with, if that is known."""
        call = next((each for each in around if isinstance(each, ast.Call)), None)
        match call, positional_names(function):
            case (
                ast.Call(
                    func=ast.Name(id='filter' | 'map' | 'max' | 'min' | 'sorted'),
                    args=[*first, items],
                ),
                [name],
            ) if first in ([], [function]):
                item = self._item_of(self.value_of(items, scope))
                return {name: item} if item else {}
        return {}

    def _value_of(self, node: ast.expr, scope: Scope) -> Value | None:
        match node:
            case ast.Await(value=inner):
                return self.value_of(inner, scope)
            case ast.BinOp(left=left):
                # A time plus something is a time.
                origin = self.value_of(left, scope)
                is_time = isinstance(origin, Chain) and origin.path[-2:] == ('now', '()')
                return origin if is_time else None
        return super()._value_of(node, scope)

    def _result_of(self, call: ast.Call, scope: Scope) -> Value | None:
        function = self.value_of(call.func, scope)
        if isinstance(function, Chain):
            return Chain((*function.path, '()'))
        return super()._result_of(call, scope)

    def _item_of(self, owner: Value | None, _index: ast.expr | None = None) -> Value | None:
        return Chain((*owner.path, '[]')) if isinstance(owner, Chain) else None


def _inside(loop: ast.AST, scope: Scope) -> Scope:
    """Return the scope of a loop, as that of a function without parameters."""
    no_arguments = ast.arguments([], [], None, [], [], None, [])
    function = ast.Lambda(no_arguments, cast('ast.expr', loop))
    return Scope(scope.module, function, {}, scope)


@record
class TypeFindings:
    """Turns reports into findings.

    Attributes:
        nodes: The nodes of each class in the stub, by their keys.
        shapes: What each of these classes has.
        functions: What is known of the project's functions.
        messages: The full names of messages, by their classes; of one that several have, empty.
        own: The names that the project itself defines, or imports from elsewhere.
        modules: The names of its modules.
        defined: What it gives to classes and objects; with an empty text, any name.
    """

    context: CheckContext
    nodes: Mapping[str, Mapping[str, NodeSpec]]
    shapes: Mapping[str, NodeShape]
    functions: Mapping[FunctionKey, FunctionUse]
    messages: Mapping[str, str]
    own: frozenset[str]
    modules: frozenset[str]
    defined: frozenset[str]

    @cached_property
    def _origins(self) -> _Origins:
        return _Origins(self.context.modules, self.functions.values())

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
        if rule not in ('field-type', 'unknown-field') or 'parameters' in words_in(node):
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
            'missing-attribute': self._attribute,
            'no-matching-overload': self._argument,
            'not-callable': self._called,
            'not-iterable': self._iteration,
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
        return bool(self.messages.get(given)) and given not in self.own

    # Attributes

    def _attribute(self, place: ReportedPlace) -> _Problem | None:  # noqa: C901
        match = _ATTRIBUTE.search(place.report.message)
        owner, name = match.groups() if match else ('', '_')
        found = (node for node in place.nodes if getattr(node, 'attr', '') == name)
        node, meant = next(found, None), _MEANT.search(place.report.message)
        if name.startswith('__' if owner in self.own else '_') or name in place.copy.asked:
            return None
        if not isinstance(node, ast.Attribute) or isinstance(node.ctx, ast.Del):
            return None
        advice = did_you_mean(meant[1] if meant else None)
        of_node = owner.removesuffix('Parameters').removesuffix('State')
        is_part = owner in ('Coroutine', *_PARTS)
        if owner in self.own or not (is_part or owner in self.messages or of_node in self.nodes):
            # A class of the project, or of Python: only what is misspelt is certain.
            is_typo_of = meant and name not in self.defined and _is_misspelt(name, meant[1])
            # What a name of the state stands for may change.
            is_value = owner in _SCALARS and '.state.' not in ast.unparse(node)
            if is_value and isinstance(node.value, ast.Attribute):
                is_typo_of = is_typo_of or self._is_of_one_type(place, node.value)
                advice = 'this is the value itself' if name == 'value' else advice
            if owner in _PLAIN_OWNERS:
                is_typo_of = is_typo_of or self._is_declared(place, node.value)
            if owner == 'Mapping' and is_typo_of:
                owner = ast.unparse(node.value)
                advice = f"write {owner}['{name}']"
            elif not (is_typo_of or self._is_set_by_nobody(place, owner, node)):
                return None
            advice = self._place_of_constant(owner, name) or OF_RCLPY.get(name, advice)
            return node, 'unknown-attribute', f"'{owner}' has no attribute '{name}'", advice
        if not self._is_of_one_type(place, node.value):
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

    def _is_set_by_nobody(self, place: ReportedPlace, owner: str, node: ast.Attribute) -> bool:
        """Return whether an attribute of the object itself, or a constant, is set nowhere.

        The object is made of just this class, as the file names it.
        """
        module, function = place.copy.module, place.function
        if {node.attr, ''} & self.defined:
            return False
        classes = [each for each in ast.walk(module.tree) if isinstance(each, ast.ClassDef)]
        own = [each for each in classes if each.name == owner]
        if node.attr.isupper() and place.report.message.startswith('Class '):
            # Of a class that the project writes out, or of the type of a service or an action.
            return bool(own or _INTERFACE.search(module.source.imports.get(owner, '')))
        names = (call.behaviour for use in self.functions.values() for call, _ in use.bindings)
        bound = {(each.module, each.class_name) for each in names}
        receiver = function.args.args[0].arg if function and function.args.args else None
        bases = {getattr(base, 'id', '') for each in classes for base in each.bases}
        return (
            (module.name, owner) in bound
            and owner not in bases
            and getattr(node.value, 'id', '') == receiver
            and any(function in each.body for each in own)
            and not any(each.decorator_list for each in own)
        )

    def _place_of_constant(self, owner: str, name: str) -> str | None:
        """Return the help for a constant that a part of a service or an action has."""
        for part in ('Goal', 'Result', 'Feedback', 'Request', 'Response'):
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

    def _is_of_one_type(self, place: ReportedPlace, value: ast.expr) -> bool:
        """Return whether a value is no union, of which reports name the part that does not fit."""
        if self._is_declared(place, value) or _is_annotated(place, value):
            return True
        value = owner_of(value)
        match self._origins.find(place, value):
            case Chain(path=(_,)):
                return True
            case External(name=name) if _INTERFACE.search(name):
                return True
        known: ast.AST | None = value
        if isinstance(value, ast.Name):
            stored = find_stored(place.function).get(value.id, [])
            known = stored[0][0] if len(stored) == 1 and not stored[0][1] else None
        return _is_made(place.copy.module.source.imports, known)

    def _is_declared(self, place: ReportedPlace, value: ast.expr) -> bool:
        """Return whether a value comes from the node or a message, in one way only.

        The state is left out: what a name of it stands for may change.
        """
        origin = self._origins.find(place, value)
        return isinstance(origin, Chain) and origin.path[1:2] != ('state',)

    # Arguments

    def _argument(self, place: ReportedPlace) -> _Problem | None:
        matches = _ARGUMENT.findall(place.report.message)
        if not matches:
            return None
        # If the name does not fit, the payload is compared with that of another name.
        wrong_names = [match for match in matches if match[1] == 'name']
        given, parameter, wanted, function = (wrong_names or matches)[-1]
        given = _TIME.sub(r'\1', given)
        module, _, method = function.rpartition('.')
        owner = module.rpartition('.')[2]
        is_sent = owner in self.nodes and method in SENDING
        if is_sent and parameter in ('', 'name', 'payload'):
            return self._sent(place, owner, method, given)
        if not place.values:
            return None
        value, match = place.values[0], _MESSAGE.match(function)
        for each in place.around:
            # As in `a.x = b.x = 1`.
            if isinstance(each, ast.Assign) and value in each.targets:
                value = each.value
        if match is not None:
            field = parameter if match[4] == '__init__' else match[4]
            description = self.context.types.describe(f'{match[1]}/{match[2]}/{match[3]}')
            if description is None:
                return None
            return self._misfit(description, field, value, given, is_stored=True)
        if function == 'list.append' and self.messages.get(wanted) and given in _SCALARS:
            message = f'expected {self._shown(wanted)}, got {given}'
            return value, 'field-type', message, None
        return self._passed(place, value, given, wanted, parameter, function)

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
        is_certain = self._is_declared(place, value)
        call = place.calls[0] if place.calls else None
        if call is not None and isinstance(value, ast.Constant):
            # What is called is of a message.
            func = call.func
            is_certain = isinstance(func, ast.Attribute) and self._is_declared(place, func)
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
        if function in self.defined or package in {
            each.partition('.')[0] for each in self.modules
        }:
            return None
        if given in self.nodes or (self.messages.get(given) and given not in self.own):
            what = 'a node' if given in self.nodes else self._shown(given)
            is_certain = self._is_of_one_type(place, value)
        else:
            what = self._shown(given)
            is_certain &= names is not None and package in _OF_PYTHON
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
            is_swapped = isinstance(payload, ast.Constant) and payload.value in known
            if not is_swapped or (given not in self.messages and given not in _SCALARS - {'str'}):
                return None
            message = f'{method}(name, payload) takes the name first, got {given}'
            return name, 'bad-call', message, 'swap the arguments'
        if name.value not in known:
            if '' in known or place.depends_on_file:
                return None
            message = f"node '{self._name_of(owner)}' declares no {noun} {name.value!r}"
            return name, f'unknown-{noun.replace(" ", "-")}', message, suggest(name.value, known)
        types = known[name.value]
        if payload is None or len(types) != 1 or not types[0]:
            return None
        return self._payload(f'{types[0]}{part}', payload, given)

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
            return self._display(description, value, given)
        if len(description.fields) == 1:
            return self._misfit(description, description.fields[0].name, value, given)
        is_other = self.messages.get(given, '') not in ('', full_name) and given not in _TIMES
        if not (is_other or _certain(given)):
            return None
        fields = ', '.join(field.name for field in description.fields)
        advice = f'give its fields by name: {fields}' if fields else 'it has no fields: write {}'
        message = f'expected {in_python(full_name)}, got {self._shown(given)}'
        return value, 'field-type', message, advice

    def _display(
        self, description: MessageDescription, value: ast.Dict, given: str
    ) -> _Problem | None:
        """Return what is wrong in a mapping that is written out: a key, or a value."""
        if not all(isinstance(key, ast.Constant) for key in value.keys):
            return None
        match = _DICT.match(given)
        for key, entry in zip(value.keys, value.values, strict=True):
            name = str(getattr(key, 'value', ''))
            if description.field(name) is None:
                names = [each.name for each in description.fields]
                error = unknown_field(in_python(description.name), name, names)
                return (key or entry), 'unknown-field', str(error), error.help
            problem = self._entry(description, name, entry, match[1] if match else '')
            if problem:
                return problem
        return None

    def _entry(
        self, description: MessageDescription, name: str, value: ast.expr, given: str
    ) -> _Problem | None:
        field = description.field(name)
        of_type = field.type if field else None
        if of_type and isinstance(value, _DISPLAYS) and not of_type.array:
            nested = of_type.nested and self.context.types.describe(of_type.nested)
            if nested and isinstance(value, ast.Dict):
                return self._display(nested, value, given)
            if of_type.nested and (not nested or len(nested.fields) <= 1):
                return None
            kind = 'dict' if isinstance(value, ast.Dict) else 'list'
            message = f'{in_python(description.name)}: {name}: expected {of_type}, got {kind}'
            return value, 'field-type', message, None
        given = type(value.value).__name__ if isinstance(value, ast.Constant) else given
        return self._misfit(description, name, value, given)

    def _misfit(
        self,
        description: MessageDescription,
        name: str,
        value: ast.expr,
        given: str,
        *,
        is_stored: bool = False,
    ) -> _Problem | None:
        """Return what is wrong if no value of the type that is given fits a field."""
        field = description.field(name)
        if field is None:
            return None
        is_wrong = self._is_other_message(field.type, given, is_stored=is_stored)
        is_single = not field.type.array and (is_stored or not field.type.nested)
        is_wrong |= is_stored and given == 'None' and isinstance(value, ast.Constant)
        is_wrong |= is_single and _COLLECTION.fullmatch(given) is not None
        names = _certain(given)
        fits = not names or any(self._fits(field.type, each, is_stored) for each in names)
        items = _ITEMS.fullmatch(given)
        if items and field.type.array and not field.type.nested:
            of_item = replace(field.type, array=None)
            names = _certain(items[1])
            fits = not names or any(self._fits(of_item, each, is_stored) for each in names)
        if fits and not is_wrong:
            return None
        is_int = is_stored and names == {'int'} and field.type.kind in _FLOATS
        advice = advise_float(value) if is_int else None
        if (
            names
            and names <= {'bool', 'float', 'int'}
            and field.type.kind in ('string', 'wstring')
        ):
            advice = advise_text(value)
        advice = 'write .to_msg()' if given in _TIMES else advice
        path = f'{in_python(description.name)}: {name}'
        expected = in_python(field.type.nested) if field.type.nested else str(field.type)
        expected += '[]' if field.type.nested and field.type.array else ''
        message = f'{path}: expected {expected}, got {self._shown(given)}'
        return value, 'field-type', message, advice

    def _is_other_message(self, field_type: FieldType, given: str, *, is_stored: bool) -> bool:
        if given in _TIMES:
            return is_stored and not field_type.array
        if not self._is_message(given) or field_type.array:
            return self._is_message(given)
        nested = self.context.types.describe(field_type.nested) if field_type.nested else None
        is_other = nested and len(nested.fields) > 1 and nested.name != self.messages[given]
        return bool(is_other) or not field_type.nested

    def _fits(self, field_type: FieldType, given: str, is_stored: bool) -> bool:  # noqa: FBT001
        kind = field_type.kind
        if field_type.array:
            return given == 'bytes' and kind in OCTET_KINDS
        if field_type.nested:
            nested = self.context.types.describe(field_type.nested)
            return nested is None or (len(nested.fields) <= 1 and not is_stored)
        if kind in ('string', 'wstring'):
            return given == 'str'
        if kind in _FLOATS:
            return given == 'float' or (given in {'bool', 'int'} and not is_stored)
        if kind == 'byte':
            return given == 'bytes' or (given == 'int' and not is_stored)
        is_integer = kind in INTEGER_RANGES
        return given in {'bool', 'int'} if is_integer else given not in {'str', 'bytes', 'float'}

    def _shown(self, given: str) -> str:
        if given in _TIMES:
            return f'{_PARTS[given]} of rclpy'
        if full_name := self.messages.get(given):
            return in_python(full_name)
        return _LITERAL.sub(_type_of_literal, given)

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
        if not function[1].startswith(('composer_stubs.', 'composer.', 'rclpy.')):
            return None
        method = function[1].removesuffix('.__init__').rpartition('.')[2]
        return place.calls[0], 'bad-call', f"{method}() takes no argument '{keyword[1]}'", None

    def _count(self, place: ReportedPlace) -> _Problem | None:
        function = _FUNCTION.search(place.report.message)
        match = _MESSAGE.match(function[1]) if function else None
        time = _TIME.match(function[1].removesuffix('.__init__')) if function else None
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
        values = [node for node in place.values if isinstance(node, ast.BinOp | ast.Compare)]
        if match is None or not values:
            return None
        given = [match[2], match[3]]
        given = [_LITERAL.sub(_type_of_literal, each).partition('[')[0] for each in given]
        given = [_TIME.sub(r'\1', _TIME_MESSAGE.sub(r'msg.\1', each)) for each in given]
        known = {*_TIMES, *_TIME_MESSAGES, *self.messages} - self.own
        if not {*given} <= _PLAIN_OWNERS | known:
            return None
        parts = [node for node in ast.iter_child_nodes(values[0]) if isinstance(node, ast.expr)]
        parts = [part for part in parts if not isinstance(part, ast.Constant | ast.List)]
        is_certain = self._is_of_one_type if {*given} & known else self._is_declared
        if not all(is_certain(place, part) for part in parts):
            return None
        shown = _PARTS | _TIME_MESSAGES
        left, right = (shown.get(each) or self._shown(each) for each in given)
        message = f"'{match[1]}' is not possible between {left} and {right}"
        stamps = [each for each in given if each in _TIME_MESSAGES]
        advice = f'write {stamps[0][4:]}.from_msg(…)' if stamps else None
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
        if given is None or not values or not self._is_declared(place, values[0].value):
            return None
        owner, key = given[1], values[0].slice
        if self._is_message(owner):
            advice = None
            if isinstance(key, ast.Constant) and isinstance(key.value, str):
                advice = f'write .{key.value}'
            return values[0], 'bad-call', f'{self._shown(owner)} has no items', advice
        if owner in ('array', 'list') and isinstance(key, ast.Constant):
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
        if given is None or not values or not self._is_of_one_type(place, values[0]):
            return None
        if given[1] not in {'bool', 'float', 'int'} and not self._is_message(given[1]):
            return None
        return values[0], 'bad-call', f'{self._shown(given[1])} is not iterable', None

    def _called(self, place: ReportedPlace) -> _Problem | None:
        """Return an attribute that is no method, and is called."""
        owner = re.search(r'got `(\w+)`', place.report.message)
        what = owner[1] if owner and owner[1] not in self.own else ''
        for node in place.values:
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                is_certain = what in _SCALARS and self._is_declared(place, node.func)
                if is_certain or (what in _PARTS and isinstance(node.func.value, ast.Name)):
                    message = f"'{node.func.attr}' is {_PARTS.get(what, what)}: no method"
                    return node.func, 'bad-call', message, None
        return None

    def _comparison(self, place: ReportedPlace) -> _Problem | None:
        """Return a field or a parameter that is compared with a constant of another type."""
        types = _COMPARED.search(place.report.message)
        # It is at what is compared, or at the constant.
        near = [*place.values, *place.around[:2]]
        found = [node for node in near if isinstance(node, ast.Compare)]
        if types is None or not found or len(found[0].ops) > 1:
            return None
        left, right = found[0].left, found[0].comparators[0]
        names = [_certain(types[1]), _certain(types[2])]
        is_plain = isinstance(left, ast.Attribute) and isinstance(right, ast.Constant)
        if not all(names) or not is_plain or not self._is_of_one_type(place, left):
            return None
        shown = ' and '.join(' | '.join(sorted(each or ())) for each in names)
        message = f'values of these types are never equal: {shown}'
        return found[0], 'never-equal', message, None


def _is_misspelt(name: str, meant: str) -> bool:
    """Return whether a name looks like another one; `_name` of Python is no `name`."""
    return is_typo(name, meant) and name.startswith('_') == meant.startswith('_')


def _is_made(imports: Mapping[str, str], value: ast.AST | None) -> bool:
    """Return whether an expression has the one type that the stubs give it."""
    match value:
        case ast.Await(value=inner):
            return _is_made(imports, inner)
        case ast.Call(func=ast.Name(id=name)):
            return bool(_INTERFACE.search(imports.get(name, '')))
        case ast.Call(func=ast.Attribute(value=ast.Attribute(attr='node' | '_node'))):
            return True
        case ast.Call(func=ast.Attribute()) | ast.Attribute() | ast.BinOp():
            return not words_in(value) & {'self', 'cls'}
    return False


def _is_annotated(place: ReportedPlace, value: ast.AST) -> bool:
    """Return whether the project annotates what a value is of, with the name of one class."""
    while isinstance(value, ast.Attribute) and not isinstance(value.value, ast.Name):
        value = value.value
    written: list[ast.expr | None] = []
    function, root = place.function, getattr(value, 'value', value)
    if (
        function is not None
        and isinstance(root, ast.Name)
        and root.id not in stored_names(function)
    ):
        arguments = list_arguments(function.args)
        written = [each.annotation for each in arguments if each.arg == root.id]
    if not any(written) and isinstance(value, ast.Attribute):
        classes = (each for each in place.around if isinstance(each, ast.ClassDef))
        written = [
            each.annotation
            for each in ast.walk(next(classes, ast.Pass()))
            if isinstance(each, ast.AnnAssign) and ast.unparse(each.target) == ast.unparse(value)
        ]
    names = [words_in(each) - {'None', 'Optional'} for each in written if each is not None]
    return bool(names) and all(len(each) == 1 for each in names)


def _type_of_literal(literal: re.Match[str]) -> str:
    return type(ast.literal_eval(literal[1])).__name__


def _certain(given: str) -> set[str] | None:
    """Return the plain types that a value has; `None` if it may have others."""
    names = {_LITERAL.sub(_type_of_literal, each) for each in given.split(' | ')}
    return names if names <= _SCALARS else None


def _span(copy: AnnotatedCopy, node: ast.expr, rule: str, message: str) -> Span:
    source = copy.module.source.source
    (line, column), (end_line, end) = copy.start(node), copy.end(node)
    if isinstance(node, ast.Attribute) and f"'{node.attr}'" in message:
        return Span(source, end_line, end - len(node.attr), len(node.attr))
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and rule != 'field-type':
        text = source.line(line)[column - 1 : end - 1]
        return Span(source, line, column, max(len(text), 1)).narrowed_to(node.value)
    return Span(source, line, column, max(end - column, 1) if line == end_line else 1)
