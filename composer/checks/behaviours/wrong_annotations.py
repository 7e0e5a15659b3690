"""Behaviours are annotated with the types of the entities that they are bound to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.interfaces.message_types import in_python
from composer.interfaces.payload_checks import check_payload
from composer.python_source.annotations import Annotation, read_annotation
from composer.python_source.function_kinds import FunctionKind
from composer.python_source.modules import ModuleSource

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import BehaviourSpec
    from composer.node_uses.reading import Wire
    from composer.python_source.syntax import FunctionNode

_RULE = 'wrong-annotation'
# A value of each built-in type, to check against the field.
_SAMPLES: dict[str, object] = {'bool': False, 'float': 0.5, 'int': 1, 'str': 'a'}


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
                yield context.at_value(path, _RULE, f"'{name}' {problem}", part=name, help=advice)


def _find_problems(context: CheckContext, behaviour: BehaviourSpec, wire: Wire) -> Iterator[str]:
    module = context.modules.find(behaviour.module)
    source = isinstance(module, ModuleSource) and module.find_function(behaviour.function)
    if not isinstance(module, ModuleSource) or not source or source.definition is None:
        return
    yield from _check_parameters(context, wire, module, source.definition)
    answer = read_annotation(source.definition.returns, module.imports)
    if source.kind in (FunctionKind.PLAIN, FunctionKind.COROUTINE):
        yield from _check_payload(context, 'returns', answer, wire.returned)
        return
    items = [read_annotation(each, module.imports) for each in answer.items]
    if items:
        yield from _check_payload(context, 'yields', items[0], wire.yielded)
    if items and source.kind is FunctionKind.GENERATOR and len(items) > _RETURNED:
        yield from _check_payload(context, 'returns', items[_RETURNED], wire.returned)


# The index of the returned type in `Generator[yielded, sent, returned]`.
_RETURNED = 2


def _check_parameters(
    context: CheckContext, wire: Wire, module: ModuleSource, function: FunctionNode
) -> Iterator[str]:
    arguments = [*function.args.posonlyargs, *function.args.args]
    if arguments:
        first = read_annotation(arguments[0].annotation, module.imports)
        if first.interface or first.builtin:
            yield f"takes a {_shown(first)} as '{arguments[0].arg}', and is given the node first"
    if wire.given is None or len(arguments) <= 1:
        return
    read = read_annotation(arguments[1].annotation, module.imports)
    if read.builtin is None and (
        read.interface is None or context.types.are_alike(read.interface, wire.given)
    ):
        return
    given = in_python(wire.given)
    yield f"takes a {_shown(read)} as '{arguments[1].arg}', and is given a {given}"


def _check_payload(
    context: CheckContext, verb: str, read: Annotation, wanted: str | None
) -> Iterator[str]:
    """Check a payload: a message, a mapping, or the bare value of a single field."""
    if wanted is None:
        return
    description = context.types.describe(wanted)
    if read.interface is not None:
        fields = description.fields if description is not None else ()
        # The only field of a message may have this type.
        fits = description is None or context.types.are_alike(read.interface, wanted)
        fits |= len(fields) == 1 and fields[0].type.nested == read.interface
    elif read.builtin in _SAMPLES and description is not None:
        sample = _SAMPLES[read.builtin]
        fits = not any(check_payload(description, sample, context.catalogue))
    else:
        return
    if not fits:
        yield f'{verb} a {_shown(read)}, which does not make a {in_python(wanted)}'


def _shown(read: Annotation) -> str:
    return read.builtin or in_python(read.interface or '')
