"""The arguments of behaviours that come with Composer: transforms, multiplexers and monitors.

`behaviours.topics:mux` passes messages on while the parameter `selected` is its `source`: never,
if that is not among the parameter's choices. What `behaviours.monitor` watches has to be counted.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from composer.interfaces.field_errors import unknown_field
from composer.interfaces.payload_checks import check_payload
from composer.language.specs import SubscriptionSpec
from composer.python_source.module_finder import MissingModule
from composer.python_source.modules import ModuleSource
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.behaviours.message_expressions import ExpressionValue
    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.interfaces.descriptions import FieldType, MessageDescription
    from composer.language.bindings import Binding
    from composer.language.specs import BehaviourSpec, NodeSpec
    from composer.yaml_text.positions import DataPath


def check_shipped_behaviours(context: CheckContext) -> Iterator[Diagnostic]:
    """Check the arguments of the behaviours that say more of them than annotations do."""
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            behaviour = binding.behaviour
            check = _CHECKS.get(behaviour.name)
            if check is not None and is_shipped(context, behaviour.module):
                yield from check(context, node, binding)


def is_shipped(context: CheckContext, name: str) -> bool:
    """Return whether a module is the one that comes with Composer, not another of its name."""
    module = context.modules.find(name)
    path = None if isinstance(module, MissingModule) else module.path
    return path is not None and _is_shipped(path, name)


@cache
def _is_shipped(path: Path, name: str) -> bool:
    own = Path(__file__).parents[3].joinpath(*name.split('.')).with_suffix('.py')
    return path.resolve() == own.resolve()


def _check_transform(
    context: CheckContext, node: NodeSpec, binding: Binding
) -> Iterator[Diagnostic]:
    """The fields are those of the published type, and expressions use the received message."""
    subscription, fields = binding.entity, binding.behaviour.arguments.get('fields')
    if not isinstance(subscription, SubscriptionSpec) or not isinstance(fields, dict):
        return
    # The import of jinja2 takes a tenth of the time of a check, and most files do not need it.
    from composer.checks.behaviours.message_expressions import evaluate_over

    publisher = node.publishers.get(subscription.publish or '')
    heard = context.types.describe(subscription.type)
    made = context.types.describe(publisher.type) if publisher else None
    for name, expression in fields.items():
        path, value = (*subscription.path, 'with', 'fields', name), None
        if heard:
            wrong, value = evaluate_over(str(expression), heard, context.catalogue)
            for each in wrong:
                message, part = each.message, each.part
                yield context.at_value(path, each.rule, message, part=part, help=each.help)
            value = None if wrong else value
        if made:
            yield from _check_field(context, made, value, path)


def _check_field(
    context: CheckContext, made: MessageDescription, value: ExpressionValue | None, path: DataPath
) -> Iterator[Diagnostic]:
    """Check that a field exists, and that the value of its expression fits it."""
    owner: MessageDescription | None = made
    *outer, last = str(path[-1]).split('.')
    for part in outer:
        field = owner.field(part) if owner else None
        if owner is None or field is None:
            break
        if field.type.array or field.type.nested is None:
            message = f"'{part}' of {owner.name} is {field.type}, and has no fields"
            yield context.at_key(path, 'unknown-field', message)
            return
        owner = context.types.describe(field.type.nested)
    else:
        part = last
    field = owner.field(part) if owner else None
    if owner is None:
        return
    if field is None:
        error = unknown_field(owner.name, part, [each.name for each in owner.fields])
        yield context.at_key(path, 'unknown-field', str(error), help=error.help)
    elif value and value.type is None:
        for finding in check_payload(owner, {last: value.constant}, context.catalogue):
            yield context.at_value(path, finding.rule, finding.message)
    elif value and value.type and not _may_take(context, field.type, value.type):
        wrong = f'{owner.name}: {last}: expected {field.type}, got {value.type}'
        yield context.at_value(path, 'field-type', wrong)


def _may_take(context: CheckContext, wanted: FieldType, given: FieldType) -> bool:
    """Return whether a field may take what another one holds."""
    if wanted.array or given.array:
        # How long a list is, nobody knows.
        return bool(wanted.array and given.array) or bool(wanted.nested)
    if wanted.nested is None:
        return given.nested is None and _family(wanted) >= _family(given)
    description = context.types.describe(wanted.nested)
    # One with a single field takes what this takes.
    return wanted.nested == given.nested or description is None or len(description.fields) == 1


def _family(field_type: FieldType) -> set[str]:
    """Return the kinds of values that a field of a plain type takes."""
    if field_type.kind in ('string', 'wstring'):
        return {'text'}
    if field_type.kind == 'bool':
        return {'bool'}
    if field_type.kind == 'byte':
        return {'octet', 'whole'}
    return {'whole', 'part'} if field_type.kind.startswith('float') else {'whole'}


def _check_mux(context: CheckContext, node: NodeSpec, binding: Binding) -> Iterator[Diagnostic]:
    """The parameter `selected` may be the source, if it has choices."""
    behaviour, parameter = binding.behaviour, node.parameters.get('selected')
    source, choices = behaviour.arguments.get('source'), parameter and parameter.choices
    # A sample may stand for any choice.
    is_known = source is not None and not context.system.sampled
    if is_known and parameter and choices and source not in choices:
        yield context.at_value(
            (*behaviour.path[:-1], 'with', 'source'),
            'bad-argument',
            f"mux compares 'source' with the parameter 'selected', which is never {source!r}",
            help=suggest(source, choices, 'its choices are'),
            related=[context.related(parameter.path, 'the parameter and its choices')],
        )


def _check_monitor(
    context: CheckContext, node: NodeSpec, binding: Binding
) -> Iterator[Diagnostic]:
    """The same node counts the messages of a topic that is watched."""
    behaviours = [each.behaviour for each in context.bindings(node)]
    topics = [each.arguments.get('topic') for each in behaviours if each.function == 'count']
    behaviour, topic = binding.behaviour, binding.behaviour.arguments.get('topic')
    if topic is None or topic in topics or node.path in context.incomplete:
        return
    # Others may call its functions themselves.
    if not any(_may_count(context, each) for each in behaviours):
        otherwise = "bind 'behaviours.monitor:count' to a subscription, with the same 'topic'"
        yield context.at_value(
            (*behaviour.path[:-1], 'with', 'topic'),
            'bad-argument',
            f"nothing in node '{node.name}' counts the messages of '{topic}'",
            help=suggest(topic, topics, 'it counts', otherwise),
        )


def _may_count(context: CheckContext, behaviour: BehaviourSpec) -> bool:
    """Return whether a behaviour of another module may call those of the monitor."""
    if is_shipped(context, behaviour.module):
        return False
    module = context.modules.find(behaviour.module)
    if not isinstance(module, ModuleSource) or module.is_open or module.unread:
        return True
    is_named = any('monitor' in line for line in module.lines)
    # What it imports may import it.
    return is_named or any(context.modules.is_of_project(each) for each in module.imports.values())


_CHECKS = {
    'behaviours.topics:transform': _check_transform,
    'behaviours.topics:mux': _check_mux,
    'behaviours.monitor:watch': _check_monitor,
    'behaviours.monitor:diagnose': _check_monitor,
}
