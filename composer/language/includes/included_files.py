"""The files that includes name: where they are, and how findings show them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from composer.language.paths import PathError, list_neighbours, resolve_path
from composer.spelling import suggest

if TYPE_CHECKING:
    from composer.diagnostics import Span


def locate_file(text: str, place: Span) -> Path:
    """Return the file that an include names.

    Raises:
        PathError: There is no such file.
    """
    path = resolve_path(text, place.source.folder)
    if not os.path.isfile(path):  # noqa: PTH113 - Path.is_file raises for names that are too long
        message = f"there is no file '{shown_path(path)}'"
        raise PathError(message, help=suggest(path.name, list_neighbours(path), 'there are'))
    return path


def shown_path(path: Path) -> str:
    """Return a path as findings show it: from the working folder, where it lies below that."""
    plain = Path(os.path.normpath(path))
    try:
        return str(plain.resolve().relative_to(Path.cwd()))
    except ValueError:
        return str(plain)
