"""Calls of the node: what is sent, created and asked for, by which names."""

from __future__ import annotations

import ast
import re
from functools import cache
from typing import TYPE_CHECKING

from composer.entity_kinds import KIND_OF_NOUN
from composer.node_uses.message_uses import shown_value
from composer.node_uses.names import Chain, External, Function, Texts, only_text
from composer.node_uses.reading import (
    CREATING_METHODS,
    SENDING_METHODS,
    CreatedEntity,
    Payload,
    RemoteParameter,
)
from composer.python_source.annotations import find_interface
from composer.python_source.modules import read_signature
from composer.python_source.syntax import is_none, own_nodes, positional_names
from composer.schema.structure import find_problem

if TYPE_CHECKING:
    import inspect
    from collections.abc import Iterator, Mapping, Sequence

    from composer.node_uses.names import Scope, Value
    from composer.node_uses.reading import Run, Waited

# A test holds these against `composer.Node`.
_SIGNATURES = {
    'call': 'name, payload=None, timeout=5.0',
    'call_async': 'name, payload=None, timeout=5.0',
    'create_client': 'srv_type, srv_name, **options',
    'create_publisher': 'msg_type, topic, qos=None, **options',
    'create_service': 'srv_type, srv_name, behaviour, **options',
    'create_subscription': 'msg_type, topic, behaviour, qos=None, **options',
    'create_timer': 'period, behaviour, **options',
    'destroy': 'entity',
    'get_parameters': 'node_name, names, timeout=5.0',
    'now': '',
    'publish': 'name, payload',
    'send_goal': 'name, payload=None, timeout=5.0',
    'set_parameters': 'node_name, values, timeout=5.0',
    'shutdown': 'code=0',
    'sleep': 'seconds',
    'with_own_state': '',
}
NODE_METHODS = frozenset(_SIGNATURES)
# What behaviours write for what rclpy's node has.
OF_RCLPY = {
    **{name: f'write node.{name}' for name in CREATING_METHODS},
    'declare_parameter': "declare it under 'parameters:' of the node",
    'get_clock': 'write node.now()',
    'get_logger': 'write node.logger',
    'get_name': 'write node.name',
    'get_parameter': 'write node.parameters.NAME',
}
_MESSAGE = re.compile(r'\w+/msg/\w+')
_PARTS = {'publish': '', 'call': '_Request', 'call_async': '_Request', 'send_goal': '_Goal'}


@cache
def signature_of(method: str) -> inspect.Signature:
    """Return how a method of the node is called."""
    (function,) = ast.parse(f'def {method}({_SIGNATURES[method]}): pass').body
    assert isinstance(function, ast.FunctionDef)  # noqa: S101 (a line of the table above)
    return read_signature(function.args)


def explain_misfit(signature: inspect.Signature, call: ast.Call) -> str | None:
    """Return why a function cannot be called so, `None` if it can."""
    if is_open(call):
        return None
    try:
        signature.bind(*call.args, **{each.arg or '': each.value for each in call.keywords})
    except TypeError as error:
        return str(error)
    return None


def advise_first(names: Sequence[str], given: Sequence[str], own: str) -> str | None:
    """Return the help for a function that lacks the parameter that should come first.

    Args:
        names: Those that it takes, without the `own` one of a method.
        given: What it is called with.
    """
    if len(names) >= len(given):
        return None
    if own == 'node':
        return 'add self first'
    # It may have another name.
    return None if names and names[0][0] == 'n' else f'add node {own and "after "}{own or "first"}'


def called_signature(function: Function) -> inspect.Signature:
    """Return what a function takes in a call."""
    signature = read_signature(function.definition.args)
    parameters = list(signature.parameters.values())
    return signature.replace(parameters=parameters[function.bound is not None :])


