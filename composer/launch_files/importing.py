"""A launch file → what it consists of."""

from __future__ import annotations

import contextlib
import os
import posixpath
import sys
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from composer.launch_files.description_reader import DescriptionReader
from composer.launch_files.loading import Loader
from composer.launch_files.marks import Mark, following_texts, note_look
from composer.launch_files.place import Place
from composer.launch_files.substitutions import path_of, text_of
from composer.launch_files.texts import has_marks

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
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
    # Standard output is for the system, whatever launch files print.
    with contextlib.redirect_stdout(sys.stderr), joining_marks(), following_texts():
        DescriptionReader(place).read([place.loader.open(path.absolute())])
    return place.result


@contextlib.contextmanager
def joining_marks() -> Iterator[None]:
    """Have paths that launch files join with marks follow the arguments, as they may be absolute.

    Launch files may have imported `os.path.join` by its name: it is replaced before they are read.
    """
    join, divide, stat = posixpath.join, PurePath.__truediv__, os.stat

    def join_marks(first: Any, *others: Any) -> Any:
        texts = [os.fspath(each) for each in (first, *others)]
        if not any(has_marks(each) for each in texts):
            return join(first, *others)
        return Mark(path_of([text_of(str(each)) for each in texts]))

    def divide_marks(path: PurePath, part: Any) -> Any:
        is_marked = isinstance(part, str | PurePath) and has_marks(f'{path}{part}')
        return type(path)(join_marks(path, part)) if is_marked else divide(path, part)

    def find_marks(path: Any, *args: Any, **keywords: Any) -> Any:
        if isinstance(path, str | PurePath) and has_marks(str(path)):
            note_look(path)
        return stat(path, *args, **keywords)

    replaced: tuple[tuple[Any, str, Any, Any], ...] = (
        (posixpath, 'join', join_marks, join),
        (PurePath, '__truediv__', divide_marks, divide),
        (os, 'stat', find_marks, stat),
    )
    for owner, name, function, _ in replaced:
        setattr(owner, name, function)
    try:
        yield
    finally:
        for owner, name, _, before in replaced:
            setattr(owner, name, before)
