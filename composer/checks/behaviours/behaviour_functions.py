"""Behaviours exist, can be called, and take the arguments that they get."""

from __future__ import annotations

import ast
import inspect
import sys
from typing import TYPE_CHECKING, Any, get_args

from composer.diagnostics import Related, diagnostic_at
from composer.language.includes.include_entry import shown_path
from composer.python_source.module_finder import MissingModule
from composer.python_source.value_annotations import find_wanted_values
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.entity_kinds import BehaviourKey
    from composer.language.bindings import Binding
    from composer.language.specs import BehaviourSpec
    from composer.python_source.function_kinds import FunctionKind
    from composer.python_source.modules import FunctionSource, ModuleSource

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
            explain = _explain_broken_module if module.syntax_error else _explain_unread_module
            yield explain(context, binding, module)


def is_called_wrongly(context: CheckContext, binding: Binding) -> bool:
    """Return whether `check_behaviour_sources` finds something wrong with a behaviour."""
    return any(_check_source(context, binding, context.modules.find(binding.behaviour.module)))


def check_behaviour_call(
    context: CheckContext,
    binding: Binding,
    kind: FunctionKind | None,
    signature: inspect.Signature | None,
) -> Iterator[Diagnostic]:
    """Check that a function fits its place; a kind or signature of `None` is unknown."""
    behaviour = binding.behaviour
    if kind is not None and kind.is_generator and not binding.may_yield:
        yield context.at_value(
            behaviour.path,
            'generator-not-allowed',
            f"'{behaviour.function}' is a generator, and {binding.owner} cannot resume one",
            part=behaviour.function,
            help='timers and actions take generators; return the value instead',
        )
    if signature is not None:
        yield from _check_signature(context, binding, signature)


def _explain_broken_module(
    context: CheckContext, binding: Binding, module: ModuleSource
) -> Diagnostic:
    """Return one finding for all behaviours of a module, at its error or where it is named."""
    behaviour = binding.behaviour
    reason = str(module.syntax_error).removeprefix(f'{module.path}:{module.error_line}: ')
    message = f"the module '{behaviour.module}' is not valid Python: {reason}"
    if module.error_line:
        place = module.place_of(module.error_line)
        related = [context.related_value(behaviour.path, f'{binding.owner} is bound to it here')]
        return diagnostic_at(place, 'broken-module', message, related=related)
    return context.at_value(
        behaviour.path, 'broken-module', message, part=behaviour.module, first=True
    )


def _explain_unread_module(
    context: CheckContext, binding: Binding, module: ModuleSource
) -> Diagnostic:
    behaviour = binding.behaviour
    return context.at_value(
        behaviour.path,
        'unread-module',
        f"the module '{behaviour.module}' is not checked: {module.unread}",
        part=behaviour.module,
        first=True,
        help='put its behaviours into a smaller module',
    )


def _check_source(
    context: CheckContext, binding: Binding, module: ModuleSource | MissingModule
) -> Iterator[Diagnostic]:
    behaviour = binding.behaviour
    if _is_of_python(context, behaviour.module):
        yield context.at_value(
            behaviour.path,
            'uncallable-behaviour',
            f"'{behaviour.name}' is of Python's standard library, and no behaviour: it cannot be "
            f'called as {binding.call}',
            help='write a function that calls it',
        )
    elif isinstance(module, MissingModule):
        yield _explain_missing_module(context, binding, module)
    elif function := module.find_function(behaviour.function):
        for found in check_behaviour_call(context, binding, function.kind, function.signature):
            places = _places_of(module, function)
            yield found.with_related(Related('it is defined here', at) for at in places)
        yield from _check_constructor(context, behaviour, module)
    elif not (module.is_open or module.top.is_dynamic):
        yield _explain_missing_function(context, binding, module)


def _check_constructor(
    context: CheckContext, behaviour: BehaviourSpec, module: ModuleSource
) -> Iterator[Diagnostic]:
    """Check that the class of a method can be made with its node, or without arguments."""
    of = module.functions.get(behaviour.class_name)
    signature = of.signature if of and of.class_definition else None
    if of is None or of.class_definition is None or signature is None:
        return
    if not (_binds(signature, 'node') or _binds(signature)):
        shown = str(signature).replace('=Ellipsis', '=…')
        yield context.at_value(
            behaviour.path,
            'bad-signature',
            f'{behaviour.class_name}{shown} is made with its node, as '
            f'{behaviour.class_name}(node), or without arguments',
            part=behaviour.class_name,
            related=[Related('it is defined here', module.place_of(of.class_definition.lineno))],
        )


def _binds(signature: inspect.Signature, *arguments: str) -> bool:
    try:
        signature.bind(*arguments)
    except TypeError:
        return False
    return True


def _places_of(module: ModuleSource, function: FunctionSource) -> Iterator[Span]:
    """Yield where a function is defined, and where it yields first."""
    if function.definition is None:
        return
    yield module.place_of(function.definition.lineno)
    if (line := function.first_yield) is not None:
        yield module.place_of(line)


def _is_of_python(context: CheckContext, module: str) -> bool:
    """Return whether a module is of the standard library, whose functions take no node."""
    top = module.partition('.')[0]
    is_of_python = top in sys.stdlib_module_names and top not in _TAKE_ANYTHING
    return is_of_python and not context.modules.is_of_project(module)