def note_call(
    run: Run, method: str, call: ast.Call, scope: Scope, *, is_awaited: bool
) -> Iterator[tuple[Function, list[Value | None]]]:
    """Note what a call of the node does; yield the behaviours that it creates."""
    signature = signature_of(method)
    misfit = explain_misfit(signature, call)
    if misfit is not None:
        shown = str(signature).replace('=Ellipsis', '=…')
        text = f'{method}{shown} is called with other arguments: {misfit}'
        run.report('bad-call', scope.module, call, text, None)
        if method in CREATING_METHODS:
            return
    if misfit is not None or is_open(call):
        run.escape(Chain(('node', method)))
        return
    keywords = {each.arg or '': each.value for each in call.keywords}
    bound = dict(signature.bind(*call.args, **keywords).arguments)
    arguments: dict[str, ast.expr] = {**bound.pop('options', {}), **bound}
    if method in SENDING_METHODS:
        _note_sent(run, method, arguments, scope, is_awaited=is_awaited)
    elif method in CREATING_METHODS:
        if _are_swapped(run, arguments, scope):
            run.escape(Chain(('node', method)))
        else:
            yield from _note_created(run, method, arguments, scope)
    elif method in ('get_parameters', 'set_parameters'):
        run.reading.reads_others |= method == 'get_parameters'
        _note_remote(run, arguments, scope)


def is_open(call: ast.Call) -> bool:
    """Return whether a call has arguments that are not written out: `*args`, `**options`."""
    is_starred = any(isinstance(each, ast.Starred) for each in call.args)
    return is_starred or any(each.arg is None for each in call.keywords)


def _note_sent(
    run: Run, method: str, arguments: Mapping[str, ast.expr], scope: Scope, *, is_awaited: bool
) -> None:
    kind = SENDING_METHODS[method]
    named = run.names.value_of(arguments['name'], scope)
    is_wait = method in ('call', 'send_goal') or (method == 'call_async' and is_awaited)
    waits: Waited = 'answer' if is_wait and scope.waits and not run.doubts else ''
    run.use(kind, named, waits=waits)
    payload, name = arguments.get('payload'), only_text(named)
    is_known = name is not None and not (run.guards or run.fixed)
    if payload is not None and name and is_known and (method == 'publish' or not is_none(payload)):
        section, part = KIND_OF_NOUN[kind].section, _PARTS[method]
        sent = Payload(section, name, part, payload, scope.module, run.is_certain)
        run.reading.payloads.append(sent)


def _note_created(
    run: Run, method: str, arguments: Mapping[str, ast.expr], scope: Scope
) -> Iterator[tuple[Function, list[Value | None]]]:
    noun = CREATING_METHODS[method]
    of_type = arguments.get('msg_type') or arguments.get('srv_type')
    given: list[Value | None] = [Chain(('node',))]
    channel = arguments.get('topic') or arguments.get('srv_name')
    _check_options(run, noun, arguments, scope)
    if of_type is not None and channel is not None:
        type_name = _type_named(run, of_type, scope)
        if noun == 'subscription' and type_name and _MESSAGE.fullmatch(type_name):
            given.append(Chain(('made', type_name)))
        place = scope.module.span_of(of_type)
        text = only_text(run.names.value_of(channel, scope))
        name = only_text(run.names.value_of(arguments.get('name', channel), scope))
        run.reading.created.append(CreatedEntity(noun, name, text, type_name, place))
    behaviour = arguments.get('behaviour')
    function = run.names.value_of(behaviour, scope) if behaviour is not None else None
    if 'publish' in arguments:
        named = run.names.value_of(arguments['publish'], scope)
        run.use('publisher', named)
        if isinstance(function, Function) and (name := only_text(named)):
            run.reading.payloads += _list_results(function, name, is_certain=run.is_certain)
    fits = behaviour is None or _check_call(run, noun, behaviour, scope)
    if isinstance(function, Function):
        yield function, given if fits else []
    elif behaviour is not None:
        run.escape(Chain(('node',)))


def _are_swapped(run: Run, arguments: Mapping[str, ast.expr], scope: Scope) -> bool:
    """Report a function or type that stands where the other argument belongs."""
    for node in (arguments.get(name) for name in ('period', 'topic', 'srv_name')):
        value = run.names.value_of(node, scope) if node is not None else None
        is_type = isinstance(value, External) and find_interface(value.name) is not None
        if node is not None and (is_type or isinstance(value, Function)):
            text = f'this is a {"type" if is_type else "function"}, and belongs elsewhere'
            run.report('bad-call', scope.module, node, text, 'swap the arguments')
            return True
    return False


