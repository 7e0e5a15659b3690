"""Systems of installed ROS packages: `PACKAGE FILE`, as `ros2 launch` takes launch files."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from composer.ament import (
    PACKAGE_INDEX,
    ament_prefixes,
    explain_missing_package,
    find_share,
    list_packages,
    locate_packages,
)
from composer.application.file_selection import SUFFIXES
from composer.application.launch_file import LAUNCH_SUFFIXES
from composer.errors import UsageError
from composer.language.paths import is_in_package, resolve_path
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Sequence

# The folder of a package's share folder with its systems.
_SYSTEMS = 'systems'
_NAME = re.compile('[a-z][a-z0-9_]*')
# After the name of a scenario file comes that of a case.
_FILE = re.compile(rf'.*({"|".join(map(re.escape, (*SUFFIXES, *LAUNCH_SUFFIXES)))})(?=$|::)')


def resolve_words(words: Sequence[str]) -> list[str]:
    """Return the words of a command line with paths for the files of packages.

    These are `package://PACKAGE/FILE`, and `PACKAGE FILE`: a file in `share/PACKAGE/systems`, or
    relative to `share/PACKAGE`. PACKAGE alone, as the first word, is all of its systems.

    Raises:
        UsageError: The first word names a package that is not installed, or lacks the file.
        PackagePathError: The package of `package://PACKAGE/FILE` is not installed.
    """
    resolved: list[str] = []
    left = list(words)
    while left:
        word = left.pop(0)
        if is_in_package(word) and (not resolved or _FILE.match(word)):
            resolved.append(_resolve(word))
        elif left and (path := _find_pair(word, left[0], is_first=not resolved)):
            resolved.append(path)
            left.pop(0)
        else:
            folder = None if resolved or os.path.lexists(word) else _find_systems(word)
            resolved.append(str(folder or word))
    return resolved


def complete_file(words: Sequence[str], incomplete: str) -> list[str]:
    """Return the packages that have systems, or the systems of the package before, by prefix."""
    if words:
        folder = _find_systems(words[-1])
        names = _list_systems(folder) if folder else []
    else:
        prefixes = locate_packages(ament_prefixes(), PACKAGE_INDEX)
        names = sorted(
            package
            for package, prefix in prefixes.items()
            if _list_systems(prefix / 'share' / package / _SYSTEMS)
        )
    return [name for name in names if name.startswith(incomplete)]


def _find_pair(package: str, file: str, *, is_first: bool) -> str | None:
    """Return the path of a package's file, `None` if the two words are something else.

    Raises:
        UsageError: They are certainly meant for a file of a package, and it is not there.
    """
    is_pair = _NAME.fullmatch(package) and _FILE.match(file)
    if not is_pair or ':=' in file or file.startswith('/') or os.path.isfile(package):
        return None
    name = file.partition('::')[0]
    if os.path.exists(package) and os.path.exists(name):
        return None
    share = find_share(package)
    for inside in (f'{_SYSTEMS}/{name}', name):
        if share and os.path.isfile(share / inside):
            return _resolve(f'package://{package}/{inside}{file.removeprefix(name)}')
    if not is_first or os.path.exists(package) or os.path.exists(name):
        return None
    if share is None:
        message = f"no package '{package}' is installed"
        raise UsageError(message, help=explain_missing_package(package, list_packages()))
    message = f"package '{package}' has no file '{name}', in {_SYSTEMS}/ or beside it"
    otherwise = f'{share} has no systems'
    systems = _list_systems(share / _SYSTEMS)
    raise UsageError(message, help=suggest(name, systems, 'it has') if systems else otherwise)


def _resolve(address: str) -> str:
    """Return the path of `package://PACKAGE/FILE`, with the case that may follow it."""
    name, separator, case = address.partition('::')
    return f'{resolve_path(name, Path())}{separator}{case}'


def _find_systems(package: str) -> Path | None:
    """Return the folder of a package's systems, if it is installed and has some."""
    share = find_share(package) if _NAME.fullmatch(package) else None
    return share / _SYSTEMS if share and _list_systems(share / _SYSTEMS) else None


def _list_systems(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob('*') if path.suffix in SUFFIXES)
