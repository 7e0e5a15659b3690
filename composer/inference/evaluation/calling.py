"""Calls: of whatever is called, with its arguments."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.inference.evaluation.library.known_values import NotKnownError, leaves_of
from composer.inference.evaluation.part import Part
from composer.inference.evaluation.signatures import (
    explain_misfit,
    plainly,
    signature_of,
    wrong_types,
)
from composer.inference.message_types import in_python
from composer.inference.reading import SENDING_METHODS
from composer.inference.ros_members import ros_members
from composer.inference.values import (
    CHOSEN,
    NODE,
    UNKNOWN,
    Argument,
    Arguments,
    BoundMethod,
    Class,
    Constant,
    External,
    Function,
    Generated,
    Instance,
    Mapping,
    Message,
    MessageClass,
    Partial,
    PartOfNode,
    Place,
    Primitive,
    Scalar,
    Sequence,
    Super,
    Unknown,
    Value,
    alternatives,
    chosen_by,
    is_chosen,
    is_none,
    join,
)
from composer.interfaces.field_errors import unknown_field

if TYPE_CHECKING:
    import inspect

    from composer.inference.scopes import Scope

# Methods that call a function with the arguments after it, and the position of the function.
_CALLING_LATER = {
    **dict.fromkeys(('call_soon', 'call_soon_threadsafe', 'callback', 'submit', 'to_thread'), 0),
    **dict.fromkeys(('call_at', 'call_later', 'run_in_executor'), 1),
}
# Functions that reach the variables of who calls them.
_REACHING_ALL = frozenset({f'builtins.{name}' for name in ('eval', 'exec', 'locals', 'vars')})


class Calls(Part):
    """Evaluates calls."""

    def call(self, node: ast.Call, scope: Scope, *, is_awaited: bool = False) -> Value:
        """Return what a call may return."""
        owner: Value = UNKNOWN
        if isinstance(node.func, ast.Attribute):
            owner = self._evaluator.evaluate(node.func.value, scope)
            at = Place(scope.module, node.func)
            function = self._evaluator.attributes.read(owner, node.func.attr, at)
        else:
            function = self._evaluator.evaluate(node.func, scope)
        arguments = self._arguments(node, scope, function)
        if any(isinstance(each, Unknown) for each in alternatives(function)):
            # It may be a method that changes what it is called on.
            for each in alternatives(owner):
                if isinstance(each, Instance | Class | Super):
                    self._evaluator.escape(each)
        place = Place(scope.module, node)
        self._note_keys(function, arguments)
        if function == External('builtins.super'):
            return _super_in(scope)
        if isinstance(function, External) and function.name in _REACHING_ALL:
            self._escape_scope(
                scope if function.name != 'builtins.vars' or not node.args else None
            )
        method = node.func.attr if isinstance(node.func, ast.Attribute) else ''
        if method in _CALLING_LATER or isinstance(function, External):
            arguments = _with_work(arguments, _CALLING_LATER.get(method))
        is_open = any(isinstance(each, Unknown) for each in alternatives(function))
        if is_open and method in SENDING_METHODS:
            # It may be the node, in another guise.
            name = arguments.get(0, 'name')
            if name is None or not isinstance(name.value, Constant):
                self._evaluator.run.reading.open_kinds.add(SENDING_METHODS[method])
        self._evaluator.call_places.append(place)
        if isinstance(function, Unknown):
            self._note_wait(node, arguments, scope)
        try:
            return join(
                self.invoke(each, arguments, place, waits=scope.waits, is_awaited=is_awaited)
                for each in self._fitting(function, arguments)
            )
        finally:
            self._evaluator.call_places.pop()

    def _escape_scope(self, scope: Scope | None) -> None:
        """Note that something unknown has all that is around a place."""
        while scope is not None:
            for each in list((scope.names or {}).values()):
                self._evaluator.escape(each)
            scope = scope.outer

    def _fitting(self, function: Value, arguments: Arguments) -> list[Value]:
        """Return which of several functions may be called so, or all if none may."""
        several = list(alternatives(function))
        if len(several) == 1:
            return several
        with self._evaluator.run.silence():
            found = [
                each
                for each in several
                if not isinstance(each, Function)
                or self._evaluator.functions.fits(each, arguments)
            ]
        return found or several

    def _note_wait(self, node: ast.Call, arguments: Arguments, scope: Scope) -> None:
        """Note a call of a method of what is kept in the state: `node.state.event.wait()`."""
        match node.func:
            case ast.Attribute(value=ast.Attribute(value=owner, attr=name), attr=method):
                with self._evaluator.run.silence():
                    is_state = self._evaluator.evaluate(owner, scope) == PartOfNode('state')
                if is_state:
                    place = Place(scope.module, node)
                    self._evaluator.waiting.call_held(name, method, arguments, place)

    def _note_keys(self, function: Value, arguments: Arguments) -> None:
        """Note that arguments decide which attribute or entry of a table is meant."""
        is_lookup = function == External('builtins.getattr') or (
            isinstance(function, BoundMethod) and isinstance(function.owner, Mapping)
        )
        for argument in arguments.positional if is_lookup else ():
            self._evaluator.run.decide(argument.value)

    def _arguments(self, node: ast.Call, scope: Scope, function: Value) -> Arguments:
        positional: list[Argument] = []
        named: list[tuple[str, Argument]] = []
        is_open = False
        for each in node.args:
            place = Place(scope.module, each)
            if is_open:
                # Nobody knows which position this has.
                self._evaluator.escape(self._evaluator.evaluate(each, scope))
            elif isinstance(each, ast.Starred):
                value = self._evaluator.evaluate(each.value, scope)
                try:
                    leaves = leaves_of(value, place)
                except NotKnownError:
                    is_open = True
                    self._evaluator.escape(value)
                    continue
                positional += [Argument(each.value, each.place) for each in leaves]
            else:
                positional.append(Argument(self._evaluator.evaluate(each, scope), place))
        for keyword in node.keywords:
            value = self._evaluator.evaluate(keyword.value, scope)
            if keyword.arg is not None:
                place = Place(scope.module, keyword)
                named.append((keyword.arg, Argument(value, place)))
            elif isinstance(value, Mapping) and not value.is_lost:
                is_open = is_open or value.is_open
                named += [
                    (key, Argument(*held))
                    for key, held in value.entries.items()
                    if isinstance(key, str)
                ]
            else:
                is_open = True
                place = Place(scope.module, keyword.value)
                self._evaluator.payloads.check_keywords(function, value, place)
                self._evaluator.escape(value)
        return Arguments(tuple(positional), tuple(named), is_open)

    def invoke(
        self,
        function: Value,
        arguments: Arguments,
        place: Place,
        *,
        waits: bool = True,
        is_awaited: bool = False,
    ) -> Value:
        """Return what a call of a value may return.

        Args:
            waits: Whether who calls the behaviour waits for the call.
            is_awaited: Whether its result is awaited at once.
        """
        match function:
            case BoundMethod(owner=Primitive() as owner, name=name):
                return self._evaluator.waiting.call(owner, name, arguments, place)
            case BoundMethod(owner=owner, name=name) if owner == NODE:
                self._evaluator.run.moves += 1
                self._fits('node', name, arguments, place)
                return self._evaluator.node_calls.call(
                    name, arguments, waits=waits, is_awaited=is_awaited
                )
            case BoundMethod(owner=Unknown(is_ros=True), name=name):
                self._fits_signature(name, ros_members()[name], arguments, place)
                self._evaluator.run.moves += 1
                self.escape_all(arguments)
                return PartOfNode('logger') if name == 'get_logger' else CHOSEN
            case BoundMethod(owner=Class() as owner):
                return self._evaluator.classes.subclasses(owner)
            case BoundMethod():
                owner, name = function.owner, function.name
                if isinstance(owner, PartOfNode):
                    self._fits(owner.name, name, arguments, place)
                if isinstance(owner, PartOfNode) and owner.name == 'goal':
                    waits = waits and (name != 'result_async' or is_awaited)
                    return self._evaluator.node_calls.call_goal(owner, name, place, waits=waits)
                return self._evaluator.containers.call_method(function, arguments, place)
            case MessageClass():
                return self._construct(function, arguments)
            case Function():
                is_late = self._evaluator.functions.is_coroutine(function) and not is_awaited
                return self._evaluator.functions.follow(
                    function, arguments, waits=waits and not is_late
                )
            case Partial():
                merged = Arguments(
                    (*function.arguments.positional, *arguments.positional),
                    (*function.arguments.named, *arguments.named),
                    function.arguments.is_open or arguments.is_open,
                )
                return self.invoke(
                    function.function, merged, place, waits=waits, is_awaited=is_awaited
                )
            case Class():
                return self._evaluator.classes.instantiate(function, arguments)
            case Instance():
                method = self._evaluator.classes.class_attribute(function.of, '__call__', function)
                if isinstance(method, Function):
                    return self.invoke(
                        method, arguments, place, waits=waits, is_awaited=is_awaited
                    )
            case External():
                if is_awaited:
                    self._evaluator.waiting.await_asyncio(function.name, arguments, place)
                return self._evaluator.library.call(function.name, arguments, place)
            case PartOfNode(name='parameters'):
                # Those with a prefix.
                self._evaluator.run.reading.open_kinds.add('parameter')
                return UNKNOWN
            case Message() | Constant() | Scalar() | Generated() | Mapping() | PartOfNode():
                self._refuse(function, place)
        self._evaluator.run.moves += 1
        self.escape_all(arguments)
        return Unknown(max(is_chosen(function), chosen_by(arguments)))

    def _refuse(self, function: Value, place: Place) -> None:
        """Report a call of what cannot be called; `None` may be something else later."""
        if is_none(function) or getattr(function, 'is_lost', False):
            return
        called = place.node.func if isinstance(place.node, ast.Call) else place.node
        text = 'this cannot be called'
        self._evaluator.run.report('bad-call', Place(place.module, called), text)

    def _fits(self, owner: str, name: str, arguments: Arguments, place: Place) -> bool:
        """Return whether a method can be called so; report it if not."""
        return self._fits_signature(name, signature_of(owner, name), arguments, place)

    def _fits_signature(
        self, name: str, signature: inspect.Signature | None, arguments: Arguments, place: Place
    ) -> bool:
        misfit = explain_misfit(signature, arguments) if signature else None
        if misfit is None:
            for argument, problem in wrong_types(signature, arguments) if signature else ():
                self._evaluator.run.report('bad-call', argument.place, problem)
            return True
        shown = plainly(signature) if signature else ''
        self._evaluator.run.report(
            'bad-call', place, f'{name}{shown} is called with other arguments: {misfit}'
        )
        return False

    def invoke_later(self, partial: Partial) -> None:
        """Note that something unknown may call a function with these arguments and others."""
        given = partial.arguments
        arguments = Arguments(given.positional, given.named, is_open=True)
        function = partial.function
        is_publish = function == BoundMethod(NODE, 'publish')
        if given.positional and (isinstance(function, Function) or is_publish):
            with self._evaluator.run.condition():
                self.invoke(function, arguments, given.positional[0].place, waits=False)
        else:
            self._evaluator.escape(function)
            self.escape_all(given)

    def escape_all(self, arguments: Arguments) -> None:
        """Note that something unknown has the arguments."""
        for argument in arguments.all():
            self._evaluator.escape(argument.value)

    def _construct(self, function: MessageClass, arguments: Arguments) -> Value:
        """Check the fields that a message is made with."""
        evaluator = self._evaluator
        description = evaluator.run.types.describe(function.type)
        made = Message(function.type, is_made=True)
        if description is None:
            self.escape_all(arguments)
            return made
        shown = in_python(function.type)
        if arguments.positional:
            evaluator.run.report(
                'bad-call',
                arguments.positional[0].place,
                f'{shown} takes its fields by name only',
                'write the name of the field before the value: name=value',
            )
        for name, argument in arguments.named:
            field = description.field(name)
            if field is not None:
                evaluator.payloads.check_field(
                    function.type, field, argument.value, argument.place
                )
            elif name != 'check_fields':
                names = [each.name for each in description.fields]
                error = unknown_field(function.type, name, names)
                message = str(error).replace(function.type, shown)
                evaluator.run.report('unknown-field', argument.place, message, error.help)
        return made


def _with_work(arguments: Arguments, position: int | None) -> Arguments:
    """Return arguments in which a function and what it will be called with are one."""
    named = dict(arguments.named)
    work, given = named.get('target'), named.get('args')
    if work is not None and given is not None and isinstance(given.value, Sequence):
        rest = Arguments(tuple(Argument(*item) for item in given.value.items))
        later = Argument(Partial(work.value, rest), work.place)
        others = [(name, each) for name, each in arguments.named if name not in ('target', 'args')]
        return Arguments(arguments.positional, (*others, ('target', later)), arguments.is_open)
    if position is None or len(arguments.positional) <= position or arguments.is_open:
        return arguments
    work = arguments.positional[position]
    if not isinstance(work.value, Function | BoundMethod):
        return arguments
    rest = Arguments(arguments.positional[position + 1 :])
    return Arguments(
        (*arguments.positional[:position], Argument(Partial(work.value, rest), work.place)),
        arguments.named,
    )


def _super_in(scope: Scope) -> Value:
    """Return what `super()` gives in a method."""
    current: Scope | None = scope
    while current is not None:
        function = current.function
        if function is not None and function.of is not None:
            owner = function.owner
            return UNKNOWN if owner is None else Super(function.of, owner)
        current = current.outer
    return UNKNOWN