def _check_call(run: Run, noun: str, behaviour: ast.expr, scope: Scope) -> bool:
    """Return whether a behaviour takes what it will be called with, and report it if not."""
    given = next(
        each for each in KIND_OF_NOUN[noun].behaviours if each.key == 'behaviour'
    ).arguments
    call = ast.Call(behaviour, [], [])
    if isinstance(behaviour, ast.Call) and behaviour.args:
        if run.names.value_of(behaviour.func, scope) != External('functools.partial'):
            return True
        call = ast.Call(behaviour.args[0], behaviour.args[1:], behaviour.keywords)
    function = run.names.value_of(call.func, scope)
    if not isinstance(function, Function):
        return True
    call.args += [ast.Name(each) for each in given]
    call.func = ast.Name(getattr(function.definition, 'name', 'lambda'))
    signature = called_signature(function)
    misfit = explain_misfit(signature, call)
    if misfit is not None:
        shown = f'{call.func.id}{signature}'.replace('=Ellipsis', '=…')
        text = f'{shown} is called as {ast.unparse(call)}: {misfit}'
        own = positional_names(function.definition)[0] if function.bound is not None else ''
        help_text = advise_first(function.parameters[len(call.args) - len(given) :], given, own)
        run.report('bad-call', scope.module, behaviour, text, help_text)
    return misfit is None


def _list_results(function: Function, publisher: str, *, is_certain: bool) -> Iterator[Payload]:
    """Yield what a function gives away that a publisher publishes."""
    for node in own_nodes(function.definition):
        if isinstance(node, ast.Return | ast.Yield) and node.value and not is_none(node.value):
            yield Payload('publishers', publisher, '', node.value, function.module, is_certain)


def _check_options(run: Run, noun: str, arguments: Mapping[str, ast.expr], scope: Scope) -> None:
    """Check the keys that an entity is created with: they are those of the file."""
    kind = KIND_OF_NOUN[noun]
    own = ('name', 'msg_type', 'srv_type', 'srv_name')
    for name, node in arguments.items():
        if name in own:
            continue
        value = shown_value(node)
        entity = {**kind.stand_in, name: value}
        problem = find_problem({'nodes': {'node': {kind.section: {'created': entity}}}})
        if problem and (value is not None or problem.startswith('unknown key')):
            text = problem.replace("'created'", f"'{noun}'")
            run.report('bad-call', scope.module, node, text, None)


def _type_named(run: Run, node: ast.expr, scope: Scope) -> str | None:
    """Return the full name of the interface type that an expression is, if that is known."""
    value = run.names.value_of(node, scope)
    if isinstance(value, External):
        return find_interface(value.name)
    return only_text(value)


def _note_remote(run: Run, arguments: Mapping[str, ast.expr], scope: Scope) -> None:
    """Note parameters of another node, if the code names both."""
    target = run.names.value_of(arguments['node_name'], scope)
    given = arguments.get('values') or arguments.get('names')
    if target == Chain(('node', 'name')) and run.is_certain and not run.guards:
        target = Texts((('', arguments['node_name'], scope.module),))
    if not isinstance(target, Texts) or len(target.options) > 1:
        return
    text, node, module = target.options[0]
    pairs: list[tuple[ast.expr | None, ast.expr]] = []
    if isinstance(given, ast.Dict):
        pairs = list(zip(given.keys, given.values, strict=True))
    elif isinstance(given, ast.List | ast.Tuple):
        pairs = [(each, each) for each in given.elts]
    for key, value in pairs:
        if isinstance(key, ast.Constant) and isinstance(key.value, str):
            known = shown_value(value) if value is not key else None
            name, place = key.value, scope.module.span_of(key, key.value)
            told = (name, place, known, scope.module.span_of(value))
            remote = RemoteParameter(text, module.span_of(node, text), *told)
            run.reading.remote_parameters.append(remote)
