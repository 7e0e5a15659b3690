"""Check ROS parameter files against the nodes that use them.

ROS ignores in silence what matches no node and what no node declares, and it ends a node when a
value does not suit its declaration.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from composer.checks.connections.topology import full_name
from composer.checks.connections.typos import find_typo
from composer.checks.parameters import OF_EVERY_NODE, find_nearest_choice, find_refusal
from composer.checks.process_parameters import LEAVE_OUT, NO_TYPE
from composer.diagnostics import Related, diagnostic_at
from composer.input_limits import MAX_VALUES
from composer.language.parameter_files import read_given_file, values_given
from composer.language.paths import PathError, explain_absent, resolve_path
from composer.language.specs import ComponentSpec, NodeSpec, ProcessSpec
from composer.names import find_namespace_problem, find_node_name_problem, join_names, with_article
from composer.records import record
from composer.ros_parameters.file_reader import parse_parameter_file
from composer.ros_parameters.file_writer import render_parameters_for_all
from composer.ros_parameters.node_patterns import PatternIndex, covers_pattern, matches_pattern
from composer.ros_parameters.parameter_types import suggest_value
from composer.spelling import count_edits, did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import (
        DeclaredNodeSpec,
        ParameterFileSpec,
        ParameterSpec,
        SystemSpec,
    )
    from composer.ros_parameters.file_reader import ParameterEntry, ParameterFile
    from composer.ros_parameters.overrides import MergedFiles
    from composer.yaml_text.positions import DataPath


@record
class _User:
    """A node or process with the parameter files that it uses.

    Attributes:
        full_name: That of one of its nodes; `None` if nobody knows how its nodes are called.
        files: Those that could be found, the first to be read first.
        node: `None` if nobody knows any parameter that it declares, as in a process.
        overrides: What its files give it, by the parameters' names.
        is_run: Whether it is part of the system, and not left out by its `when`.
        may_have_others: Whether it may have nodes that the file does not name.
    """

    full_name: str | None
    files: tuple[ParameterFileSpec, ...]
    node: NodeSpec | DeclaredNodeSpec | None
    overrides: Mapping[str, ParameterEntry]
    is_run: bool
    may_have_others: bool


def check_parameter_files(context: CheckContext) -> Iterator[Diagnostic]:
    """Check each parameter file once, for all who use it."""
    library = _Library(context)
    users = [*_find_users(library, context.spec, is_run=True)]
    findings = [*library.findings]
    if context.system.unused is not None:
        users += _find_users(library, context.system.unused, is_run=False)
    findings += _check_contents(context, library, users)
    # Their values may be others when the system runs.
    yield from (each for each in findings if _place_of(each) not in library.sampled)


def _place_of(finding: Diagnostic) -> tuple[str, int, int] | None:
    span = finding.span
    return (span.source.name, span.line, span.column) if span else None


def _check_contents(
    context: CheckContext, library: _Library, users: list[_User]
) -> Iterator[Diagnostic]:
    for path, file in library.files.items():
        of_file = [user for user in users if path in user.files]
        if all(user.full_name is not None for user in of_file):
            takers = _find_takers(context, file, of_file)
            if not _may_miss_users(context):
                yield from _check_names(file, of_file, takers)
            yield from _check_entries(path, file, takers)
    yield from _check_values(context, users)
    yield from _check_empty_lists(library, users)


class _Library:
    """The parameter files of a system, each read once."""

    def __init__(self, context: CheckContext) -> None:
        self.files: dict[ParameterFileSpec, ParameterFile] = {}
        self._merged: dict[tuple[ParameterFileSpec, ...], MergedFiles] = {}
        self.findings: list[Diagnostic] = []
        # Where values in the files depend on samples.
        self.sampled: set[tuple[str, int, int]] = set()
        self.context = context
        self._values_left = MAX_VALUES

    def read(self, owner: NodeSpec | ProcessSpec | ComponentSpec) -> Iterator[ParameterFileSpec]:
        """Read the files of a node or process, and yield those that exist."""
        for index, file in enumerate(owner.parameter_files):
            at = (*owner.path, 'parameter_files', index)
            if (*at, 'file') in self.context.system.positions.values:
                self.findings += self._check_root(file, (*at, 'root'))
                at = (*at, 'file')
            try:
                path = str(resolve_path(file.file, Path()))
            except PathError as error:
                self.findings.append(
                    self.context.at_value(at, 'uninstalled-package', str(error), help=error.help)
                )
                continue
            if file not in self.files:
                samples = self._find_samples(file, (*owner.path, 'parameter_files', index))
                self.files[file] = read = read_given_file(file, self._values_left, samples)
                self._values_left -= min(read.values, self._values_left)
                self.findings += [each for each in read.findings if each.span]
                self.sampled |= {
                    (each.source.name, each.line, each.column) for each in read.sampled
                }
            unreadable = [each for each in self.files[file].findings if each.span is None]
            self.findings += [
                self.context.at_value(
                    at,
                    each.rule,
                    f'{path}: {each.message}',
                    help=self._explain(Path(path), at) or each.help,
                )
                for each in unreadable
            ]
            if not unreadable:
                yield file

    def _explain(self, path: Path, at: DataPath) -> str | None:
        if os.path.lexists(path):
            return None
        return explain_absent(path, self.context.system.positions.value(at))

    def _find_samples(self, file: ParameterFileSpec, path: DataPath) -> list[str]:
        sampled = self.context.system.sampled
        positions = self.context.system.positions
        at = (*path, 'expressions')
        names = values_given(file) or {}
        return [name for name in names if positions.values.get((*at, name)) in sampled]

    def _check_root(self, file: ParameterFileSpec, at: DataPath) -> Iterator[Diagnostic]:
        if problem := find_namespace_problem(file.root) if file.root.strip('/') else None:
            message = f"'{file.root}': {problem}"
            yield self.context.at_value(at, 'bad-name', message)

    def merge(self, files: tuple[ParameterFileSpec, ...], *first: ParameterFile) -> MergedFiles:
        """Return what files say together, after some others; they have been read."""
        from composer.ros_parameters.overrides import MergedFiles

        if first:
            return MergedFiles([*first, *(self.files[file] for file in files)])
        if files not in self._merged:
            self._merged[files] = MergedFiles(self.files[file] for file in files)
        return self._merged[files]


def _find_users(library: _Library, system: SystemSpec, *, is_run: bool) -> Iterator[_User]:
    owners: list[NodeSpec | ProcessSpec | ComponentSpec] = [
        *system.nodes.values(),
        *system.processes.values(),
        *system.components,
    ]
    declared = {node.path: node for each in system.processes.values() for node in each.nodes}
    for owner in owners:
        files = tuple(library.read(owner))
        if not files:
            continue
        nodes = _nodes_of(owner, declared)
        if not isinstance(owner, NodeSpec) and owner.parameters:
            library.findings += _find_lost_values(library, owner, files, nodes)
        for name, node in nodes.items():
            overrides = library.merge(files).find_overrides(name) if name else {}
            may_have_others = isinstance(owner, ProcessSpec) and not _lists_nodes(owner)
            yield _User(name, files, node, overrides, is_run, may_have_others)


def _nodes_of(
    owner: NodeSpec | ProcessSpec | ComponentSpec, declared: Mapping[DataPath, DeclaredNodeSpec]
) -> dict[str | None, NodeSpec | DeclaredNodeSpec | None]:
    """Return the nodes of an owner by full names, with what they declare if that is known."""
    if isinstance(owner, NodeSpec):
        return {owner.full_name: owner}
    if isinstance(owner, ComponentSpec):
        return {owner.full_name: declared.get(owner.path)}
    if owner.components:
        # A container gives its own files to none of its components.
        return {owner.full_name: None}
    nodes: dict[str | None, NodeSpec | DeclaredNodeSpec | None] = {}
    if owner.node_name is not None:
        # Hardly any program has a namespace of its own.
        nodes[join_names(owner.namespace or '/', owner.node_name)] = declared.get(owner.path)
    for node in owner.nodes if _lists_nodes(owner) else ():
        nodes[node.full_name] = node
    return nodes or {None: None}


def _find_lost_values(
    library: _Library,
    owner: ProcessSpec | ComponentSpec,
    files: tuple[ParameterFileSpec, ...],
    names: Iterable[str | None],
) -> Iterator[Diagnostic]:
    """Yield the parameters of an owner that its files override for all of its nodes."""
    own = parse_parameter_file(render_parameters_for_all(owner.parameters), owner.name)
    merged = library.merge(files, own)
    if isinstance(owner, ProcessSpec) and owner.node_name is not None and owner.namespace is None:
        # Hardly any program has a namespace of its own.
        names = [f'/{owner.node_name}']
    for entry in own.entries:
        winners = [(name, merged.find_overrides(name or '/_').get(entry.name)) for name in names]
        lost_to = [
            winner
            for name, winner in winners
            if winner and winner.value != entry.value and (name or winner.pattern == '/**')
        ]
        path = (*owner.path, 'parameters', *entry.keys)
        if len(lost_to) == len(winners) and path in library.context.system.positions.keys:
            yield library.context.at_key(
                path,
                'overridden-parameter',
                f"'{entry.name}' never has this value: {lost_to[0].value_span.place} overrides it",
                help="files override 'parameters': change it there, or remove it here",
                related=[Related('overridden here', lost_to[0].value_span)],
            )


def _lists_nodes(process: ProcessSpec) -> bool:
    """Return whether a process says which nodes it has."""
    return any(node.path != process.path for node in process.nodes)


def _may_miss_users(context: CheckContext) -> bool:
    """Return whether a node's files or name are unknown because of an error."""
    lost = any(
        path in (('defaults',), ('defaults', 'namespace'))
        or path[:1] == ('include',)
        or (path[:1] == ('nodes',) and (len(path) <= _DEPTH or path[_DEPTH] in _DECIDING))
        for path in context.system.dropped
    )
    return lost or any(
        find_node_name_problem(node.name) or find_namespace_problem(node.namespace)
        for node in context.spec.nodes.values()
    )


