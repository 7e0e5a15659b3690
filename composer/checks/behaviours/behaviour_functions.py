"""Behaviours exist, can be called, take what they get, and are annotated with its types."""

from __future__ import annotations

import inspect
import sys
from typing import TYPE_CHECKING, Any, get_args

from composer.diagnostics import Related, diagnostic_at
from composer.interfaces.message_types import in_python
from composer.language.includes.include_entry import shown_path
from composer.node_uses.node_calls import advise_first
from composer.python_source.annotations import find_wanted_values, read_annotation
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.module_finder import MissingModule
from composer.python_source.modules import ModuleSource
from composer.python_source.syntax import FUNCTIONS
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import BehaviourKey
    from composer.language.bindings import Binding
    from composer.language.specs import BehaviourSpec
    from composer.node_uses.reading import Wire

# Modules of the standard library with functions that take anything, such as `print`.
_TAKE_ANYTHING = ('builtins', 'functools', 'logging', 'operator', 'pprint', 'unittest')


def check_behaviour_sources(context: CheckContext) -> Iterator[Diagnostic]:
    """Check all behaviours without importing them."""
    told: set[str] = set()
    # Calls without arguments that fit; many nodes may have the same.
    fitting: set[tuple[str, BehaviourKey]] = set()
    for binding in context.all_bindings():
        call = (binding.behaviour.name, binding.key)
        is_known = call in fitting and not binding.behaviour.arguments
        if is_known or context.was_dropped(binding.behaviour.path):
            continue
        module = context.modules.find(binding.behaviour.module)
        if isinstance(module, MissingModule) or not (module.syntax_error or module.unread):
            found = [*_check_source(context, binding, module)]
            yield from found
            if not (found or binding.behaviour.arguments or context.system.dropped):
                fitting.add(call)
        elif binding.behaviour.module not in told:
            told.add(binding.behaviour.module)
            yield _explain_broken_module(context, binding, module)


def is_called_wrongly(context: CheckContext, binding: Binding) -> bool:
    """Return whether `check_behaviour_sources` finds something wrong with a behaviour."""
    return any(_check_source(context, binding, context.modules.find(binding.behaviour.module)))


def check_behaviour_call(
    context: CheckContext,
    binding: Binding,
    kind: FunctionKind | None,
    signature: inspect.Signature | None,
    first: str = '',
) -> Iterator[Diagnostic]:
    """Check that a function fits its place; a kind or signature of `None` is unknown.

    Args:
        first: The name of the parameter that a method has beside these.
    """
    behaviour = binding.behaviour
    if kind is not None and kind.is_generator and not binding.may_yield:
        text = f"'{behaviour.function}' is a generator, and {binding.owner} cannot resume one"
        advice = 'timers and actions take generators; return the value instead'
        path, part = behaviour.path, behaviour.function
        yield context.at_value(path, 'generator-not-allowed', text, part=part, help=advice)
    if signature is not None:
        yield from _check_signature(context, binding, signature, first)


def _explain_broken_module(
    context: CheckContext, binding: Binding, module: ModuleSource
) -> Diagnostic:
    """Return one finding for all behaviours of a module that is not read, or is not valid."""
    path, name = binding.behaviour.path, binding.behaviour.module
    if not module.syntax_error:
        text = f"the module '{name}' is not checked: {module.unread}"
        advice = 'put its behaviours into a smaller module'
        return context.at_value(path, 'unread-module', text, part=name, first=True, help=advice)
    reason = module.syntax_error.removeprefix(f'{module.path}:{module.error_line}: ')
    text = f"the module '{name}' is not valid Python: {reason}"
    if module.error_line:
        place = module.place_of(module.error_line)
        related = [context.related_value(path, f'{binding.owner} is bound to it here')]
        return diagnostic_at(place, 'broken-module', text, related=related)
    return context.at_value(path, 'broken-module', text, part=name, first=True)


def _check_source(
    context: CheckContext, binding: Binding, module: ModuleSource | MissingModule
) -> Iterator[Diagnostic]:
    behaviour = binding.behaviour
    top = behaviour.module.partition('.')[0]
    is_of_python = top in sys.stdlib_module_names and top not in _TAKE_ANYTHING
    if is_of_python and not context.modules.is_of_project(behaviour.module):
        text = f"'{behaviour.name}' is of Python's standard library, and no behaviour: "
        text += f'it cannot be called as {binding.call}'
        advice = 'write a function that calls it'
        yield context.at_value(behaviour.path, 'uncallable-behaviour', text, help=advice)
    elif isinstance(module, MissingModule):
        yield _explain_missing_module(context, behaviour, module)
    elif function := module.find_function(behaviour.function):
        lines = [function.definition.lineno] if function.definition else []
        lines += [function.first_yield] if function.first_yield else []
        places = [Related('it is defined here', module.place_of(line)) for line in lines]
        shape = (function.kind, function.signature, function.first)
        for found in check_behaviour_call(context, binding, *shape):
            yield found.with_related(places)
        yield from _check_constructor(context, behaviour, module)
    elif not (module.is_open or module.top.is_dynamic):
        yield _explain_missing_function(context, behaviour, module)


