"""The difference between what a host has and what it is to have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from composer.hosts.host_parts import UNIT_COMMENT, part_of_nothing
from composer.planning.differences import find_new_start
from composer.planning.snapshot_data import decode_snapshot
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from composer.hosts.host_parts import Part
    from composer.language.specs import HostSpec

Action: TypeAlias = Literal['start', 'restart', 'reload', 'remove', 'nothing']

_MEGABYTE = 1_000_000
# Installed, a wheel takes about this many times its size.
_GROWTH = 4.5
_SCRIPTS = ('composer', 'up')


@record
class HostPlan:
    """What a deployment does on a host.

    Attributes:
        part: What the host is to have.
        changes: What is added (`+`), changed (`~`) and removed (`-`), with what it is.
        action: What becomes of the system that runs.
        reason: Why it must start again; empty if it need not.
        blobs: The digests of the files that the host lacks.
        wheels: The names of the wheels that it lacks.
        has_composer: Whether it has this Composer.
        needed_bytes: What it takes on the disk.
        conflicts: What must not be overwritten, as `path: why`.
        leaving: The nodes and processes that the host runs, and is not to run any more.
        coming: Those that it is to run, and does not run yet.
    """

    part: Part
    changes: tuple[tuple[str, str], ...]
    action: Action
    reason: str
    blobs: tuple[str, ...]
    wheels: tuple[str, ...]
    has_composer: bool
    needed_bytes: int
    conflicts: tuple[str, ...]
    leaving: frozenset[str]
    coming: frozenset[str]

    @property
    def transferred_bytes(self) -> int:
        """What goes over the network."""
        part = self.part
        blobs = sum(len(part.blobs[digest]) for digest in self.blobs)
        composer = 0 if self.has_composer else len(part.composer.data)
        return blobs + composer + sum(part.wheels[name].stat().st_size for name in self.wheels)


def plan_host(part: Part, facts: Mapping[str, Any]) -> HostPlan:
    """Return what must be done on a host."""
    old = facts['manifest'] or {'files': {}, 'packages': []}
    new = part.manifest
    there = _without(old, facts['missing'])
    changes = [*_compare_files(there, new), *_compare_packages(old, new)]
    changes += [('+', f'interface package {name}') for name in _added(old, new, 'interfaces')]
    if old.get('composer') != new['composer']:
        changes.append(('~' if facts['manifest'] else '+', 'Composer'))
    if facts['unit'] != part.unit:
        changes.append(('+' if facts['unit'] is None else '~', f'unit {facts["unit_path"]}'))
    known = {each['digest'] for each in old['files'].values()}
    blobs = tuple(digest for digest in part.blobs if digest not in known)
    has_venv = new['venv'] in facts['venvs']
    wheels = () if has_venv else tuple(each for each in part.wheels if each not in facts['wheels'])
    action, reason = _decide(old, part, facts, has_changes=bool(changes or facts['missing']))
    has_composer = new['composer'] in facts['composers']
    runs, is_to_run = frozenset(old.get('runs', ())), frozenset(new['runs'])
    return HostPlan(
        part=part,
        changes=tuple(changes),
        action=action,
        reason=reason,
        blobs=blobs,
        wheels=wheels,
        has_composer=has_composer,
        needed_bytes=_count_bytes(part, wheels, has_composer=has_composer, has_venv=has_venv),
        conflicts=tuple(_find_conflicts(part, facts)),
        leaving=runs - is_to_run,
        coming=is_to_run - runs,
    )


def plan_removal(host: HostSpec, facts: Mapping[str, Any]) -> HostPlan:
    """Return what must be done on a host that has a part, and is to have none any more."""
    manifest = facts['manifest']
    return HostPlan(
        part=part_of_nothing(host, manifest['part']),
        changes=tuple(('-', each) for each in manifest['runs']),
        action='remove',
        reason='nothing of the system is to run there any more',
        blobs=(),
        wheels=(),
        has_composer=True,
        needed_bytes=0,
        conflicts=(),
        leaving=frozenset(manifest['runs']),
        coming=frozenset(),
    )


def _compare_files(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    before, after = _contents(old), _contents(new)
    for name in sorted({*before, *after}):
        if name not in before:
            yield '+', name
        elif name not in after:
            yield '-', name
        elif before[name] != after[name]:
            yield '~', name


def _without(manifest: Mapping[str, Any], missing: Collection[str]) -> dict[str, Any]:
    """Return what a host has of a release of which somebody has removed files."""
    kept = {
        key: {name: each for name, each in manifest.get(key, {}).items() if name not in missing}
        for key in ('files', 'contents')
    }
    return {**manifest, **kept}


def _contents(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """Return the digests and modes of files as users know them: what is in wheels, not these."""
    found = {
        name.removeprefix('files/'): (each['digest'], each['mode'])
        for name, each in manifest['files'].items()
        if name.startswith('files/')
    }
    for name, digest in manifest.get('contents', {}).items():
        if '.dist-info/' not in name:
            found[name.removeprefix('files/')] = digest
    return found


def _compare_packages(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    before = dict(each.split('==') for each in old['packages'])
    after = dict(each.split('==') for each in new['packages'])
    for name in sorted({*before, *after}):
        if name not in before:
            yield '+', f'package {name} {after[name]}'
        elif name not in after:
            yield '-', f'package {name} {before[name]}'
        elif before[name] != after[name]:
            yield '~', f'package {name} {before[name]} → {after[name]}'


def _added(old: Mapping[str, Any], new: Mapping[str, Any], key: str) -> list[str]:
    return [each for each in new[key] if each not in old.get(key, ())]


def _decide(
    old: Mapping[str, Any], part: Part, facts: Mapping[str, Any], *, has_changes: bool
) -> tuple[Action, str]:
    if facts['state'].get('ActiveState') != 'active':
        return 'start', ''
    new = part.manifest
    if old.get('venv') != new['venv']:
        return 'restart', 'its packages change'
    if old.get('composer') != new['composer']:
        return 'restart', 'Composer changes'
    if old.get('interfaces') != new['interfaces']:
        return 'restart', 'its interface packages change'
    if cause := find_new_start(decode_snapshot(old['start']), decode_snapshot(new['start'])):
        keys = ' and '.join(sorted({each.key for each in cause.changes}))
        return 'restart', f'{keys}: {cause.reason}'
    if facts['unit'] != part.unit:
        return 'restart', 'its unit changes'
    if any(old['files'].get(name) != new['files'][name] for name in _SCRIPTS):
        return 'restart', 'its command line or environment changes'
    return ('reload' if has_changes else 'nothing'), ''


def _count_bytes(
    part: Part, wheels: tuple[str, ...], *, has_composer: bool, has_venv: bool
) -> int:
    # A file is there as it comes, in its release, and in the tree that runs.
    files = 3 * sum(map(len, part.blobs.values()))
    composer = 0 if has_composer else int(len(part.composer.data) * _GROWTH)
    sizes = {name: path.stat().st_size for name, path in part.wheels.items()}
    installed = 0 if has_venv else int(sum(sizes.values()) * _GROWTH)
    return files + composer + installed + sum(sizes[name] for name in wheels)


def _find_conflicts(part: Part, facts: Mapping[str, Any]) -> Iterator[str]:
    manifest = facts['manifest']
    new = {name: each['digest'] for name, each in part.manifest['files'].items()}
    new |= part.manifest['contents']
    for name, digest in facts['edited'].items():
        if new.get(name) != digest:
            yield f'{facts["root"]}/live/{name} was edited there'
    if manifest is not None and manifest['part'] != part.name:
        yield (
            f"{facts['root']} is of '{manifest['part']}', by another name of this host: remove "
            "that first, by 'composer deploy … --remove' with the files that have the name"
        )
    if facts['is_foreign']:
        yield f'{facts["root"]} is there, and was not written by Composer'
    if facts['unit'] is not None and facts['unit'] != part.unit:
        if manifest is None and not facts['is_pending']:
            is_own = UNIT_COMMENT in facts['unit']
            owner = (
                'is of a deployment to another folder' if is_own else 'was not written by Composer'
            )
            yield f'{facts["unit_path"]} is there, and {owner}'
        elif manifest is not None and facts['unit_digest'] != manifest['unit_digest']:
            yield f'{facts["unit_path"]} was edited there'


def find_space_problem(plan: HostPlan, facts: Mapping[str, Any]) -> str | None:
    """Return why the disk of a host is too small; `None` if it is not."""
    free, needed = facts['free_bytes'], plan.needed_bytes
    if needed <= free:
        return None
    return (
        f'host {plan.part.host.name}: {facts["folder"]} needs {_format_bytes(needed)}, '
        f'and its disk has {_format_bytes(free)}'
    )


def render_plan(plan: HostPlan, *, most_lines: int = 40) -> list[str]:
    """Return the lines that show a plan."""
    host = plan.part.host
    at = f' ({host.address})' if host.address != host.name else ''
    size = plan.transferred_bytes
    lines = [f'{host.name}{at}: {_describe(plan)}']
    shown = _fold(plan.changes)
    lines += [f'  {sign} {what}' for sign, what in shown[:most_lines]]
    if len(shown) > most_lines:
        lines.append(f'  … and {len(shown) - most_lines} more')
    if size and plan.changes:
        lines.append(f'  {_format_bytes(size)} to bring')
    lines += [f'  ! {each}' for each in plan.conflicts]
    return lines


def _describe(plan: HostPlan) -> str:
    if plan.action == 'nothing':
        return 'nothing to do'
    reason = f' ({plan.reason})' if plan.reason else ''
    return f'{plan.action}{reason}'


def _fold(changes: tuple[tuple[str, str], ...]) -> list[tuple[str, str]]:
    """Return changes with packages of one kind of change in one line."""
    lines = [each for each in changes if not each[1].startswith('package ')]
    for sign in '+~-':
        packages = [what for each, what in changes if each == sign and what.startswith('package ')]
        if len(packages) > 1:
            names = [each.split()[1] for each in packages]
            shown = ', '.join(names[:3]) + (', …' if len(names) > len(names[:3]) else '')
            lines.append((sign, f'{len(packages)} packages: {shown}'))
        else:
            lines += [(sign, each) for each in packages]
    return lines


def _format_bytes(count: int) -> str:
    return f'{count / _MEGABYTE:.1f} MB' if count >= _MEGABYTE else f'{count / 1000:.1f} kB'
