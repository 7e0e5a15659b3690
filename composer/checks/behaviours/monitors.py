"""Check that what `behaviours.monitor`, which comes with Composer, watches is counted as well."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.behaviours.transforms import is_shipped
from composer.python_source.module_finder import MissingModule
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import BehaviourSpec, NodeSpec

_MODULE = 'behaviours.monitor'
_WATCHING = ('watch', 'diagnose')


def check_monitors(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that for each topic that is watched, the same node counts messages."""
    for node in context.spec.nodes.values():
        behaviours = [binding.behaviour for binding in context.bindings(node)]
        if node.path not in context.incomplete and any(
            each.module == _MODULE for each in behaviours
        ):
            yield from _check_node(context, node)


def _may_count(context: CheckContext, behaviour: BehaviourSpec) -> bool:
    """Return whether a behaviour of another module may call those of this one."""
    if is_shipped(context, behaviour.module):
        return False
    module = context.modules.find(behaviour.module)
    if isinstance(module, MissingModule) or module.is_open or module.unread:
        return True
    is_named = any('monitor' in line for line in module.lines)
    # What it imports may import it.
    return is_named or any(context.modules.is_of_project(each) for each in module.imports.values())


def _check_node(context: CheckContext, node: NodeSpec) -> Iterator[Diagnostic]:
    behaviours = [binding.behaviour for binding in context.bindings(node)]
    if not is_shipped(context, _MODULE) or any(_may_count(context, each) for each in behaviours):
        # Others may call its functions themselves.
        return
    topics = [each.arguments.get('topic') for each in behaviours if each.function == 'count']
    for behaviour in behaviours:
        topic = behaviour.arguments.get('topic')
        if behaviour.function in _WATCHING and topic is not None and topic not in topics:
            yield context.at_value(
                (*behaviour.path[:-1], 'with', 'topic'),
                'bad-argument',
                f"nothing in node '{node.name}' counts the messages of '{topic}'",
                help=suggest(
                    topic,
                    topics,
                    'it counts',
                    f"bind '{_MODULE}:count' to a subscription, with the same 'topic'",
                ),
            )
