"""Objects of modules that nodes share, and cannot share between processes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from composer.checks.placement.crossings import Place, locate
from composer.diagnostics import Related
from composer.inference.shared_names import SharedNames
from composer.language.bindings import exit_bindings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.inference.shared_names import SharedName
    from composer.language.bindings import Binding


@dataclass(slots=True)
class _Uses:
    """Where a name is used: the first behaviour of each place, and the line."""

    read: dict[Place, tuple[Binding, Span]] = field(default_factory=dict)
    changed: dict[Place, tuple[Binding, Span]] = field(default_factory=dict)


def check_shared_objects(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that no worker or host reads what only behaviours of others change."""
    if len({place for place, _ in _list_placed(context)}) < _SEVERAL:
        return
    names = SharedNames(context.modules)
    found: dict[SharedName, _Uses] = {}
    for place, binding in _list_placed(context):
        if context.was_dropped(binding.behaviour.path):
            continue
        uses = names.uses_of(binding.behaviour.module, binding.behaviour.function)
        for name, span in uses.read.items():
            found.setdefault(name, _Uses()).read.setdefault(place, (binding, span))
        for name, span in uses.changed.items():
            found.setdefault(name, _Uses()).changed.setdefault(place, (binding, span))
    for name, each in found.items():
        yield from _check(context, name, each)


_SEVERAL = 2


def _list_placed(context: CheckContext) -> Iterator[tuple[Place, Binding]]:
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            yield (node.host, node.worker), binding
    for process in context.spec.processes.values():
        for binding in exit_bindings(process):
            yield (process.host, ''), binding


def _check(context: CheckContext, name: SharedName, uses: _Uses) -> Iterator[Diagnostic]:
    """Check a name; where it is changed as well as read, each process may have its own."""
    for place, (binding, span) in uses.read.items():
        others = [each for each in uses.changed if each != place]
        if not others or place in uses.changed:
            continue
        changer, changed_at = uses.changed[others[0]]
        where, elsewhere = locate(place), locate(others[0])
        yield context.at_value(
            binding.behaviour.path,
            'shared-across-workers',
            f"'{binding.behaviour.name}' {where} reads '{name[1]}' of the module '{name[0]}', "
            f"which only '{changer.behaviour.name}' {elsewhere} changes",
            part=binding.behaviour.name,
            help='publish it, make it a parameter, or let both nodes run in one worker',
            related=[Related('read here', span), Related('changed here', changed_at)],
        )
