"""A loaded system → findings: every check is a function in one of two tables."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, TypeAlias

from composer.checks.behaviours.behaviour_bodies import check_bodies
from composer.checks.behaviours.behaviour_functions import (
    check_annotations,
    check_behaviour_sources,
)
from composer.checks.behaviours.blocked_groups import check_blocked_groups
from composer.checks.behaviours.missing_modules import check_missing_modules
from composer.checks.behaviours.shipped_behaviours import (
    check_shipped_behaviours,
)
from composer.checks.behaviours.unknown_and_unused import check_uses
from composer.checks.connections.channels import check_channel_types, check_servers
from composer.checks.connections.cycles import check_loops
from composer.checks.connections.deadlocks import check_deadlocks
from composer.checks.connections.lifecycles import check_awaited_states, check_lifecycles
from composer.checks.connections.qos import check_deadlines, check_qos_pairs
from composer.checks.connections.remap_rules import check_remap_rules
from composer.checks.connections.typos import check_typos
from composer.checks.connections.unconnected import check_clock, check_other_ends
from composer.checks.connections.wait_conditions import check_waits
from composer.checks.context import CheckContext
from composer.checks.environment import check_environment
from composer.checks.ignore_comments import IgnoreComments
from composer.checks.launch_files import check_launch_files
from composer.checks.left_out import check_left_out
from composer.checks.messages import check_messages
from composer.checks.names import check_full_names, check_names
from composer.checks.parameter_files import check_parameter_files
from composer.checks.parameters import check_parameters
from composer.checks.placement.crossings import check_crossing_messages
from composer.checks.placement.hosts_and_workers import check_hosts, check_workers
from composer.checks.placement.inventory import check_inventory, check_network_keys
from composer.checks.placement.network_paths import check_network
from composer.checks.placement.processes_elsewhere import check_processes_elsewhere
from composer.checks.placement.shared_objects import check_shared_objects
from composer.checks.process_parameters import check_process_parameters
from composer.checks.processes import check_executables, check_processes, check_unevaluated
from composer.checks.references import (
    check_content_filters,
    check_publish,
    check_qos,
    check_start_values,
    check_types,
)
from composer.diagnostics import errors_first, has_errors
from composer.input_limits import MAX_FINDINGS
from composer.interfaces.declared_packages import load_declared
from composer.python_source.module_finder import ModuleFinder, project_search_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from composer.diagnostics import Diagnostic, SourceFile, Span
    from composer.interfaces.catalogue import InterfaceCatalogue
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec
    from composer.rules import Need

CheckRule: TypeAlias = 'Callable[[CheckContext], Iterable[Diagnostic]]'
FurtherCheck: TypeAlias = 'Callable[[CheckContext, list[Diagnostic]], Iterable[Diagnostic]]'
FurtherChecks: TypeAlias = 'Mapping[Need, FurtherCheck]'
SpansByLine: TypeAlias = 'dict[tuple[SourceFile, int], list[Span]]'
NODE_RULES: tuple[CheckRule, ...] = (
    check_names,
    check_qos,
    check_content_filters,
    check_publish,
    check_types,
    check_messages,
    check_parameters,
    check_behaviour_sources,
    check_lifecycles,
    check_missing_modules,
    check_shipped_behaviours,
    check_processes,
    check_process_parameters,
    check_annotations,
    check_uses,
    check_bodies,
)
SYSTEM_RULES: tuple[CheckRule, ...] = (
    check_full_names,
    check_parameter_files,
    check_executables,
    check_unevaluated,
    check_launch_files,
    check_start_values,
    check_left_out,
    check_waits,
    check_awaited_states,
    check_environment,
    check_hosts,
    check_inventory,
    check_workers,
    check_processes_elsewhere,
    check_network,
    check_network_keys,
    check_channel_types,
    check_servers,
    check_qos_pairs,
    check_deadlines,
    check_other_ends,
    check_clock,
    check_loops,
    check_deadlocks,
    check_blocked_groups,
    check_remap_rules,
    check_typos,
    check_crossing_messages,
    check_shared_objects,
)
# These look for the programs of processes, and for files.
_PROGRAM_RULES = {check_executables, check_launch_files, check_parameter_files}
# These look at the computer that the system runs on, or at a node alone.
_LOCAL_RULES = {
    *NODE_RULES,
    *_PROGRAM_RULES,
    *(check_start_values, check_environment),
}
# One more than is shown, as a sign that there are more.
_ENOUGH = MAX_FINDINGS + 1
# What only some runs look at.
_OPTIONAL: frozenset[Need] = frozenset({'import', 'types'})
_MORE = f'only the first {MAX_FINDINGS} findings are shown: fix them to see the others'
# Numbers and words apart, as `wheel`, `2` and `left` in `wheel2_left`.
_TOKEN = re.compile(r'\d+|[^\W\d_]+')


def create_context(
    system: LoadedSystem, installed: InterfaceCatalogue, before: CheckContext | None = None
) -> CheckContext | None:
    """Return what checks are given, or `None` if the file could not be read at all.

    Args:
        before: What was read before; its modules are kept where their source is the same.
    """
    if system.spec is None:
        return None
    interfaces = load_declared(system, installed)
    modules = ModuleFinder(
        project_search_path(system.files),
        before.modules if before else None,
        {*system.spec.interfaces, *(system.unused.interfaces if system.unused else ())},
    )
    return CheckContext(system, system.spec, interfaces, modules)


def check_system(
    system: LoadedSystem,
    catalogue: InterfaceCatalogue,
    further: FurtherChecks | None = None,
    *,
    is_simulated: bool = False,
) -> list[Diagnostic]:
    """Return the findings in a system, by their places in the file.

    Args:
        is_simulated: Whether external processes are left out: their programs and files need not
            be here.
        further: Checks to apply after the others, by what they need; each gets the findings so
            far.
    """
    context = create_context(system, catalogue)
    return check_in_context(system, context, further, is_simulated=is_simulated)


def check_in_context(
    system: LoadedSystem,
    context: CheckContext | None,
    further: FurtherChecks | None = None,
    host: str = '',
    *,
    is_simulated: bool = False,
) -> list[Diagnostic]:
    """Return the findings in a system as `check_system` does, for a context that exists.

    Args:
        context: What `create_context` returned for the system.
        host: The host whose part is to run here, if it is not the whole system. Of the rest, only
            errors in how it is connected are found: its files and packages may be elsewhere.
    """
    found: list[Diagnostic] = []
    declared: Sequence[Diagnostic] = ()
    unchecked: set[Need] = set(_OPTIONAL - (further or {}).keys())
    comments = IgnoreComments(system.positions.source)
    if context:
        declared = context.interfaces.findings
        unchecked |= set() if context.catalogue.available else {'interfaces'}
        found += _apply_rules(context, comments, host, is_simulated=is_simulated)
    if context and further:
        samples = _by_line(system.sampled)
        for check in further.values():
            more = check(context, found)
            found += [each for each in more if not _hangs_on_samples(each, samples)]
    # What several entries share through an alias, or a file included twice, is wrong once.
    every = [*system.diagnostics, *declared, *found]
    once = {_identify(each): each for each in reversed(every)}
    heard = [each for each in once.values() if not comments.silence(each)]
    knows_all = not (system.diagnostics or host) and len(heard) < _ENOUGH
    heard += islice(comments.check(unchecked if knows_all else None), _ENOUGH)
    return _first_of(say_once(sorted(heard, key=lambda finding: finding.sort_key), system))


def _first_of(findings: list[Diagnostic]) -> list[Diagnostic]:
    if len(findings) <= MAX_FINDINGS:
        return findings
    shown = sorted(errors_first(findings)[:MAX_FINDINGS], key=lambda finding: finding.sort_key)
    return [*shown[:-1], replace(shown[-1], help=_MORE)]


def _identify(finding: Diagnostic) -> tuple[object, ...]:
    return finding.rule, finding.span, finding.file, finding.message


def _apply_rules(
    context: CheckContext, comments: IgnoreComments, host: str, *, is_simulated: bool
) -> Iterator[Diagnostic]:
    samples = _by_line(context.system.sampled)
    simulated = replace(context, spec=replace(context.spec, processes={}))
    part = context.on_host(host) if host else None
    for rule in (*NODE_RULES, *SYSTEM_RULES):
        is_left_out = is_simulated and rule in _PROGRAM_RULES
        found = _apply(rule, simulated if is_left_out else context, samples, comments)
        if part is None:
            yield from found
        elif rule in _LOCAL_RULES:
            # The part alone lacks nodes that its own may refer to.
            here = {*map(_identify, _apply(rule, part, samples, comments))}
            yield from (each for each in found if _identify(each) in here)
        else:
            yield from (each for each in found if has_errors([each]))
    if context.system.unused is not None:
        # What is left out this time may be there the next.
        unused = context.system.unused
        other = replace(context, spec=unused.on_host(host) if host else unused)
        samples = _by_line((*context.system.sampled, *context.system.sampled_unused))
        for rule in NODE_RULES:
            yield from _apply(rule, other, samples, comments)


def _apply(
    rule: CheckRule, context: CheckContext, samples: SpansByLine, comments: IgnoreComments
) -> Iterator[Diagnostic]:
    room = _ENOUGH
    for each in rule(context):
        if _hangs_on_samples(each, samples):
            continue
        yield each
        room -= not comments.silence(each)
        if not room:
            return


def _by_line(spans: Iterable[Span]) -> SpansByLine:
    lines: dict[tuple[SourceFile, int], list[Span]] = {}
    for span in spans:
        lines.setdefault((span.source, span.line), []).append(span)
    return lines


def _hangs_on_samples(finding: Diagnostic, samples: SpansByLine) -> bool:
    """Return whether a finding is about a sample, not a real value."""
    place = finding.span
    return place is not None and any(
        span.column <= place.column < span.column + span.length
        for span in samples.get((place.source, place.line), ())
    )


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
