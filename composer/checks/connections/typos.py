"""Typos in names that no declaration has to match.

What is waited for may come from programs that no file declares, and a callback group may have any
name: only a name that is all but that of something in the system is likely to mean it.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name
from composer.checks.connections.wait_conditions import waiters
from composer.language.specs import REENTRANT
from composer.names import expand_name, with_article
from composer.spelling import count_edits, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import (
        ComponentSpec,
        ConditionSpec,
        NodeSpec,
        ProcessSpec,
    )

_RULE = 'likely-misspelling'
_SEPARATORS = re.compile(r'[/_]')
# In shorter words another letter makes another word: `arm_l` and `arm_r`, `map` and `mop`.
_SHORTEST = 4
# Two letters in the wrong order are a slip in these, too: `/cmd_vle`.
_SHORTEST_SWAPPED = 3
_MIDDLING = 6
_LONG = 8
# More names than these are not compared one by one.
_MOST_COMPARED = 2_000


def check_typos(context: CheckContext) -> Iterator[Diagnostic]:
    """Check names that match nothing in the system for likely typos."""
    yield from _check_conditions(context)
    yield from _check_groups(context)


def find_typo(word: str, options: Iterable[str]) -> str | None:
    """Return the option that a word is most likely a misspelling of.

    One part of it, between slashes and underscores, has a typo; a long one may have two, and a
    short one only swapped letters. Other numbers are no typos.
    """
    parts = _SEPARATORS.split(word)
    for option in options:
        others = _SEPARATORS.split(option)
        pairs = [pair for pair in zip(parts, others, strict=False) if pair[0] != pair[1]]
        if len(parts) == len(others) and len(pairs) == 1 and _is_typo(*pairs[0]):
            return option
    return None


def is_slip(name: str, other: str) -> bool:
    """Return whether one of two names, whose ends both lack another end, may mean the other.

    More differences than in `find_typo` are slips then: an end would fit, and nothing else does.
    """
    words, others = _SEPARATORS.split(name), _SEPARATORS.split(other)
    if len(words) != len(others):
        # A lost underscore, as in `cmdvel`.
        last, near = (each.replace('_', '') for each in (name, other))
        return last == near
    pairs = [pair for pair in zip(words, others, strict=True) if pair[0] != pair[1]]
    if len(pairs) != 1 or _digits(pairs[0][0]) != _digits(pairs[0][1]):
        return False
    if _has_prefix(*pairs[0]):
        return False
    shortest = min(map(len, pairs[0]))
    most = 0 if shortest < _SHORTEST_SWAPPED else 1 if shortest < _MIDDLING else 2
    return count_edits(*(word.lower() for word in pairs[0])) <= most


def _is_typo(word: str, other: str) -> bool:
    shortest = min(len(word), len(other))
    if _digits(word) != _digits(other) or _has_prefix(word, other):
        return False
    if shortest < _SHORTEST:
        return shortest >= _SHORTEST_SWAPPED and _is_swapped(word, other)
    return count_edits(word.lower(), other.lower()) <= (2 if len(word) >= _LONG else 1)


def _has_prefix(word: str, other: str) -> bool:
    """Return whether one is the other after a letter, which makes another word: `estop`."""
    short, long = sorted((word, other), key=len)
    return long[1:] == short and long[:1] != short[:1]


def _is_swapped(word: str, other: str) -> bool:
    return sorted(word) == sorted(other) and count_edits(word, other) == 1


def _digits(word: str) -> str:
    return ''.join(filter(str.isdigit, word))


def _check_conditions(context: CheckContext) -> Iterator[Diagnostic]:
    conditions = [
        (waiter, condition) for waiter in waiters(context.spec) for condition in waiter.wait_for
    ]
    if not conditions:
        return
    present = _present(context)
    for waiter, condition in conditions:
        if condition.kind == 'process':
            continue
        name = _full_name(waiter, condition)
        names = present[condition.kind]
        if name in names or len(names) > _MOST_COMPARED:
            continue
        near = find_typo(name, names) or at_the_top(condition.name, names)
        if near:
            meant = as_written(condition.name, near, waiter.namespace or '/')
            yield context.at_value(
                condition.path,
                _RULE,
                f"{with_article(condition.kind)} '{name}' is nowhere in this system",
                help=did_you_mean(meant),
            )


def at_the_top(name: str, names: set[str]) -> str | None:
    """Return the name without a namespace that one inside a namespace was meant to be."""
    return f'/{name}' if f'/{name}' in names else None


def _present(context: CheckContext) -> dict[str, set[str]]:
    """Return the full names of all that the file names, by kind, left out or not.

    What is elsewhere has its name from the ends that use it.
    """
    system, topology = context.system, context.topology
    specs = [context.spec, *([system.unused] if system.unused else [])]
    present: dict[str, set[str]] = {'topic': set(), 'service': set(), 'action': set()}
    created = ((kind, name) for kind, name, _ in topology.created)
    for kind, name in (*topology.channels, *topology.left_out, *created):
        present[kind].add(name)
    present['service'] |= topology.ros_services.keys()
    present['node'] = {node.full_name for spec in specs for node in spec.nodes.values()}
    present['node'] |= {
        expand_name(process.node_name, '', process.namespace or '/')
        for spec in specs
        for process in spec.processes.values()
        if process.node_name
    }
    present['node'] |= {
        node.full_name
        for spec in specs
        for process in spec.processes.values()
        for node in process.nodes
        if node.is_named
    }
    return present


def _full_name(waiter: NodeSpec | ProcessSpec | ComponentSpec, condition: ConditionSpec) -> str:
    kind = condition.kind
    if kind == 'node' or kind == 'process':  # noqa: PLR1714 - the type checker follows this
        return expand_name(condition.name, waiter.name, waiter.namespace or '/')
    return full_name(waiter, kind, condition.name)


def as_written(name: str, full: str, namespace: str) -> str:
    """Return a full name in the form in which a name is written."""
    inside = namespace.rstrip('/') + '/'
    is_relative = name[:1] not in ('/', '~') and full.startswith(inside)
    return full.removeprefix(inside) if is_relative else full


def _check_groups(context: CheckContext) -> Iterator[Diagnostic]:
    for node in context.spec.nodes.values():
        for entity in node.grouped:
            group = entity.group
            if group and group != REENTRANT and _is_typo(group, REENTRANT):
                yield context.at_value(
                    (*entity.path, 'group'),
                    _RULE,
                    f"'{group}' is a group of its own, whose members never run at the same time",
                    help=did_you_mean(REENTRANT),
                )
