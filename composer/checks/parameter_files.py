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
from composer.checks.parameters import OF_EVERY_NODE, find_nearest_choice, find_refusal
from composer.diagnostics import Related, diagnostic_at
from composer.input_limits import MAX_VALUES
from composer.language.paths import PathError, explain_absent, resolve_path
from composer.language.specs import NodeSpec
from composer.names import find_namespace_problem, find_node_name_problem, join_names, with_article
from composer.records import record
from composer.ros_parameters.node_patterns import PatternIndex, covers_pattern
from composer.spelling import count_edits, did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.language.specs import ParameterSpec, ProcessSpec, SystemSpec
    from composer.ros_parameters.file_reader import ParameterEntry, ParameterFile
    from composer.ros_parameters.overrides import MergedFiles
    from composer.yaml_text.positions import DataPath


@record
class _User:
    """A node or process with the parameter files that it uses.

    Attributes:
        full_name: `None` if nobody knows how its nodes are called.
        files: Those that could be found, the first to be read first.
        node: `None` if it is a process: nobody knows what that declares.
        overrides: What its files give it, by the parameters' names.
        is_run: Whether it is part of the system, and not left out by its `when`.
    """

    full_name: str | None
    files: tuple[str, ...]
    node: NodeSpec | None
    overrides: Mapping[str, ParameterEntry]
    is_run: bool


def check_parameter_files(context: CheckContext) -> Iterator[Diagnostic]:
    """Check each parameter file once, for all who use it."""
    library = _Library(context)
    users = [*_find_users(library, context.spec, is_run=True)]
    findings = [*library.findings]
    if context.system.unused is not None:
        users += _find_users(library, context.system.unused, is_run=False)
    yield from findings
    for path, file in library.files.items():
        of_file = [user for user in users if path in user.files]
        if all(user.full_name is not None for user in of_file):
            takers = _find_takers(context, file, of_file)
            if not _may_miss_users(context):
                yield from _check_names(file, of_file, takers)
            yield from _check_entries(path, file, takers)
    yield from _check_values(context, users)


class _Library:
    """The parameter files of a system, each read once."""

    def __init__(self, context: CheckContext) -> None:
        self.files: dict[str, ParameterFile] = {}
        self._merged: dict[tuple[str, ...], MergedFiles] = {}
        self.findings: list[Diagnostic] = []
        self._context = context
        self._values_left = MAX_VALUES

    def read(self, owner: NodeSpec | ProcessSpec) -> Iterator[str]:
        """Read the files of a node or process, and yield those that exist."""
        for index, text in enumerate(owner.parameter_files):
            at = (*owner.path, 'parameter_files', index)
            try:
                path = str(resolve_path(text, Path()))
            except PathError as error:
                self.findings.append(
                    self._context.at_value(at, 'uninstalled-package', str(error), help=error.help)
                )
                continue
            if path not in self.files:
                # Most systems have no parameter files.
                from composer.ros_parameters.file_reader import read_parameter_file

                self.files[path] = read_parameter_file(Path(path), self._values_left)
                self._values_left -= min(self.files[path].values, self._values_left)
                self.findings += [each for each in self.files[path].findings if each.span]
            unreadable = [each for each in self.files[path].findings if each.span is None]
            self.findings += [
                self._context.at_value(
                    at,
                    each.rule,
                    f'{path}: {each.message}',
                    help=self._explain(Path(path), at) or each.help,
                )
                for each in unreadable
            ]
            if not unreadable:
                yield path

    def _explain(self, path: Path, at: DataPath) -> str | None:
        if os.path.lexists(path):
            return None
        return explain_absent(path, self._context.system.positions.value(at))

    def merge(self, paths: tuple[str, ...]) -> MergedFiles:
        """Return what files say together; they have been read."""
        if paths not in self._merged:
            from composer.ros_parameters.overrides import MergedFiles

            self._merged[paths] = MergedFiles(self.files[path] for path in paths)
        return self._merged[paths]


def _find_users(library: _Library, system: SystemSpec, *, is_run: bool) -> Iterator[_User]:
    owners: list[NodeSpec | ProcessSpec] = [*system.nodes.values(), *system.processes.values()]
    for owner in owners:
        files = tuple(library.read(owner))
        if not files:
            continue
        name = _full_name(owner)
        overrides = library.merge(files).find_overrides(name) if name else {}
        node = owner if isinstance(owner, NodeSpec) else None
        yield _User(name, files, node, overrides, is_run)


def _full_name(owner: NodeSpec | ProcessSpec) -> str | None:
    if isinstance(owner, NodeSpec):
        return owner.full_name
    if owner.node_name is None or owner.namespace is None:
        return None
    return join_names(owner.namespace, owner.node_name)


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
        # Those of which nobody knows what they declare.
        self._open: list[_User] = []

    def add(self, user: _User) -> None:
        self._users.append(user)
        self._names.add(str(user.full_name))
        if (
            user.node is None
            or user.node.automatically_declare_parameters_from_overrides
            or self._context.was_dropped((*user.node.path, 'parameters'))
        ):
            self._open.append(user)
            return
        for name in (*user.node.parameters, *_overriding_qos(user.node)):
            self._declaring.setdefault(name, []).append(user)

    def list_declaring(self, name: str) -> list[_User]:
        """Return the users that may declare a parameter."""
        if name in OF_EVERY_NODE:
            return self._users
        known = [*self._open, *self._declaring.get(name, ())]
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
                find_nearest(entry.name, {*self._declaring, *OF_EVERY_NODE}),
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
    may_have_others = any(user.node is None for user in users)
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
    path: str, file: ParameterFile, takers: dict[str, _Takers]
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
    path: str, entry: ParameterEntry, takers: Iterable[_User]
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


def _is_expected(user: _User, path: str, entry: ParameterEntry, winner: ParameterEntry) -> bool:
    """Return whether a value is meant to win, as one of a later file or a more special name."""
    later = user.files[user.files.index(path) + 1 :]
    if winner.value_span.source.name in later:
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
        return problem, _help_for(wanted, entry)
    if declared is None:
        return None, None
    return find_refusal(declared, entry.value), find_nearest_choice(declared, entry.value)


def _help_for(wanted: str, entry: ParameterEntry) -> str | None:
    if (wanted, entry.type) == ('double', 'integer'):
        return f'write {float(entry.value)}'
    if wanted == 'double_array' and entry.type == 'integer_array':
        return f'write {[float(item) for item in entry.value]}'
    if wanted == 'string' and entry.type in ('integer', 'double', 'bool'):
        return f"put it in quotes: '{entry.value_span.text}'"
    return None
