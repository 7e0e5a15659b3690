"""What a type checker reports, as findings: by their rules, with their places and words.

A report that says nothing certain of a node or a message is none.
"""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING, TypeAlias

from composer.diagnostics import Span, diagnostic_at
from composer.interfaces.field_errors import unknown_field
from composer.interfaces.field_values import INTEGER_RANGES, OCTET_KINDS
from composer.interfaces.message_types import in_python
from composer.records import record
from composer.spelling import did_you_mean, is_typo, suggest
from composer.stubs.checking.received_values import changed_names, payload_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Related, Remarks
    from composer.interfaces.descriptions import FieldType, MessageDescription
    from composer.language.specs import NodeSpec
    from composer.python_source.syntax import FunctionNode
    from composer.stubs.checking.left_alone import LeftAlone
    from composer.stubs.checking.received_values import FunctionKey, FunctionUse, Received
    from composer.stubs.checking.type_checker import TypeReport
    from composer.stubs.node_shapes import NodeShape, Types

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
_UNARY = re.compile(r'Type `([^`]+)` is not (?:iterable|awaitable)')
_COMPARED = re.compile(r'between incompatible types `([^`]+)` and `([^`]+)`')
# A value that no plain field takes.
_COLLECTION = re.compile(r'(?:dict|list|set|tuple)\[[^|]*\]')
_PARTS = {
    'Logger': 'the logger',
    'Goal': 'a goal',
    'Time': 'a time',
    'Duration': 'a duration',
}
_INTERFACE = re.compile(r'\.(msg|srv|action)\.')
_SECTIONS = {
    'publish': ('publishers', 'publisher', ''),
    'call': ('service_clients', 'service client', '_Request'),
    'call_async': ('service_clients', 'service client', '_Request'),
    'send_goal': ('action_clients', 'action client', '_Goal'),
}
_DISPLAYS = (ast.Dict, ast.List, ast.ListComp, ast.Tuple)
_FLOATS = ('float32', 'float64')
_TEXTS = ('string', 'wstring')
_SCALARS = frozenset({'bool', 'bytes', 'float', 'int', 'str'})
_TIMES = frozenset({'Time', 'Duration'})


