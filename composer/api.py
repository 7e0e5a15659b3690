"""The public functions.

Each imports what it needs when it is called: behaviours import `composer` only for `Node`, and
must not pay for the rest.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.diagnostics import Diagnostic
    from composer.language.loaded_system import LoadedSystem


def load(path: str | Path) -> LoadedSystem:
    """Load a file as far as it can be read; its errors and warnings are in `diagnostics`."""
    from composer.language.pipeline import load_system

    return load_system(Path(path))


def check(path: str | Path) -> list[Diagnostic]:
    """Return the errors and warnings of a file, from top to bottom.

    The file is checked in each combination that it names under `check:`.
    """
    from composer.application.check import CheckOptions
    from composer.application.check import check as find_errors

    return sorted(
        find_errors([str(path)], CheckOptions()).findings, key=lambda each: each.sort_key
    )


def up(
    path: str | Path,
    words: Sequence[str] = (),
    ros_arguments: Sequence[str] = (),
    log_levels: Sequence[str] = (),
    *,
    layers: Sequence[str | Path] = (),
    set_values: Sequence[str] = (),
) -> int:
    """Run the system that a file declares until it is stopped; return the exit code.

    Args:
        words: Values for the arguments that the file declares, as in `['a:=1']`.
        ros_arguments: As after `--ros-args` on a command line.
        log_levels: As with `--log-level`: `debug` for all nodes, `talker:=debug` for one.
        layers: Files that change the first one, applied in order.
        set_values: Values to change, as with `--set`: `['nodes.talker.log_level=debug']`.

    Raises:
        RosNotFoundError: There is no rclpy.
        StartError: The system could not start.
        UsageError: The arguments do not fit the file, or the ROS arguments are wrong.
    """
    from composer.application.up import up as run

    paths = [Path(each) for each in (path, *layers)]
    return run(paths, words, ros_arguments, log_levels, set_values)
