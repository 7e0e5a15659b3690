"""A launch file → what it consists of."""

from __future__ import annotations

import contextlib
import sys
from typing import TYPE_CHECKING

from composer.errors import UsageError
from composer.launch_files.description_reader import DescriptionReader
from composer.launch_files.loading import Loader
from composer.launch_files.place import Place

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from composer.launch_files.results import Imported


def import_file(path: Path, given: Mapping[str, str]) -> Imported:
    """Return what a launch file consists of.

    Args:
        given: The values of arguments.

    Raises:
        ComposerError: `launch` is not installed, or the file cannot be read.
    """
    place = Place(Loader(), dict(given))
    before = sys.argv
    # Launch files may read their arguments themselves.
    sys.argv = ['ros2', 'launch', str(path), *(f'{name}:={given[name]}' for name in given)]
    try:
        # Standard output is for the system, whatever launch files print.
        with contextlib.redirect_stdout(sys.stderr):
            DescriptionReader(place).read([place.loader.open(path.absolute())])
            place.declare_rest()
    finally:
        sys.argv = before
    return place.result


def read_words(words: Sequence[str]) -> dict[str, str]:
    """Return the arguments that words give, `name:=value`.

    Raises:
        UsageError: One is of another form.
    """
    given = {}
    for word in words:
        name, separator, value = word.partition(':=')
        if not separator or not name:
            meant = word.replace('=', ':=', 1) if '=' in word else 'NAME:=VALUE'
            message = f"'{word}' is no argument of a launch file"
            raise UsageError(message, help=f'write {meant}')
        given[name] = value
    return given
