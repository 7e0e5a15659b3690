"""Findings that are the same for each instance of an entry: of `foreach`, or included twice."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from composer.diagnostics import Diagnostic, Span
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec

# Numbers and words apart, as `wheel`, `2` and `left` in `wheel2_left`.
_TOKEN = re.compile(r'\d+|[^\W\d_]+')


def say_once(findings: Iterable[Diagnostic], system: LoadedSystem) -> list[Diagnostic]:
    """Return findings, those at one place that differ only in the instance as one.

    The first of them stays, and says how many there are.
    """
    groups: dict[tuple[object, ...], list[Diagnostic]] = {}
    for finding in findings:
        groups.setdefault((finding.rule, finding.file, finding.span), []).append(finding)
    tokens: set[str] | None = None
    said: list[Diagnostic] = []
    for group in groups.values():
        if len(group) > 1 and group[0].span:
            tokens = _tokens_of_instances(system) if tokens is None else tokens
            said += _merge(group, tokens)
        else:
            said += group
    return said


def _merge(group: list[Diagnostic], tokens: set[str]) -> Iterator[Diagnostic]:
    alike: dict[str, list[Diagnostic]] = {}
    for finding in group:
        shape = _TOKEN.sub(lambda match: '*' if match[0] in tokens else match[0], finding.message)
        alike.setdefault(shape, []).append(finding)
    for first, *others in alike.values():
        count = len({each.message for each in others} - {first.message})
        plural = 's' if count > 1 else ''
        more = f' (and the same for {count} more instance{plural})' if count else ''
        yield replace(first, message=first.message + more)


def _tokens_of_instances(system: LoadedSystem) -> set[str]:
    """Return what differs in the names of entries that are written in one place."""
    places: dict[Span, list[set[str]]] = {}
    for spec in filter(None, (system.spec, system.unused)):
        for path, name in _named_entries(spec):
            found = {*_TOKEN.findall(name)}
            places.setdefault(system.positions.key(path), []).append(found)
    differing: set[str] = set()
    for names in places.values():
        common = names[0].intersection(*names)
        differing.update(*(each - common for each in names))
    return differing


def _named_entries(spec: SystemSpec) -> Iterator[tuple[tuple[str, ...], str]]:
    for key, node in spec.nodes.items():
        yield ('nodes', key), f'{key} {node.full_name}'
    for key in spec.processes:
        yield ('processes', key), key
