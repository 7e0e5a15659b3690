"""The parts of a system that its processes run."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from composer.language.specs import SystemSpec, WorkerSpec
    from composer.planning.snapshot import Snapshot


def used_workers(spec: SystemSpec) -> list[str]:
    """Return the names of the workers that nodes are in."""
    return list(dict.fromkeys(each.worker for each in spec.nodes.values() if each.worker))


def find_moved(old: SystemSpec, new: SystemSpec) -> list[str]:
    """Return the full names of the nodes that have another process in `new`."""
    before = {each.full_name: each.worker for each in old.nodes.values()}
    return [
        each.full_name
        for each in new.nodes.values()
        if before.get(each.full_name, each.worker) != each.worker
    ]


def needs_new_process(old: WorkerSpec, new: WorkerSpec) -> bool:
    """Return whether a process cannot become what a worker says now."""
    return old.environment != new.environment or (new.nice or 0) < (old.nice or 0)


def part_of(snapshot: Snapshot, name: str) -> Snapshot:
    """Return what the process of a worker is compared by; `''` is that of the system."""
    spec = snapshot.spec.in_worker(name)
    if not name:
        return replace(snapshot, spec=spec)
    if level := spec.workers[name].log_level:
        nodes = {
            key: node if node.log_level else replace(node, log_level=level)
            for key, node in spec.nodes.items()
        }
        spec = replace(spec, nodes=nodes)
    # What is left out is what the whole system is compared by.
    return replace(snapshot, spec=spec, sources={}, definitions={})
