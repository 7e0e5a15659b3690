"""Read behaviours: each function once, for all nodes that it is bound to."""

from __future__ import annotations

import ast
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

from composer.entity_kinds import TRANSITION_BEHAVIOURS
from composer.node_uses.names import (
    Chain,
    Class,
    Function,
    Instance,
    Names,
    Scope,
    Value,
    is_of_project,
)
from composer.node_uses.reading import (
    CREATING_METHODS,
    SENDING_METHODS,
    USED_NOUNS,
    Payload,
    Reading,
    Wire,
    missing_reading,
    unknown_reading,
    wire_of,
)
from composer.node_uses.walk import Places, TooLongError, Walk
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.modules import ModuleSource
from composer.python_source.return_values import ends_without_value, never_returns
from composer.python_source.syntax import FUNCTIONS, is_none, list_children, own_nodes
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator

    from composer.language.bindings import Binding
    from composer.language.specs import EndSpec, NodeSpec
    from composer.python_source.module_finder import ModuleFinder
    from composer.yaml_text.positions import DataPath

# That a call may raise is no way to end a loop.
_WAYS_OUT = (ast.Break, ast.Return, ast.Raise)
_ENDLESS = 'this loop never ends, and nothing else of its callback group runs again'
_BY_TIMER = 'let a timer call the behaviour'
# What the behaviours of these keys return: the types, and what to return instead.
_TRANSITION: tuple[set[type], str] = ({bool, type(None)}, 'False if it failed, or nothing')
_ANSWERS: dict[str, tuple[set[type], str]] = {
    'accept': ({bool, str, type(None)}, 'whether to accept, or why not'),
    'on_parameters': ({str, type(None)}, 'None, or why not'),
}

_TYPES = {ast.Compare: bool, ast.Dict: dict, ast.List: list, ast.JoinedStr: str}
_FUNCTIONS = (*FUNCTIONS, ast.Lambda)
# What code may hand on to use or create any of a kind.
_OPENING = {
    'own_state': 'own_state',
    'parameters': 'parameter',
    'publishers': 'publisher',
    **{method: f'new {noun}' for method, noun in CREATING_METHODS.items()},
    **SENDING_METHODS,
}


@dataclass(slots=True)
class Mentions:
    """What code may use.

    Attributes:
        names: Its texts, the attributes that it names, and the globals that it stores.
        stored: Those of the names that it may set in the state, or create.
        open_kinds: The kinds of which it may use any, and as in `new publisher` create any.
    """

    names: set[str] = field(default_factory=set)
    stored: set[str] = field(default_factory=set)
    open_kinds: set[str] = field(default_factory=set)


class BehaviourReader:
    """Reads what behaviours do.

    Args:
        has_real_type: Whether the type of an entity is the one that is meant.

    Attributes:
        places: As of a `Walk`, of all behaviours that were read.
    """

    def __init__(self, modules: ModuleFinder, has_real_type: Callable[[EndSpec], bool]) -> None:
        self._finder = modules
        self._names = Names(modules)
        self._has_real_type = has_real_type
        self._read: dict[object, Reading] = {}
        self._wires: dict[DataPath, Wire] = {}
        self._mentions: dict[int, Mentions] = {}
        self.places: Places = {}

    def read(self, node: NodeSpec, binding: Binding) -> Reading:
        """Return what a behaviour does with its node."""
        wire = self.wire_of(node, binding)
        ends = (wire.needs_payload, wire.is_unpublished, binding.may_yield)
        key = (binding.behaviour.name, binding.key, ends)
        if key not in self._read:
            self._read[key] = self._read_anew(binding, wire)
        return self._read[key]

    def wire_of(self, node: NodeSpec, binding: Binding) -> Wire:
        """Return the types around a behaviour."""
        place = binding.behaviour.path
        if place not in self._wires:
            self._wires[place] = wire_of(node, binding, self._has_real_type)
        return self._wires[place]

    def mentions(self, *readings: Reading) -> Mentions:
        """Return what the modules of behaviours may use beside what was read of them."""
        found = Mentions()
        parts: dict[int, Any] = {id(each): each for each in readings}
        for each in readings:
            parts |= each.modules
        for key, part in parts.items():
            if key not in self._mentions:
                is_module = isinstance(part, ModuleSource)
                unread = _unread(part, self.places) if is_module else part.unresolved
                self._mentions[key] = _find_mentions(unread)
            for kept in fields(found):
                getattr(found, kept.name).update(getattr(self._mentions[key], kept.name))
        return found

    def _read_anew(self, binding: Binding, wire: Wire) -> Reading:
        behaviour = binding.behaviour
        module = self._finder.find(behaviour.module)
        if not isinstance(module, ModuleSource):
            return missing_reading()
        if not is_of_project(module, behaviour.module, self._finder):
            return unknown_reading()
        self._names.find_module(behaviour.module)
        function = self._function(module, binding)
        if function is None:
            top = module.top
            name = behaviour.class_name or behaviour.function
            is_missing = not (name in top.statements or top.is_open or top.is_dynamic)
            return missing_reading() if is_missing else unknown_reading()
        walk = Walk(self._names, self.places)
        try:
            second = 'changes' if binding.parameters[-1] == 'changes' else 'message'
            values = [Chain(('node',)), Chain((second,))][: len(binding.parameters)]
            given: dict[str, Value] = dict(zip(function.parameters, values, strict=False))
            if len(given) < len(values) and function.definition.args.vararg is None:
                # Which of them it lacks, nobody knows.
                return unknown_reading()
            walk.enter(function, {**given}, is_waited=True, is_call=False)
            _Results(walk, function, given, binding, wire).note()
            if len(given) < len(binding.parameters):
                walk.run.reading.open_all()
        except (RecursionError, TooLongError):
            return unknown_reading()
        return walk.run.reading

    def _function(self, module: ModuleSource, binding: Binding) -> Function | None:
        behaviour = binding.behaviour
        if not behaviour.class_name:
            value = self._names.top_value(module, behaviour.function)
        else:
            of = self._names.top_value(module, behaviour.class_name)
            if not isinstance(of, Class) or of.definition.keywords:
                return None
            # The object is made with the node.
            init = self._names.attribute(Instance(of), '__init__')
            names = init.parameters[:1] if isinstance(init, Function) else []
            made = Instance(of, tuple((name, Chain(('node',))) for name in names))
            value = self._names.attribute(made, behaviour.method_name)
        return value if isinstance(value, Function) else None


