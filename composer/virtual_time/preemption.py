"""Lets others run in the middle of a behaviour, where they could in a real system.

Threads are only exchanged between two lines of code that is nobody's library: there are the races
that a project can have and can mend. How many lines lie between two exchanges is chosen by the
seed: few in one run, many in the next.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random
    from types import FrameType

_PACKAGE: Final = str(Path(__file__).resolve().parents[1]) + os.sep
_LIBRARIES: Final = (
    _PACKAGE,
    sysconfig.get_paths()['stdlib'] + os.sep,
    sysconfig.get_paths()['platstdlib'] + os.sep,
    '<',
)
_ROS: Final = f'{os.sep}rclpy{os.sep}'
# The mean number of lines between two exchanges, one of which each run has.
_MEAN_LINES: Final = (2, 5, 20, 200)


@cache
def is_own_code(path: str) -> bool:
    """Tell whether a file is code of a project, and no library."""
    return not (path.startswith(_LIBRARIES) or 'site-packages' in path or _ROS in path)


def is_of_composer(path: str) -> bool:
    """Tell whether a file is this package's, or the command that starts it."""
    return path.startswith((_PACKAGE, '<'))


class Preemption:
    """Exchanges threads at lines that are chosen at random.

    Args:
        shuffle: Chooses.
        pause: Lets others run.
    """

    def __init__(self, shuffle: Random, pause: Callable[[], None]) -> None:
        self._shuffle = shuffle
        self._pause = pause
        self._mean = shuffle.choice(_MEAN_LINES)
        self._left = self._next_gap()

    def begin(self) -> None:
        """Exchange the calling thread from now on."""
        sys.settrace(self._on_call)

    def _next_gap(self) -> int:
        return 1 + int(self._shuffle.expovariate(1 / self._mean))

    def _on_call(self, frame: FrameType, _event: str, _argument: Any) -> Any:
        return self._on_line if is_own_code(frame.f_code.co_filename) else None

    def _on_line(self, _frame: FrameType, event: str, _argument: Any) -> Any:
        if event == 'line':
            self._left -= 1
            if self._left <= 0:
                self._left = self._next_gap()
                self._pause()
        return self._on_line
