"""What a launch file consists of: arguments, processes, and what cannot be kept."""

from __future__ import annotations

import os
import re
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from composer.errors import ComposerError
from composer.expressions import written_in_expression

if TYPE_CHECKING:
    from collections.abc import Mapping

    from composer.launch_files.surroundings import Wait
    from composer.launch_files.texts import Text

_POLL_SEC = 0.001
# A constant in an expression, and not the name in `args['name']`.
_CONSTANT = re.compile(r"""(?<!args\[)('[^']*'|"[^"]*")""")


class Origin(str):
    """Where an action was made, as in `line 42 of x.launch.py`; empty if nobody knows.

    Attributes:
        path: Its file.
        line: Counted from 1; 0 if nobody knows.
    """

    path: Path
    line: int

    __slots__ = ('line', 'path')

    def __new__(cls, path: Path = Path(), line: int = 0) -> Self:
        """Return that of a line."""
        origin = super().__new__(cls, f'line {line} of {path.name}' if line else '')
        origin.path, origin.line = path, line
        return origin


class LaunchError(ComposerError):
    """A launch file cannot be read."""


def _wait_for_tick() -> int:
    """Return the newest time of files, in ns; those that are written from now on have a later one.

    Files have the time of the kernel's last tick, which comes every few milliseconds.
    """
    with tempfile.TemporaryFile(buffering=0) as file:
        begun_ns = os.fstat(file.fileno()).st_mtime_ns
        while os.fstat(file.fileno()).st_mtime_ns == begun_ns:
            time.sleep(_POLL_SEC)
            file.write(b'\n')
    return begun_ns


@dataclass
class Argument:
    """A launch argument; all are texts.

    Attributes:
        default: `None` if a value is required.
        given: The value that it is imported with.
        fixed: Whether functions of the launch file depend on its value, so that it cannot change.
    """

    name: str
    default: Text | None
    description: str = ''
    choices: tuple[str, ...] = ()
    given: str = ''
    fixed: bool = False


@dataclass
class Entry:
    """A process of the system.

    Attributes:
        section: `processes` or `containers`.
        action: The object of `launch` that it is made of.
        remarks: What could not be kept of it.
    """

    section: str
    name: str
    data: dict[str, Any]
    action: Any
    origin: Origin
    when: str
    holds: bool
    waits: list[Wait]
    environment: dict[str, Text | None]
    remarks: list[str] = field(default_factory=list)


@dataclass
class Imported:
    """What a launch file consists of.

    Attributes:
        given: The values of arguments that the import was given.
        started_ns: When the import began: files of before are not written by it.
    """

    arguments: dict[str, Argument] = field(default_factory=dict)
    entries: list[Entry] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    given: Mapping[str, str] = field(default_factory=dict)
    started_ns: int = field(default_factory=_wait_for_tick)

    def freeze(self, *used: Text | str) -> list[Argument]:
        """Keep the arguments in texts and expressions as they are, and return them.

        For what cannot follow them: it was read or decided by the import.
        """
        found = self.depends(*used)
        for argument in found:
            if not argument.fixed:
                argument.fixed = True
                self.freeze(argument.default or '')
        return found

    def depends(self, *used: Text | str) -> list[Argument]:
        """Return the arguments in texts and expressions."""
        codes = ' '.join(each if isinstance(each, str) else each.code for each in used)
        codes = _CONSTANT.sub("''", codes)
        return [
            argument
            for argument in self.arguments.values()
            if re.search(
                rf'(?<![\w.]){re.escape(written_in_expression(argument.name))}(?!\w)', codes
            )
        ]

    def is_new_file(self, path: str) -> bool:
        """Return whether a helper of the launch file has written a file just now."""
        try:
            is_new = Path(path).stat().st_mtime_ns > self.started_ns
        except (OSError, ValueError):
            return False
        return is_new and path.startswith(f'{tempfile.gettempdir()}/') and os.path.isfile(path)

    def words(self) -> list[str]:
        """Return the arguments that the system is imported with, as on a command line."""
        return [
            f'{name}:={each.given}'
            for name, each in self.arguments.items()
            if name in self.given or each.default is None
        ]