@record
class _Results:
    """Notes what a behaviour gives away, and whether it comes to an end."""

    walk: Walk
    function: Function
    given: dict[str, Value]
    binding: Binding
    wire: Wire

    @cached_property
    def kind(self) -> FunctionKind | None:
        definition = self.function.definition
        if isinstance(definition, ast.Lambda):
            return FunctionKind.PLAIN
        return self.walk.run.names.kind_of(definition)

    @cached_property
    def scope(self) -> Scope:
        return Scope(self.function.module, self.function.definition, self.given)

    def note(self) -> None:
        """Note all of it."""
        definition = self.function.definition
        if isinstance(definition, ast.Lambda):
            return
        bound = self.function.bound
        if isinstance(bound, Instance):
            # The object whose method it is has been made, too.
            init = self.walk.run.names.attribute(bound, '__init__')
            if isinstance(init, Function):
                self.walk.enter(init, {**dict(bound.given)}, is_waited=True, is_call=False)
        is_generator = self.kind is not None and self.kind.is_generator
        is_returned = self.function.is_returned
        for node in own_nodes(definition):
            match node:
                case ast.Return(value=ast.expr() as value) if is_returned:
                    self._note_payload(value, 'returned')
                    self._check_answer(value)
                case ast.Yield(value=ast.expr() as value) if is_generator and is_returned:
                    self._note_payload(value, 'yielded')
                case ast.While(test=test) if self._is_endless(node):
                    run, module = self.walk.run, self.function.module
                    run.report('endless-loop', module, test, _ENDLESS, _BY_TIMER)
        is_last = self.kind is FunctionKind.ASYNC_GENERATOR
        is_allowed = is_returned and (self.binding.may_yield or not is_generator)
        # The last one that an asynchronous generator yields is the result.
        if self.wire.needs_payload and is_allowed and not is_last:
            self._check_ways(definition)

    def _note_payload(self, value: ast.expr, key: str) -> None:
        module = self.function.module
        is_last = self.kind is FunctionKind.ASYNC_GENERATOR
        if not is_none(value) and not is_last:
            self.walk.run.reading.payloads.append(Payload('', key, '', value, module, True))
            for node in value.values if isinstance(value, ast.Dict) else [value]:
                if self.wire.returned or self.wire.yielded:
                    self.walk.need(node, self.scope)
        if self.wire.is_unpublished and _is_made_there(value):
            self.walk.run.reading.unpublished.append(module.span_of(value))

    def _is_endless(self, loop: ast.While) -> bool:
        """Return whether nothing else of the group runs once a loop has begun."""
        kind = self.binding.kind
        # Goals have threads of their own.
        if self.kind is not FunctionKind.PLAIN or (kind is not None and kind.channel == 'action'):
            return False
        is_always_true = isinstance(loop.test, ast.Constant) and bool(loop.test.value)
        return is_always_true and not any(isinstance(node, _WAYS_OUT) for node in own_nodes(loop))

    def _check_answer(self, value: ast.expr) -> None:
        """Check what `accept`, `on_parameters` and transitions return."""
        key = self.binding.key.key
        wanted, advice = _ANSWERS.get(key, _TRANSITION)
        if key not in _ANSWERS and key not in TRANSITION_BEHAVIOURS:
            return
        kind = _type_of(value)
        if kind is not None and kind not in wanted:
            text = f'{self.binding.owner} returns a {kind.__name__}'
            module = self.function.module
            self.walk.run.report('bad-answer', module, value, text, f'return {advice}')

    def _check_ways(self, definition: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        """Check that all ways give the response or result that is waited for."""
        plain = (each.value if isinstance(each, ast.Expr) else each for each in definition.body)
        if all(isinstance(each, ast.Constant | ast.Pass) for each in plain):
            return  # It is still to be written: it has a docstring, `...` or `pass`.
        names, module = self.walk.run.names, self.function.module

        def is_last(call: ast.Call) -> bool:
            called = names.value_of(call.func, self.scope)
            last = called.definition if isinstance(called, Function) else None
            return last is not None and not isinstance(last, ast.Lambda) and never_returns(last)

        ends = ends_without_value(definition, is_last)
        bare = next((end for end in ends if end is not definition), None)
        if ends:
            text = 'some ways through this function return nothing, and the caller gets an error'
            help_text = 'return something at its end'
            place = definition if bare is None or definition in ends else bare
            self.walk.run.report('missing-return', module, place, text, help_text)


def _is_made_there(node: ast.expr) -> bool:
    """Return whether an expression is a dictionary, or makes an object of a class."""
    called = node.func if isinstance(node, ast.Call) else None
    name = str(getattr(called, 'id', None) or getattr(called, 'attr', ''))
    return isinstance(node, ast.Dict) or name[:1].isupper()


def _type_of(value: ast.expr) -> type | None:
    if isinstance(value, ast.Constant):
        return type(value.value)
    if isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.Not):
        return bool
    return _TYPES.get(type(value))


