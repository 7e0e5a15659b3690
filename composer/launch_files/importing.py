"""A launch file → what it consists of."""

from __future__ import annotations

import contextlib
import sys
from typing import TYPE_CHECKING

from composer.launch_files.description_reader import DescriptionReader
from composer.launch_files.loading import Loader
from composer.launch_files.place import Place

if TYPE_CHECKING:
    from collections.abc import Mapping
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
