"""Objects of modules that nodes share, and cannot share between processes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from composer.checks.placement.crossings import Place, locate
from composer.diagnostics import Related
from composer.language.bindings import exit_bindings
from composer.node_uses.shared_names import SharedNames

if TYPE_CHECKING:
    from collections.abc import Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic, Span
    from composer.language.bindings import Binding
    from composer.node_uses.shared_names import SharedName


# Who uses a name, and the line.
_Users: TypeAlias = dict['SharedName', tuple['Binding', 'Span']]


@dataclass(slots=True)
class _Uses:
    """What the behaviours of a place do with objects: the first of them for each."""

    read: _Users = field(default_factory=dict)
    changed: _Users = field(default_factory=dict)


def check_shared_objects(context: CheckContext) -> Iterator[Diagnostic]:
    """Check that no worker or host reads what only behaviours of others change."""
    if len({place for place, _ in _list_placed(context)}) < _SEVERAL:
        return
    names = SharedNames(context.modules)
    places: dict[Place, _Uses] = {}
    for place, binding in _list_placed(context):
        if context.was_dropped(binding.behaviour.path):
            continue
        uses = names.uses_of(binding.behaviour.module, binding.behaviour.function)
        known = places.setdefault(place, _Uses())
        for users, found in (
            (known.read, uses.read),
            (known.changed, uses.changed),
        ):
            for name, span in found.items():
                users.setdefault(name, (binding, span))
    for place in places:
        yield from _check(context, place, places)


_SEVERAL = 2


def _list_placed(context: CheckContext) -> Iterator[tuple[Place, Binding]]:
    for node in context.spec.nodes.values():
        for binding in context.bindings(node):
            yield (node.host, node.worker), binding
    for process in context.spec.processes.values():
        for binding in exit_bindings(process):
            yield (process.host, ''), binding


def _check(
    context: CheckContext, place: Place, places: dict[Place, _Uses]
) -> Iterator[Diagnostic]:
    """Check what a place reads; where it is changed as well, each process may have its own."""
    uses = places[place]
    for name, (binding, span) in uses.read.items():
        if name in uses.changed:
            continue
        for other, theirs in places.items():
            if other == place or name not in theirs.changed:
                continue
            changer, changed_at = theirs.changed[name]
            yield context.at_value(
                binding.behaviour.path,
                'shared-across-workers',
                f"'{binding.behaviour.name}' {locate(place)} reads '{name[1]}' of the module "
                f"'{name[0]}', which only '{changer.behaviour.name}' {locate(other)} changes",
                part=binding.behaviour.name,
                help='publish it, make it a parameter, or let both nodes run in one worker',
                related=[Related('read here', span), Related('changed here', changed_at)],
            )
            break