# Of the paths of `nodes: {<name>: {<key>: …}}`.
_DEPTH = 2
_DECIDING = ('namespace', 'parameter_files')


def _overriding_qos(node: NodeSpec) -> Iterator[str]:
    """Yield the parameters by which the QoS of publishers and subscriptions is overridden."""
    for kind, end in node.ends():
        for policy in getattr(end, 'qos_overrides', ()):
            topic = full_name(node, 'topic', str(getattr(end, 'topic', '')))
            yield f'qos_overrides.{topic}.{kind.noun}.{policy}'


class _Takers:
    """The users of a file that one of its names of nodes matches."""

    def __init__(self, context: CheckContext) -> None:
        self._context = context
        self._users: list[_User] = []
        self._names: set[str] = set()
        self._declaring: dict[str, list[_User]] = {}
        # Those of which nobody knows all that they declare, and what is known of it.
        self._open: list[_User] = []
        self._known_of_open: set[str] = set()

    def add(self, user: _User) -> None:
        self._users.append(user)
        self._names.add(str(user.full_name))
        if (
            user.node is None
            or getattr(user.node, 'automatically_declare_parameters_from_overrides', False)
            or not getattr(user.node, 'declares_all_parameters', True)
            or self._context.was_dropped((*user.node.path, 'parameters'))
        ):
            self._open.append(user)
            self._known_of_open.update(user.node.parameters if user.node else ())
            return
        overriding = _overriding_qos(user.node) if isinstance(user.node, NodeSpec) else ()
        for name in (*user.node.parameters, *overriding):
            self._declaring.setdefault(name, []).append(user)

    def list_declaring(self, name: str) -> list[_User]:
        """Return the users that may declare a parameter."""
        if name in OF_EVERY_NODE:
            return self._users
        is_typo = name not in self._known_of_open and find_typo(name, self._known_of_open)
        known = [*(() if is_typo else self._open), *self._declaring.get(name, ())]
        return known or [
            user
            for user in self._users
            if user.node and self._context.was_dropped((*user.node.path, 'parameters', name))
        ]

    def explain_undeclared(self, entry: ParameterEntry) -> Diagnostic:
        """Return the finding for a parameter that none of them declares."""
        is_one = len(self._names) == 1
        who = f"node '{min(self._names)}'" if is_one else f'none of {len(self._names)} nodes'
        negation = 'no' if is_one else 'a'
        return diagnostic_at(
            entry.key_span,
            'undeclared-parameter',
            f"{who} declares {negation} parameter '{entry.name}', and ROS ignores it",
            help=did_you_mean(
                find_nearest(entry.name, {*self._declaring, *self._known_of_open, *OF_EVERY_NODE}),
                suggest(
                    entry.name,
                    self._declaring,
                    'declared are',
                    "declare it under 'parameters:' of the node",
                ),
            ),
        )