@record
class TypeFindings:
    """Turns reports into findings.

    Attributes:
        nodes: The nodes of each class in the stub.
        shapes: What each of these classes has.
        functions: What is known of the project's functions.
        messages: The full names of messages, by their classes; of one that several have, empty.
        own: The names that the project itself defines, or imports from elsewhere.
        modules: The names of its modules.
        defined: What it gives to classes and objects, by whatever way.
    """

    context: CheckContext
    nodes: Mapping[str, Sequence[NodeSpec]]
    shapes: Mapping[str, NodeShape]
    functions: Mapping[FunctionKey, FunctionUse]
    messages: Mapping[str, str]
    own: frozenset[str]
    modules: frozenset[str]
    defined: frozenset[str]

    def explain_all(
        self, places: LeftAlone, reports: Sequence[TypeReport]
    ) -> Iterator[tuple[Diagnostic, range]]:
        """Yield the findings in a module, with the lines of the statements that they are in."""
        for finding in self._comparisons(places):
            if finding.span:
                yield finding, range(finding.span.line, finding.span.line + 1)
        for report in reports:
            explained = self.explain(places, report)
            if explained:
                yield explained, places.lines(report)

    def explain(self, places: LeftAlone, report: TypeReport) -> Diagnostic | None:
        """Return the finding, or `None` if there is none for certain."""
        reader = {
            'bad-argument-count': self._count,
            'bad-argument-type': self._argument,
            'bad-return': self._return,
            'bad-specialization': self._bound,
            'incompatible-comparison': self._comparison,
            'invalid-yield': self._return,
            'missing-attribute': self._attribute,
            'no-matching-overload': self._argument,
            'not-async': self._await,
            'not-callable': self._called,
            'not-iterable': self._iteration,
            'unexpected-keyword': self._keyword,
            'unsupported-operation': self._operation,
            'unused-coroutine': self._unused,
        }.get(report.kind)
        if reader is None or places.is_left_alone(report):
            return None
        problem = reader(places, report)
        if problem is None:
            return None
        node, rule, message, help_text = problem
        span = _span(places, node, rule, message)
        return diagnostic_at(span, rule, message, **self._remarks(places, report, help_text))

    def _remarks(self, places: LeftAlone, report: TypeReport, help_text: str | None) -> Remarks:
        use = self._use(places, report)
        return {'help': help_text, 'related': self._bound_at(use) if use else ()}

    def _bound_at(self, use: FunctionUse) -> list[Related]:
        return [
            self.context.related_value(
                binding.behaviour.path, f'{binding.owner} is bound to it here'
            )
            for _, binding in use.bindings[:1]
        ]

    def _use(self, places: LeftAlone, report: TypeReport) -> FunctionUse | None:
        definitions = {id(node) for node in places.around(report)}
        uses = (use for use in self.functions.values() if id(use.definition) in definitions)
        return next(uses, None)

    # Attributes

    def _attribute(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        match, meant = _ATTRIBUTE.search(report.message), _MEANT.search(report.message)
        if match is None or places.is_asked_for(match[2]):
            return None
        owner, name = match.groups()
        found = [
            node
            for node in places.at(report)
            if isinstance(node, ast.Attribute) and node.attr == name
        ]
        if not found or isinstance(found[0].ctx, ast.Del):
            return None
        if owner in self.own or not self._is_ours(owner):
            return self._misspelt(owner, name, found[0], meant[1] if meant else '')
        if not self._is_of_one_type(places, report, found[0].value):
            return None
        for suffix, rule in (('Parameters', 'unknown-parameter'), ('State', 'unknown-state')):
            if owner.endswith(suffix) and owner.removesuffix(suffix) in self.nodes:
                if places.depends_on_file(report):
                    return None
                return self._unknown_name(owner.removesuffix(suffix), rule, name, found[0])
        return self._unknown_of_ours(owner, name, found[0], meant[1] if meant else None)

    def _unknown_of_ours(
        self, owner: str, name: str, node: ast.expr, meant: str | None
    ) -> _Problem | None:
        if owner == 'Coroutine':
            message = f"'{name}' is read of a coroutine, which has not been awaited"
            return node, 'missing-await', message, 'put await before the call'
        if owner in self.nodes or owner in _PARTS:
            what = _PARTS.get(owner, 'the node')
            message = f"{what} has no attribute '{name}'"
            return node, 'unknown-attribute', message, did_you_mean(meant)
        full_name = self.messages.get(owner)
        return self._unknown_field(full_name, name, node) if full_name else None

    def _is_ours(self, owner: str) -> bool:
        """Return whether a class is one of the stubs, or what one of their methods makes."""
        of_node = owner.removesuffix('Parameters').removesuffix('State')
        ours = {'Coroutine', *_PARTS, *self.messages, *self.nodes}
        return owner in ours or of_node in self.nodes

    def _misspelt(self, owner: str, name: str, node: ast.expr, meant: str) -> _Problem | None:
        """Return an attribute of a class of the project, or of Python, that is certainly wrong."""
        if name in self.defined or not (meant and is_typo(name, meant)):
            return None
        message = f"'{owner}' has no attribute '{name}'"
        return node, 'unknown-attribute', message, did_you_mean(meant)

    def _unknown_name(self, owner: str, rule: str, name: str, node: ast.expr) -> _Problem:
        label = self.nodes[owner][0].name
        shape = self.shapes[owner]
        if rule == 'unknown-parameter':
            message = f"node '{label}' declares no parameter '{name}'"
            known: Types = shape.parameters
            advice = "declare it under 'parameters:'"
        else:
            message = f"neither 'state:' of node '{label}' nor a behaviour sets '{name}'"
            known, advice = shape.state or (), "declare it under 'state:'"
        return node, rule, message, suggest(name, [each for each, _ in known], None, advice)

    def _unknown_field(self, full_name: str, name: str, node: ast.expr) -> _Problem | None:
        description = self.context.types.describe(full_name)
        if description is None or description.field(name) is not None:
            return None
        constants = [constant.name for constant in description.constants]
        if name in constants or name.endswith('__DEFAULT'):
            return None
        names = [*(field.name for field in description.fields), *constants]
        error = unknown_field(in_python(full_name), name, names)
        return node, 'unknown-field', str(error), error.help

    def _is_of_one_type(self, places: LeftAlone, report: TypeReport, value: ast.expr) -> bool:
        """Return whether a value is no union, of which reports name the part that does not fit."""
        while isinstance(value, ast.Attribute | ast.Subscript):
            value = value.value
        if isinstance(value, ast.Await):
            value = value.value
        if not isinstance(value, ast.Name):
            return self._is_made(places, value)
        function = places.function(report)
        if function is None or value.id not in _stored(function):
            imported = places.copy.module.source.imports.get(value.id, '')
            use = self._use(places, report)
            return bool(use and value.id in use.received) or _is_interface(imported)
        values = _stored(function)[value.id]
        return len(values) == 1 and self._is_made(places, values[0])

    def _is_made(self, places: LeftAlone, value: ast.expr | None) -> bool:
        """Return whether an expression has the one type that the stubs give it."""
        match value:
            case ast.Await(value=inner):
                return self._is_made(places, inner)
            case ast.Call(func=ast.Name(id=name)):
                return _is_interface(places.copy.module.source.imports.get(name, ''))
            case ast.Call(func=ast.Attribute()) | ast.Attribute() | ast.BinOp():
                names = {node.id for node in ast.walk(value) if isinstance(node, ast.Name)}
                return not names & {'self', 'cls'}
        return False

    # Arguments

    def _argument(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        matches = _ARGUMENT.findall(report.message)
        if not matches:
            return None
        # If the name does not fit, the payload is compared with that of another name.
        wrong_names = [match for match in matches if match[1] == 'name']
        given, parameter, wanted, function = (wrong_names or matches)[-1]
        given = _TIME.sub(r'\1', given)
        module, _, method = function.rpartition('.')
        owner = module.rpartition('.')[2]
        if owner in self.nodes and method in _SECTIONS:
            return self._sent(places, report, owner, method, given)
        match = _MESSAGE.match(function)
        values = [node for node in places.at(report) if isinstance(node, ast.expr)]
        if not values:
            return None
        if match is None:
            if function == 'list.append' and self.messages.get(wanted) and given in _SCALARS:
                message = f'expected {self._shown(wanted)}, got {given}'
                return values[0], 'field-type', message, None
            return self._passed(places, report, values[0], given, function)
        field = parameter if match[4] == '__init__' else match[4]
        return self._stored(f'{match[1]}/{match[2]}/{match[3]}', field, values[0], given)

    def _passed(
        self, places: LeftAlone, report: TypeReport, value: ast.expr, given: str, function: str
    ) -> _Problem | None:
        """Return that a function of Python is given a node or a message that it cannot take."""
        is_own = function.partition('.')[0] in {
            name.partition('.')[0] for name in (*self.modules, 'composer', 'composer_stubs')
        }
        is_known = given in self.nodes or self.messages.get(given)
        if is_own or not is_known or given in self.own:
            return None
        if not self._is_of_one_type(places, report, value):
            return None
        what = 'a node' if given in self.nodes else self._shown(given)
        return (
            value,
            'bad-call',
            f'{function.removeprefix("builtins.")}() does not take {what}',
            None,
        )

    def _sent(
        self, places: LeftAlone, report: TypeReport, owner: str, method: str, given: str
    ) -> _Problem | None:
        call = next(
            (
                node
                for node in places.around(report)
                if isinstance(node, ast.Call) and getattr(node.func, 'attr', '') == method
            ),
            None,
        )
        if call is None or any(isinstance(each, ast.Starred) for each in call.args):
            return None
        keywords = {each.arg: each.value for each in call.keywords}
        values = dict(zip(('name', 'payload'), call.args, strict=False)) | keywords
        name, payload = values.get('name'), values.get('payload')
        if None in keywords or name is None:
            return None
        section, noun, part = _SECTIONS[method]
        known = dict(getattr(self.shapes[owner], section))
        if not isinstance(name, ast.Constant):
            is_swapped = isinstance(payload, ast.Constant) and payload.value in known
            if not is_swapped or (given not in self.messages and given not in _SCALARS - {'str'}):
                return None
            message = f'{method}(name, payload) takes the name first, got {given}'
            return name, 'bad-call', message, 'swap the arguments'
        if name.value not in known:
            if '' in known or places.depends_on_file(report):
                return None
            message = f"node '{self.nodes[owner][0].name}' declares no {noun} {name.value!r}"
            return name, f'unknown-{noun.replace(" ", "-")}', message, suggest(name.value, known)
        types = known[name.value]
        if payload is None or len(types) != 1 or not types[0]:
            return None
        return self._payload(f'{types[0]}{part}', payload, given)

    def _return(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        use = self._use(places, report)
        match = _RETURNED.search(report.message)
        if use is None or use.is_called:
            return None
        values = [node for node in places.at(report) if isinstance(node, ast.expr)]
        key = 'yielded' if report.kind == 'invalid-yield' else 'returned'
        names = {payload_of(node, each, getattr(each.key, key)) for node, each in use.bindings}
        full_name = names.pop() if len(names) == 1 else None
        if full_name is None:
            return None
        if match is None or match[1] == 'None':
            return _missing_return(use)
        return self._payload(full_name, values[0], match[1]) if values else None

    def _payload(self, full_name: str, value: ast.expr, given: str) -> _Problem | None:
        """Return what keeps a payload from becoming a message."""
        description = self.context.types.describe(full_name)
        if description is None:
            return None
        if isinstance(value, ast.Dict):
            return self._display(description, value, given)
        if len(description.fields) == 1:
            return self._misfit(description, description.fields[0].name, value, given)
        names = _certain(given)
        is_other = given in self.messages and self.messages[given] not in ('', full_name)
        if not (is_other and given not in _TIMES) and not (names and names <= _SCALARS):
            return None
        fields = ', '.join(field.name for field in description.fields)
        help_text = (
            f'give its fields by name: {fields}' if fields else 'it has no fields: write {}'
        )
        message = f'expected {in_python(full_name)}, got {self._shown(given)}'
        return value, 'field-type', message, help_text

    def _display(
        self, description: MessageDescription, value: ast.Dict, given: str
    ) -> _Problem | None:
        """Return what is wrong in a mapping that is written out: a key, or a value."""
        if not all(isinstance(key, ast.Constant) for key in value.keys):
            return None
        match = _DICT.match(given)
        inner = match[1] if match else ''
        for key, entry in zip(value.keys, value.values, strict=True):
            name = key.value if isinstance(key, ast.Constant) else ''
            field = description.field(name) if isinstance(name, str) else None
            if field is None:
                error = unknown_field(
                    in_python(description.name), name, [each.name for each in description.fields]
                )
                return (key or entry), 'unknown-field', str(error), error.help
            problem = self._entry(description, field.name, entry, inner)
            if problem:
                return problem
        return None

    def _entry(
        self, description: MessageDescription, name: str, value: ast.expr, given: str
    ) -> _Problem | None:
        field = description.field(name)
        nested = (
            field.type.nested and self.context.types.describe(field.type.nested) if field else None
        )
        if nested and isinstance(value, ast.Dict) and field and not field.type.array:
            return self._display(nested, value, given)
        if nested and isinstance(value, ast.List | ast.Tuple):
            entries = [entry for entry in value.elts if isinstance(entry, ast.Dict)]
            return next(filter(None, (self._display(nested, each, '') for each in entries)), None)
        if field and isinstance(value, _DISPLAYS) and not field.type.array:
            if field.type.nested:
                return None
            kind = 'dict' if isinstance(value, ast.Dict) else 'list'
            message = f'{in_python(description.name)}: {name}: expected {field.type}, got {kind}'
            return value, 'field-type', message, None
        if isinstance(value, ast.Constant):
            return self._misfit(description, name, value, type(value.value).__name__)
        return self._misfit(description, name, value, given)

    def _stored(self, full_name: str, name: str, value: ast.expr, given: str) -> _Problem | None:
        description = self.context.types.describe(full_name)
        if description is None:
            return None
        return self._misfit(description, name, value, given, is_stored=True)

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
        is_message = self._is_other_message(field.type, given, is_stored=is_stored)
        is_plain = not (field.type.array or field.type.nested)
        is_message |= is_plain and _COLLECTION.fullmatch(given) is not None
        names = _certain(given)
        fits = not names or any(self._fits(field.type, each, is_stored) for each in names)
        if fits and not is_message:
            return None
        help_text = None
        if is_stored and names == {'int'} and field.type.kind in _FLOATS:
            help_text = 'write it as a float: 1.0'
        if given in _TIMES:
            help_text = 'write .to_msg()'
        path = f'{in_python(description.name)}: {name}'
        expected = in_python(field.type.nested) if field.type.nested else str(field.type)
        message = f'{path}: expected {expected}, got {self._shown(given)}'
        return value, 'field-type', message, help_text

    def _is_other_message(self, field_type: FieldType, given: str, *, is_stored: bool) -> bool:
        if given in _TIMES:
            return is_stored and not field_type.array
        full_name = self.messages.get(given)
        if not full_name or given in self.own or field_type.array:
            return False
        if not field_type.nested:
            return True
        nested = self.context.types.describe(field_type.nested)
        return nested is not None and len(nested.fields) > 1 and nested.name != full_name

    def _fits(self, field_type: FieldType, given: str, is_stored: bool) -> bool:  # noqa: FBT001
        if field_type.array:
            return given == 'bytes' and field_type.kind in OCTET_KINDS
        if field_type.nested:
            nested = self.context.types.describe(field_type.nested)
            return nested is None or (len(nested.fields) <= 1 and not is_stored)
        if field_type.kind in _TEXTS:
            return given == 'str'
        if field_type.kind in _FLOATS:
            return given == 'float' or (given in {'bool', 'int'} and not is_stored)
        if field_type.kind == 'byte':
            return given == 'bytes' or (given == 'int' and not is_stored)
        if field_type.kind in INTEGER_RANGES:
            return given in {'bool', 'int'}
        return given not in {'str', 'bytes', 'float'}

    def _shown(self, given: str) -> str:
        if given in _TIMES:
            return f'{_PARTS[given]} of rclpy'
        if full_name := self.messages.get(given):
            return in_python(full_name)
        return _LITERAL.sub(lambda match: type(ast.literal_eval(match[1])).__name__, given)

    # Calls, operators and comparisons

    def _keyword(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        keyword, function = _KEYWORD.search(report.message), _FUNCTION.search(report.message)
        values = [node for node in places.at(report) if isinstance(node, ast.expr)]
        call = next((node for node in places.around(report) if isinstance(node, ast.Call)), None)
        if keyword is None or function is None or call is None:
            return None
        match = _MESSAGE.match(function[1])
        place = values[0] if values else call
        if match and match[4] == '__init__':
            return self._unknown_field(f'{match[1]}/{match[2]}/{match[3]}', keyword[1], place)
        if not function[1].startswith(('composer_stubs.', 'composer.')):
            return None
        method = function[1].rpartition('.')[2]
        return call, 'bad-call', f"{method}() takes no argument '{keyword[1]}'", None

    def _count(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        function = _FUNCTION.search(report.message)
        match = _MESSAGE.match(function[1]) if function else None
        call = next((node for node in places.around(report) if isinstance(node, ast.Call)), None)
        if match is None or match[4] != '__init__' or call is None:
            return None
        full_name = in_python(f'{match[1]}/{match[2]}/{match[3]}')
        return call, 'bad-call', f'{full_name} takes its fields by name only', None

    def _operation(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        match = _OPERANDS.search(report.message)
        values = [node for node in places.at(report) if isinstance(node, ast.BinOp | ast.Compare)]
        if match is None or not values:
            return None
        operands = {match[2], match[3]}
        known = {*_TIMES, *self.messages} - self.own
        if not operands & known or not operands <= _SCALARS | known:
            return None
        if not all(
            self._is_of_one_type(places, report, each)
            for each in _operands(values[0])
            if not isinstance(each, ast.Constant)
        ):
            return None
        left, right = (_PARTS.get(each) or self._shown(each) for each in (match[2], match[3]))
        message = f"'{match[1]}' is not possible between {left} and {right}"
        return values[0], 'bad-call', message, None

    def _bound(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        """Return a message that a function compares, as `min` does."""
        given = re.match(r'`(\w+)` is not assignable to upper bound', report.message)
        call = next((node for node in places.around(report) if isinstance(node, ast.Call)), None)
        if given is None or call is None or not self.messages.get(given[1]):
            return None
        if given[1] in self.own:
            return None
        return call, 'bad-call', f'{self._shown(given[1])} cannot be compared', None

    def _iteration(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        given = _UNARY.search(report.message)
        values = [node for node in places.at(report) if isinstance(node, ast.Attribute)]
        if given is None or not values or not self._is_of_one_type(places, report, values[0]):
            return None
        is_scalar = given[1] in {'bool', 'float', 'int'}
        if not is_scalar and (not self.messages.get(given[1]) or given[1] in self.own):
            return None
        return values[0], 'bad-call', f'{self._shown(given[1])} is not iterable', None

    def _await(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        given = _UNARY.search(report.message)
        values = [
            node.value if isinstance(node, ast.Await) else node
            for node in places.at(report)
            if isinstance(node, ast.Await | ast.Call)
        ]
        if given is None or not values or not self.messages.get(given[1]) or given[1] in self.own:
            return None
        message = 'what is awaited here is no coroutine'
        return values[0], 'missing-await', message, 'leave out the await'

    def _called(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        """Return an attribute of the node that is no method."""
        for node in places.at(report):
            match node:
                case ast.Call(func=ast.Attribute(value=ast.Name(), attr=name) as func):
                    owner = re.search(r'got `(\w+)`', report.message)
                    if owner and owner[1] in _PARTS.keys() - self.own:
                        return func, 'bad-call', f"'{name}' is {_PARTS[owner[1]]}: no method", None
        return None

    def _unused(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        for node in places.at(report):
            match node:
                case ast.Call(func=ast.Attribute(attr='call_async')):
                    message = f"'{ast.unparse(node.func)}(…)' is never awaited, so it never runs"
                    return node, 'missing-await', message, 'put await before it'
        return None

    def _comparison(self, places: LeftAlone, report: TypeReport) -> _Problem | None:
        """Return a field or a parameter that is compared with a constant of another type."""
        types = _COMPARED.search(report.message)
        found = [node for node in places.at(report) if isinstance(node, ast.Compare)]
        if types is None or not found or len(found[0].ops) > 1:
            return None
        left, right = found[0].left, found[0].comparators[0]
        names = [_certain(types[1]), _certain(types[2])]
        is_plain = isinstance(left, ast.Attribute) and isinstance(right, ast.Constant)
        if not all(names) or not is_plain or not self._is_of_one_type(places, report, left):
            return None
        shown = ' and '.join(' | '.join(sorted(each or ())) for each in names)
        message = f'values of these types are never equal: {shown}'
        return found[0], 'never-equal', message, None

    def _comparisons(self, places: LeftAlone) -> Iterator[Diagnostic]:
        """Yield the parameters that are compared with none of their choices.

        Type checkers take every text for possible there.
        """
        own = {id(node) for node in ast.walk(places.copy.module.tree)}
        for use in self.functions.values():
            if id(use.definition) not in own:
                continue
            for node in ast.walk(use.definition):
                problem = self._unknown_choice(use, node)
                if problem:
                    place, rule, message, help_text = problem
                    span = _span(places, place, rule, message)
                    related = self._bound_at(use)
                    yield diagnostic_at(span, rule, message, help=help_text, related=related)

    def _unknown_choice(self, use: FunctionUse, node: ast.AST) -> _Problem | None:
        match node:
            case ast.Match(subject=ast.Attribute() as subject, cases=cases):
                patterns = (each.pattern for each in cases)
                tests = (each.value for each in patterns if isinstance(each, ast.MatchValue))
                pairs = (ast.Compare(subject, [ast.Eq()], [test]) for test in tests)
                return next(
                    filter(None, (self._unknown_choice(use, each) for each in pairs)), None
                )
            case ast.Compare(
                left=ast.Attribute(
                    value=ast.Attribute(attr='parameters', value=ast.Name(id=owner)), attr=name
                ),
                ops=[ast.Eq() | ast.NotEq()],
                comparators=[ast.Constant(value=str() as value) as constant],
            ):
                received = use.received.get(owner)
                if received is None or received.is_open or owner in changed_names(use.definition):
                    return None
                choices = self._choices(received, name)
                if not choices or value in choices:
                    return None
                message = f"the parameter '{name}' is never '{value}'"
                return constant, 'never-equal', message, suggest(value, choices, 'it is one of')
        return None

    def _choices(self, received: Received, name: str) -> set[object]:
        """Return what a parameter of nodes may be; nothing if one of them has no choices."""
        nodes = {node.key: node for several in self.nodes.values() for node in several}
        found = [nodes[key].parameters.get(name) for key in received.nodes if key in nodes]
        if len(found) < len(received.nodes) or not all(each and each.choices for each in found):
            return set()
        return {choice for each in found if each for choice in each.choices or ()}


def _is_interface(full_name: str) -> bool:
    return bool(_INTERFACE.search(full_name))


def _operands(node: ast.expr) -> list[ast.expr]:
    if isinstance(node, ast.BinOp):
        return [node.left, node.right]
    return [node.left, *node.comparators] if isinstance(node, ast.Compare) else []


def _stored(function: FunctionNode) -> dict[str, list[ast.expr | None]]:
    """Return what a function assigns, by name; `None` for what no assignment shows."""
    stored: dict[str, list[ast.expr | None]] = {}
    shown: set[int] = set()
    for node in ast.walk(function):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    shown.add(id(target))
                    stored.setdefault(target.id, []).append(node.value)
        elif isinstance(node, ast.Name) and not (
            isinstance(node.ctx, ast.Load) or id(node) in shown
        ):
            stored.setdefault(node.id, []).append(None)
    return stored


def _missing_return(use: FunctionUse) -> _Problem | None:
    """Return that a function returns nothing anywhere."""
    returned = (
        node
        for node in ast.walk(use.definition)
        if isinstance(node, ast.Return) and node.value is not None
    )
    if any(returned) or any(isinstance(node, ast.Raise) for node in ast.walk(use.definition)):
        return None
    message = 'this function returns nothing, and the caller gets an error'
    name = ast.Name(use.definition.name, lineno=use.definition.lineno)
    keyword = 'async def ' if isinstance(use.definition, ast.AsyncFunctionDef) else 'def '
    name.col_offset = use.definition.col_offset + len(keyword)
    name.end_lineno, name.end_col_offset = name.lineno, name.col_offset + len(name.id)
    return name, 'missing-return', message, 'return something at its end'


def _certain(given: str) -> set[str] | None:
    """Return the plain types that a value has; `None` if it may have others."""
    names = {
        type(ast.literal_eval(match[1])).__name__ if (match := _LITERAL.fullmatch(each)) else each
        for each in given.split(' | ')
    }
    return names if names <= _SCALARS else None


def _span(places: LeftAlone, node: ast.expr, rule: str, message: str) -> Span:
    source = places.copy.module.source.place_of(1).source
    (line, column), (end_line, end) = places.start(node), places.end(node)
    if isinstance(node, ast.Attribute) and f"'{node.attr}'" in message:
        return Span(source, end_line, end - len(node.attr), len(node.attr))
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and rule != 'field-type':
        text = source.line(line)[column - 1 : end - 1]
        return Span(source, line, column, max(len(text), 1)).narrowed_to(node.value)
    return Span(source, line, column, max(end - column, 1) if line == end_line else 1)
