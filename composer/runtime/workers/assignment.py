"""What a worker is told by the process of the system."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from composer.language.specs import BehaviourSpec, WorkerSpec
    from composer.planning.snapshot import Snapshot


@record
class ImportRequest:
    """The behaviours that a worker is to import.

    Attributes:
        search_path: The folders of the project, which are searched first.
        path: `sys.path` of the process of the system.
        sources: The texts of their modules, which may not be in the files any more.
        stale: The modules to execute anew.
    """

    behaviours: Sequence[BehaviourSpec]
    path: Sequence[str]
    search_path: Sequence[str]
    sources: Mapping[str, str]
    stale: Collection[str] = ()


@record
class Assignment:
    """What a worker is to run.

    Attributes:
        snapshot: Its part of the system.
        ros_arguments: The arguments after `--ros-args` of the command line.
        log_levels: The log levels of the command line.
    """

    worker: WorkerSpec
    snapshot: Snapshot
    ros_arguments: Sequence[str]
    log_levels: Sequence[str]