def _find_mentions(nodes: Iterable[ast.AST]) -> Mentions:
    """Return what code may use of which nobody knows whether it is of the node."""
    found = Mentions()
    # What names all that it is used for.
    plain: set[int] = set()
    for node in nodes:
        match node:
            case ast.Constant(value=str(text)):
                found.names.add(text)
            case ast.Global(names=names):
                found.names.update(names)
            case ast.Attribute(value=inner, attr=name):
                found.names.add(name)
                if isinstance(node.ctx, ast.Store) and getattr(inner, 'id', '') != 'self':
                    found.stored.add(name)
                if name in _OPENING and id(node) not in plain:
                    found.open_kinds.add(_OPENING[name])
                if name == 'get' or not hasattr(dict, name):
                    plain.add(id(inner))
            case ast.Subscript(value=inner, slice=ast.Constant(value=str(text))):
                plain.add(id(inner))
                found.names.add(text)
                found.stored |= {text} if isinstance(node.ctx, ast.Store) else set()
            case ast.Call(func=ast.Name(id='setattr'), args=[_, ast.Constant(value=str(text)), _]):
                found.stored.add(text)
            case ast.Call(func=ast.Name(id='setattr'), args=[ast.Attribute(attr='state'), *_]):
                found.open_kinds.add('state')
            case ast.Call(func=ast.Name('exec' | 'eval')):
                found.open_kinds |= USED_NOUNS
            case ast.Call(func=ast.Attribute(attr=method) as func) if method in _OPENING:
                keys = ('name', 'topic', 'srv_name')
                named = [each.value for key in keys for each in node.keywords if each.arg == key]
                match [*named, *node.args[method in CREATING_METHODS :]]:
                    case [ast.Constant(value=str(text)), *_]:
                        plain.add(id(func))
                        found.stored |= {text} if method in CREATING_METHODS else set()
    return found


def _unread(module: ModuleSource, followed: Collection[int]) -> Iterator[ast.AST]:
    """Yield the nodes of classes and of functions that were not followed."""
    pending: list[tuple[ast.AST, bool]] = [(each, False) for each in module.body]
    while pending:
        node, is_unread = pending.pop()
        if isinstance(node, _FUNCTIONS):
            is_unread = id(node) not in followed
        elif isinstance(node, ast.ClassDef):
            is_unread = True
        if is_unread:
            yield node
        pending += [(each, is_unread) for each in list_children(node)]