def _check_constructor(
    context: CheckContext, behaviour: BehaviourSpec, module: ModuleSource
) -> Iterator[Diagnostic]:
    """Check that the class of a method can be made with its node, or without arguments."""
    of = module.functions.get(behaviour.class_name)
    signature = of.signature if of and of.class_definition else None
    if of is None or of.class_definition is None or signature is None:
        return
    if not (_binds(signature, 'node') or _binds(signature)):
        name, shown = behaviour.class_name, str(signature).replace('=Ellipsis', '=…')
        text = f'{name}{shown} is made with its node, as {name}(node), or without arguments'
        place = Related('it is defined here', module.place_of(of.class_definition.lineno))
        path = behaviour.path
        yield context.at_value(path, 'bad-signature', text, part=name, related=[place])


def _binds(signature: inspect.Signature, *arguments: str) -> bool:
    try:
        signature.bind(*arguments)
    except TypeError:
        return False
    return True


def _explain_missing_module(
    context: CheckContext, behaviour: BehaviourSpec, module: MissingModule
) -> Diagnostic:
    path = behaviour.module.replace('.', '/')
    otherwise = f'create {path}.py in the project, or install the package that has it'
    advice = did_you_mean(module.nearest, otherwise)
    if module.hidden_by:
        shown = shown_path(module.hidden_by)
        advice = f'remove {shown}, which hides the other modules of this name'
    text, part = f"there is no module '{module.missing}'", module.missing
    rule = 'unknown-behaviour'
    return context.at_value(behaviour.path, rule, text, part=part, first=True, help=advice)


def _explain_missing_function(
    context: CheckContext, behaviour: BehaviourSpec, module: ModuleSource
) -> Diagnostic:
    rule, part = 'unknown-behaviour', behaviour.function
    advice: str | None = None
    owner = module.functions.get(behaviour.class_name)
    of = owner.class_definition if owner else None
    if of is not None:
        part = behaviour.method_name
        text = f"the class '{behaviour.class_name}' has no method '{part}'"
        names = [node.name for node in of.body if isinstance(node, FUNCTIONS)]
        names = [name for name in names if name[0] != '_']
        advice = suggest(part, names, 'it has', 'it has no methods')
    elif behaviour.class_name:
        part = behaviour.class_name
        text = f"{behaviour.module} has no class '{part}'"
        names = [name for name, each in module.functions.items() if each.class_definition]
        advice = suggest(part, names, 'it has', 'it has no classes')
    elif what := module.constants.get(part):
        rule, text = 'uncallable-behaviour', f"'{behaviour.name}' is {what}, and cannot be called"
    else:
        text = f"{behaviour.module} has no function '{part}'"
        # Classes and constants have capitals, and what it imports is there for other ends.
        callables = [each for each in module.functions if each[0] != '_' and not each[0].isupper()]
        own = [each for each in callables if each not in module.imports]
        near = did_you_mean(find_nearest(part, callables))
        advice = near or suggest('', own, 'it has', 'it has no functions')
    return context.at_value(behaviour.path, rule, text, part=part, help=advice)


def _check_signature(
    context: CheckContext, binding: Binding, signature: inspect.Signature, first: str
) -> Iterator[Diagnostic]:
    behaviour = binding.behaviour
    named: dict[object, list[str]] = {}
    for parameter in signature.parameters.values():
        named.setdefault(parameter.kind, []).append(parameter.name)
    kinds = inspect.Parameter
    plain = named.get(kinds.POSITIONAL_OR_KEYWORD, [])
    taken = [*named.get(kinds.POSITIONAL_ONLY, []), *plain][: len(binding.parameters)]
    # `None` if any name can be given by keyword.
    by_keyword = None if kinds.VAR_KEYWORD in named else plain + named.get(kinds.KEYWORD_ONLY, [])
    free = [name for name in by_keyword or () if name not in taken]
    # A misspelt name counts as the name that it means: it has a finding of its own.
    owner = behaviour.path[:-1]
    # An unknown key may be `with`, misspelt.
    was_dropped = any(path[:-1] == owner for path in context.system.dropped)
    given = set(free if was_dropped else behaviour.arguments)
    # An argument counts as given although its expression has an error.
    given |= {name for name in free if context.was_dropped((*owner, 'with', name))}
    for keyword in behaviour.arguments:
        if by_keyword is not None and (keyword not in by_keyword or keyword in taken):
            given.discard(keyword)
            given.add(find_nearest(keyword, free) or '')
            text = f"{behaviour.name} takes no argument '{keyword}'"
            advice = suggest(keyword, free, 'it takes', 'it takes no more arguments')
            yield context.at_key((*owner, 'with', keyword), 'bad-argument', text, help=advice)
    yield from _check_values(context, binding, signature)
    try:
        keywords = dict.fromkeys(given - {'', *taken})
        signature.bind(*binding.parameters, **keywords)
    except TypeError as error:
        name, shown = behaviour.function, str(signature).replace('=Ellipsis', '=…')
        text = f'{name}{shown} is called as {binding.call}: {error}'
        names = [each for each in plain if each not in given]
        advice = advise_first(names, binding.parameters, first)
        yield context.at_value(behaviour.path, 'bad-signature', text, part=name, help=advice)


