"""A launch file → what it consists of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.launch_files.loading import Loader
from composer.launch_files.reader import DescriptionReader, Imported

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


def import_file(path: Path, given: Mapping[str, str]) -> Imported:
    """Return what a launch file consists of.

    Args:
        given: The values of arguments.

    Raises:
        ComposerError: `launch` is not installed, or the file cannot be read.
    """
    reader = DescriptionReader(Loader(), dict(given))
    reader.read([reader.loader.open(path.absolute())])
    return reader.result