def _find_takers(
    context: CheckContext, file: ParameterFile, users: list[_User]
) -> dict[str, _Takers]:
    """Return who takes what stands below each name of nodes in a file."""
    index = PatternIndex(pattern for pattern, _ in file.patterns)
    takers: dict[str, _Takers] = {}
    for user in users:
        for pattern in index.find(str(user.full_name)):
            takers.setdefault(pattern, _Takers(context)).add(user)
    return takers


def _check_names(
    file: ParameterFile, users: list[_User], takers: dict[str, _Takers]
) -> Iterator[Diagnostic]:
    names = [user.full_name for user in users if user.full_name]
    may_have_others = any(user.may_have_others for user in users)
    index = PatternIndex(pattern for pattern, _ in file.patterns)
    unused = [name for name in names if not any(index.find(name))]
    for pattern, span in file.patterns:
        if pattern not in takers:
            if may_have_others and not _is_misspelt(pattern, names, unused):
                continue
            yield diagnostic_at(
                span,
                'unmatched-node-name',
                f"'{pattern}' matches no node that uses this file, so ROS ignores it",
                help=suggest(pattern, names, 'it is used by'),
            )


def _is_misspelt(pattern: str, names: list[str], unused: list[str]) -> bool:
    """Return whether a name means one of these, and not another node of their processes.

    Nobody knows which nodes a process has; they may be called alike, as `camera` and `camera2`.
    """
    pattern = f'/{pattern.removeprefix("/")}'
    if find_nearest(pattern, unused):
        return True
    near = find_nearest(pattern, names)
    are_numbered = near and re.sub(r'\d', '', pattern) == re.sub(r'\d', '', near)
    return near is not None and not are_numbered and count_edits(pattern, near) == 1