def _check_values(
    context: CheckContext, binding: Binding, signature: inspect.Signature
) -> Iterator[Diagnostic]:
    """Check the values of arguments against their annotations."""
    behaviour = binding.behaviour
    annotations = {
        keyword: _annotation_of(signature.parameters[keyword])
        for keyword in behaviour.arguments
        if keyword in signature.parameters
    }
    # A bound that is itself out of bounds is one mistake.
    bounds = {
        keyword: behaviour.arguments[keyword]
        for keyword, annotation in annotations.items()
        if not find_wanted_values(annotation, behaviour.arguments[keyword], {})
    }
    for keyword, annotation in annotations.items():
        value = behaviour.arguments[keyword]
        wanted = find_wanted_values(annotation, value, bounds)
        if wanted:
            shown = ' or '.join(sorted({each.text for each in wanted}))
            text = f"{behaviour.name} takes {shown} as '{keyword}', and is given {_shown(value)}"
            path = (*behaviour.path[:-1], 'with', keyword)
            advice = suggest(value, [each.option for each in wanted])
            yield context.at_value(path, 'bad-argument', text, help=advice)


def _annotation_of(parameter: inspect.Parameter) -> str:
    annotation = parameter.annotation
    if annotation is parameter.empty:
        return ''
    if isinstance(annotation, type) and not get_args(annotation):
        return annotation.__name__
    return str(annotation)


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, dict | list):
        return 'a mapping' if isinstance(value, dict) else 'a list'
    return repr(value)


def check_annotations(context: CheckContext) -> Iterator[Diagnostic]:
    """Annotations of behaviours, if there are any, have the types of the entities."""
    # Of many nodes, the behaviours are the same.
    problems: dict[tuple[str, Wire], list[str]] = {}
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            behaviour = binding.behaviour
            if binding.entity is None or context.was_dropped(behaviour.path):
                continue
            wire = context.behaviours.wire_of(node, binding)
            key = behaviour.name, wire
            if key not in problems:
                problems[key] = [*_find_problems(context, behaviour, wire)]
            for problem in problems[key]:
                path, name = behaviour.path, behaviour.function
                advice = f'change the annotation, or the type of {binding.owner}'
                yield context.at_value(
                    path, 'wrong-annotation', f"'{name}' {problem}", part=name, help=advice
                )


def _find_problems(context: CheckContext, behaviour: BehaviourSpec, wire: Wire) -> Iterator[str]:
    module = context.modules.find(behaviour.module)
    source = isinstance(module, ModuleSource) and module.find_function(behaviour.function)
    if not isinstance(module, ModuleSource) or not source or source.definition is None:
        return
    function = source.definition
    arguments = [*function.args.posonlyargs, *function.args.args]
    for argument, given in zip(arguments, ('', wire.given), strict=False):
        read = read_annotation(argument.annotation, module.imports)
        if read and given is not None and not context.types.are_alike(read, given):
            shown = f'a {in_python(given)}' if given else 'the node first'
            yield f"takes a {in_python(read)} as '{argument.arg}', and is given {shown}"
    returned = read_annotation(function.returns, module.imports)
    is_plain = source.kind in (FunctionKind.PLAIN, FunctionKind.COROUTINE)
    if is_plain and wire.returned and '/' in returned:
        yield from _check_payload(context, returned, wire.returned)


def _check_payload(context: CheckContext, returned: str, wanted: str) -> Iterator[str]:
    """Check that a message is the wanted one, or its only field."""
    description = context.types.describe(wanted)
    fields = description.fields if description is not None else ()
    is_field = len(fields) == 1 and fields[0].type.nested == returned
    if description is not None and not is_field and not context.types.are_alike(returned, wanted):
        yield f'returns a {in_python(returned)}, which does not make a {in_python(wanted)}'
