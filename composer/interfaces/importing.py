"""Make built interface packages importable by the running process."""

import importlib
import sys
from importlib.util import find_spec
from pathlib import Path

from composer.errors import ComposerError


class ModuleTakenError(ComposerError):
    """Python already has another module of an interface package's name."""


def make_importable(package: str, prefix: Path) -> None:
    """Have `import package` find the package in a prefix, now and in modules imported later.

    Raises:
        ModuleTakenError: another module of that name is found first.
    """
    folder = prefix / 'python'
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
        importlib.invalidate_caches()
    origin = _find_origin(package)
    if origin != folder / package / '__init__.py':
        message = (
            f'the interface package {package!r} cannot be imported: '
            f'{origin or "another package"} has that name'
        )
        raise ModuleTakenError(
            message,
            help='rename one of them; if the definitions changed since the package was imported, '
            'start again',
        )


def _find_origin(package: str) -> Path | None:
    loaded = sys.modules.get(package)
    spec = loaded.__spec__ if loaded else find_spec(package)
    return Path(spec.origin) if spec and spec.origin else None