def _check_entries(
    path: ParameterFileSpec, file: ParameterFile, takers: dict[str, _Takers]
) -> Iterator[Diagnostic]:
    for entry in file.entries:
        if entry.pattern not in takers:
            continue
        declaring = takers[entry.pattern].list_declaring(entry.name)
        if not declaring:
            yield takers[entry.pattern].explain_undeclared(entry)
        elif finding := _find_overridden(path, entry, declaring):
            yield finding


def _find_overridden(
    path: ParameterFileSpec, entry: ParameterEntry, takers: Iterable[_User]
) -> Diagnostic | None:
    """Return a finding if an unexpected value overrides this one for every node."""
    lost_to: ParameterEntry | None = None
    for user in takers:
        winner = user.overrides.get(entry.name)
        if winner is None or winner is entry or _is_expected(user, path, entry, winner):
            return None
        lost_to = lost_to or winner
    if lost_to is None:
        return None
    return diagnostic_at(
        entry.key_span,
        'overridden-parameter',
        f"'{entry.name}' never has this value: {lost_to.value_span.place} overrides it",
        help=_help_for_overridden(entry, lost_to),
        related=[Related('overridden here', lost_to.value_span)],
    )


def _is_expected(
    user: _User, path: ParameterFileSpec, entry: ParameterEntry, winner: ParameterEntry
) -> bool:
    """Return whether a value is meant to win, as one of a later file or a more special name."""
    later = user.files[user.files.index(path) + 1 :]
    # Their packages are installed: the files have been read.
    if winner.value_span.source.name in {str(resolve_path(each.file, Path())) for each in later}:
        return True
    if winner.pattern == entry.pattern:
        return False
    return '*' not in winner.pattern or not covers_pattern(winner.pattern, entry.pattern)


