"""Behaviours are annotated with the types of the entities that they are bound to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from composer.entity_kinds import ENTITY_KINDS, PUBLISHED
from composer.inference.message_types import in_python
from composer.interfaces.payload_checks import check_payload
from composer.language.bindings import node_bindings
from composer.python_source.annotations import Annotation, read_annotation
from composer.python_source.modules import FunctionKind, ModuleSource
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.entity_kinds import BehaviourKey, EntityKind
    from composer.interfaces.descriptions import (
        MessageDescription,
    )
    from composer.language.bindings import Binding
    from composer.language.specs import NodeSpec
    from composer.python_source.syntax import FunctionNode
    from composer.yaml_text.positions import DataPath

_RULE = 'wrong-annotation'
# A value of each built-in type, to check against the field.
_SAMPLES: dict[str, object] = {'bool': False, 'float': 0.5, 'int': 1, 'str': 'a'}


@record
class _Wire:
    """The types of what a behaviour gets and of what it gives.

    Attributes:
        given: The type of its second argument.
        yielded: The type that each yielded payload becomes.
        returned: The type that a returned payload becomes.
        ended: The type that a payload becomes which a generator returns.
        is_unsure: Whether the type of the entity is a stand-in.
    """

    given: str | None = None
    yielded: str | None = None
    returned: str | None = None
    ended: str | None = None
    is_unsure: bool = False


def check_annotations(context: CheckContext) -> Iterator[Diagnostic]:
    """Annotations of behaviours, if there are any, have the types of the entities."""
    for node in context.spec.nodes.values():
        wires = _wires_of(context, node)
        for binding in node_bindings(node):
            wire = wires.get(binding.behaviour.path)
            if wire is None or wire.is_unsure or context.was_dropped(binding.behaviour.path):
                continue
            module = context.modules.find(binding.behaviour.module)
            if isinstance(module, ModuleSource):
                yield from _check_behaviour(context, binding, wire, module)


def _wires_of(context: CheckContext, node: NodeSpec) -> dict[DataPath, _Wire]:
    """Return the types around each behaviour of a node, by its path."""
    published = {
        name: publisher.type if context.has_real_type(publisher) else None
        for name, publisher in node.publishers.items()
    }
    return {
        (*entity.path, key.key): _wire_of(context, kind, entity, key, published)
        for kind in ENTITY_KINDS
        for entity in getattr(node, kind.section).values()
        for key in kind.behaviours
    }


def _wire_of(
    context: CheckContext,
    kind: EntityKind,
    entity: Any,
    key: BehaviourKey,
    published: dict[str, str | None],
) -> _Wire:
    sent = published.get(entity.publish or '') if kind.publishes else None

    def type_of(part: str | None) -> str | None:
        if part is None or part == PUBLISHED:
            return sent if part else None
        return f'{entity.type}_{part}' if part else entity.type

    return _Wire(
        given=type_of(key.given),
        yielded=type_of(key.yielded),
        returned=type_of(key.returned),
        # Timers do not publish what a generator returns at its end.
        ended=None if key.returned == PUBLISHED else type_of(key.returned),
        is_unsure=kind.channel is not None and not context.has_real_type(entity),
    )


def _check_behaviour(
    context: CheckContext, binding: Binding, wire: _Wire, module: ModuleSource
) -> Iterator[Diagnostic]:
    source = module.functions.get(binding.behaviour.function)
    if source is None or source.definition is None:
        return
    yield from _check_parameter(context, binding, wire, module, source.definition)
    answer = read_annotation(source.definition.returns, module.imports)
    if source.kind in (FunctionKind.PLAIN, FunctionKind.COROUTINE):
        yield from _check_payload(context, binding, 'returns', answer, wire.returned)
        return
    items = [read_annotation(each, module.imports) for each in answer.items]
    if items:
        yield from _check_payload(context, binding, 'yields', items[0], wire.yielded)
    if items and source.kind is FunctionKind.GENERATOR and len(items) > _RETURNED:
        yield from _check_payload(context, binding, 'returns', items[_RETURNED], wire.ended)


# The index of the returned type in `Generator[yielded, sent, returned]`.
_RETURNED = 2


def _check_parameter(
    context: CheckContext,
    binding: Binding,
    wire: _Wire,
    module: ModuleSource,
    function: FunctionNode,
) -> Iterator[Diagnostic]:
    arguments = [*function.args.posonlyargs, *function.args.args]
    if arguments:
        first = read_annotation(arguments[0].annotation, module.imports)
        if first.interface or first.builtin:
            name = arguments[0].arg
            message = f"'{binding.behaviour.function}' takes a {_shown(first)} as '{name}'"
            yield _explain(context, binding, f'{message}, and is given the node first')
    if wire.given is None or len(arguments) <= 1:
        return
    read = read_annotation(arguments[1].annotation, module.imports)
    if read.builtin is None and (
        read.interface is None or context.types.are_alike(read.interface, wire.given)
    ):
        return
    yield _explain(
        context,
        binding,
        f"'{binding.behaviour.function}' takes a {_shown(read)} as '{arguments[1].arg}', "
        f'and is given a {in_python(wire.given)}',
    )


def _check_payload(
    context: CheckContext, binding: Binding, verb: str, read: Annotation, wanted: str | None
) -> Iterator[Diagnostic]:
    """Check a payload: a message, a mapping, or the bare value of a single field."""
    if wanted is None:
        return
    description = context.types.describe(wanted)
    if read.interface is not None:
        fits = context.types.are_alike(read.interface, wanted) or _may_hold(
            description, read.interface
        )
    elif read.builtin in _SAMPLES and description is not None:
        sample = _SAMPLES[read.builtin]
        fits = not any(check_payload(description, sample, context.catalogue))
    else:
        return
    if not fits:
        yield _explain(
            context,
            binding,
            f"'{binding.behaviour.function}' {verb} a {_shown(read)}, "
            f'which does not make a {in_python(wanted)}',
        )


def _explain(context: CheckContext, binding: Binding, message: str) -> Diagnostic:
    behaviour = binding.behaviour
    return context.at_value(
        behaviour.path,
        _RULE,
        message,
        part=behaviour.function,
        help=f'change the annotation, or the type of {binding.owner}',
    )


def _may_hold(description: MessageDescription | None, interface: str) -> bool:
    """Return whether the only field of a message may have this type."""
    if description is None:
        return True
    fields = description.fields
    return len(fields) == 1 and fields[0].type.nested == interface


def _shown(read: Annotation) -> str:
    return read.builtin or in_python(read.interface or '')