def _explain_missing_module(
    context: CheckContext, binding: Binding, module: MissingModule
) -> Diagnostic:
    behaviour = binding.behaviour
    path = behaviour.module.replace('.', '/')
    otherwise = f'create {path}.py in the project, or install the package that has it'
    if module.hidden_by:
        otherwise = (
            f'remove {shown_path(module.hidden_by)}, which hides the other modules of this name'
        )
    return context.at_value(
        behaviour.path,
        'unknown-behaviour',
        f"there is no module '{module.missing}'",
        part=module.missing,
        first=True,
        help=otherwise if module.hidden_by else did_you_mean(module.nearest, otherwise),
    )


def _explain_missing_function(
    context: CheckContext, binding: Binding, module: ModuleSource
) -> Diagnostic:
    behaviour = binding.behaviour
    if behaviour.class_name:
        return _explain_missing_method(context, behaviour, module)
    what = module.constants.get(behaviour.function)
    if what:
        return context.at_value(
            behaviour.path,
            'uncallable-behaviour',
            f"'{behaviour.name}' is {what}, and cannot be called",
            part=behaviour.function,
        )
    return context.at_value(
        behaviour.path,
        'unknown-behaviour',
        f"{behaviour.module} has no function '{behaviour.function}'",
        part=behaviour.function,
        help=_suggest_function(behaviour.function, module),
    )


def _explain_missing_method(
    context: CheckContext, behaviour: BehaviourSpec, module: ModuleSource
) -> Diagnostic:
    owner = module.functions.get(behaviour.class_name)
    of = owner.class_definition if owner else None
    if of is None:
        classes = [name for name, each in module.functions.items() if each.class_definition]
        return context.at_value(
            behaviour.path,
            'unknown-behaviour',
            f"{behaviour.module} has no class '{behaviour.class_name}'",
            part=behaviour.class_name,
            help=suggest(behaviour.class_name, classes, 'it has', 'it has no classes'),
        )
    methods = [
        each.name for each in of.body if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    return context.at_value(
        behaviour.path,
        'unknown-behaviour',
        f"the class '{behaviour.class_name}' has no method '{behaviour.method_name}'",
        part=behaviour.method_name,
        help=suggest(
            behaviour.method_name,
            [each for each in methods if each[0] != '_'],
            'it has',
            'it has no methods',
        ),
    )


def _suggest_function(name: str, module: ModuleSource) -> str:
    """Return the nearest name that a module can call, or its own functions."""
    # Classes and constants have capitals, and what it imports is there for other ends.
    callables = [each for each in module.functions if each[0] != '_' and not each[0].isupper()]
    own = [each for each in callables if each not in module.imports]
    near = find_nearest(name, callables)
    return did_you_mean(near) or suggest('', own, 'it has', 'it has no functions') or ''


def _check_signature(
    context: CheckContext, binding: Binding, signature: inspect.Signature
) -> Iterator[Diagnostic]:
    behaviour = binding.behaviour
    by_keyword = _keyword_parameters(signature)
    taken = _positional_parameters(signature)[: len(binding.parameters)]
    free = [name for name in by_keyword or () if name not in taken]
    # A misspelt name counts as the name that it means: it has a finding of its own.
    owner = behaviour.path[:-1]
    # An unknown key may be `with`, misspelt.
    was_dropped = any(path[:-1] == owner for path in context.system.dropped)
    given = set(free if was_dropped else behaviour.arguments)
    # An argument counts as given although its expression has an error.
    given |= {name for name in free if context.was_dropped((*behaviour.path[:-1], 'with', name))}
    for keyword in behaviour.arguments:
        if by_keyword is not None and (keyword not in by_keyword or keyword in taken):
            given.discard(keyword)
            given.add(find_nearest(keyword, free) or '')
            yield context.at_key(
                (*behaviour.path[:-1], 'with', keyword),
                'bad-argument',
                f"{behaviour.name} takes no argument '{keyword}'",
                help=suggest(keyword, free, 'it takes', 'it takes no more arguments'),
            )
    yield from _check_values(context, binding, signature)
    try:
        keywords = dict.fromkeys(given - {'', *taken})
        signature.bind(*binding.parameters, **keywords)
    except TypeError as error:
        shown = str(signature).replace('=Ellipsis', '=…')
        yield context.at_value(
            behaviour.path,
            'bad-signature',
            f'{behaviour.function}{shown} is called as {binding.call}: {error}',
            part=behaviour.function,
        )


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
            yield context.at_value(
                (*behaviour.path[:-1], 'with', keyword),
                'bad-argument',
                f"{behaviour.name} takes {shown} as '{keyword}', and is given {_shown(value)}",
                help=suggest(value, [each.option for each in wanted]),
            )


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


def _positional_parameters(signature: inspect.Signature) -> list[str]:
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return [each.name for each in signature.parameters.values() if each.kind in kinds]


def _keyword_parameters(signature: inspect.Signature) -> list[str] | None:
    """Return the names that can be given by keyword, `None` if any can."""
    parameters = signature.parameters.values()
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
        return None
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return [parameter.name for parameter in parameters if parameter.kind in kinds]