def _help_for_overridden(entry: ParameterEntry, winner: ParameterEntry) -> str:
    if entry.pattern != winner.pattern:
        return f"the last name that matches a node wins: write '{winner.pattern}' above"
    if entry.type != winner.type:
        return 'of two types ROS takes one, whichever comes first: give both the same type'
    return 'remove one of them'


def _check_values(context: CheckContext, users: Iterable[_User]) -> Iterator[Diagnostic]:
    """Yield the values that declarations refuse, once for nodes that share both."""
    seen: set[tuple[int, str]] = set()
    for user in users:
        if user.node is None or not user.is_run:
            continue
        for name in (*user.node.parameters, *OF_EVERY_NODE):
            entry = user.overrides.get(name)
            if entry is None:
                continue
            problem, help_text = _find_problem(user.node.parameters.get(name), entry)
            if problem is None or (id(entry), problem) in seen:
                continue
            seen.add((id(entry), problem))
            declared = user.node.parameters.get(name)
            yield diagnostic_at(
                entry.value_span,
                'refused-parameter',
                f"parameter '{name}' of node '{user.full_name}': {problem}",
                help=help_text,
                related=[context.related(declared.path, 'declared here')] if declared else [],
            )


def _check_empty_lists(library: _Library, users: list[_User]) -> Iterator[Diagnostic]:
    """Yield the empty lists that nodes of programs and components get."""
    known = [user.full_name for user in users if user.full_name]
    for user in users:
        if isinstance(user.node, NodeSpec) or not user.is_run:
            continue
        entries = [entry for file in user.files for entry in library.files[file].entries]
        for entry in user.overrides.values() if user.full_name else entries:
            # Nodes that nobody knows have the names that no others have.
            if entry.value == [] and (
                user.full_name
                or entry.pattern == '/**'
                or not any(matches_pattern(entry.pattern, name) for name in known)
            ):
                yield diagnostic_at(
                    entry.value_span,
                    'refused-parameter',
                    f"parameter '{entry.name}': {NO_TYPE}",
                    help=LEAVE_OUT,
                )


def _find_problem(
    declared: ParameterSpec | None, entry: ParameterEntry
) -> tuple[str | None, str | None]:
    """Return why a node would refuse a value, and a help text."""
    if declared is None:
        wanted: str | None = 'bool' if entry.name in OF_EVERY_NODE else None
    else:
        wanted = declared.type
    if wanted is None or (entry.value == [] and wanted.endswith('_array')):
        return None, None
    if wanted == 'byte_array':
        return 'parameter files have no byte type', "give them under 'parameters:' of the node"
    if entry.type != wanted:
        got = with_article(entry.type) if entry.type else 'an empty list'
        problem = f'expected {with_article(wanted)}, and ROS takes this for {got}'
        return problem, suggest_value(wanted, entry.value, entry.value_span.text)
    if declared is None:
        return None, None
    return find_refusal(declared, entry.value), find_nearest_choice(declared, entry.value)
