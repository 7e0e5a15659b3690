"""Cache built interface packages.

    $XDG_CACHE_HOME/composer/interfaces/
        example_interfaces-1f6a…/          a finished package, never changed
        example_interfaces-1f6a….partial/  an unfinished package
        example_interfaces-1f6a….lock      locked by the process that builds it

A package is built in its partial folder, which is renamed at the end: a folder without `.partial`
is complete. Generators and compilers inherit the lock: no other process builds the package while
one of them still writes, even if the process that started them was killed. A partial folder whose
lock is free is removed.
"""

import fcntl
import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path

from composer.errors import ComposerError
from composer.interfaces.definitions.package_folder import PackageDefinitions
from composer.signals import interrupting

# Raise it whenever the builder builds something else from the same definitions.
BUILDER_FORMAT = 1

# Packages of ROS whose releases may change what is built, or what it needs.
_VERSIONED_PACKAGES = (
    'rclpy',
    'rosidl_runtime_c',
    'rosidl_generator_c',
    'rosidl_generator_py',
    'rosidl_typesupport_c',
    'rosidl_typesupport_fastrtps_c',
    'rosidl_typesupport_introspection_c',
)


class CacheError(ComposerError):
    """The cache cannot be written."""


@dataclass(frozen=True, slots=True)
class BuildFolder:
    """An empty folder to build in, while its lock is held.

    Attributes:
        path: the folder.
        descriptor: the lock's open file, for the programs of the build to inherit.
    """

    path: Path
    descriptor: int


def find_cache() -> Path:
    """Return the folder of the cache; a relative `XDG_CACHE_HOME` is ignored, as specified."""
    home = os.environ.get('XDG_CACHE_HOME', '')
    base = Path(home) if home.startswith('/') else Path.home() / '.cache'
    return base / 'composer' / 'interfaces'


def compute_key(
    definitions: PackageDefinitions,
    prefixes: Iterable[Path],
    used: Mapping[str, str],
) -> str:
    """Compute the key of a built package: equal keys mean equal results.

    Args:
        definitions: what it is built from.
        prefixes: where ROS is installed.
        used: the keys of the packages that it uses and that were built too.

    Returns:
        16 hexadecimal digits.
    """
    prefixes = tuple(prefixes)
    digest = hashlib.sha256()
    parts = [str(BUILDER_FORMAT), definitions.package, EXTENSION_SUFFIXES[0], _numpy_version()]
    parts += [f'{name} {key}' for name, key in sorted(used.items())]
    parts += [text for source in sorted(definitions.sources.items()) for text in source]
    parts += map(str, prefixes)
    used_names = {reference.message.partition('/')[0] for reference in definitions.references}
    names = (*_VERSIONED_PACKAGES, *sorted(used_names - {definitions.package}))
    parts += [_package_version(name, prefixes) for name in names]
    for part in parts:
        data = part.encode()
        digest.update(b'%d:%b' % (len(data), data))
    return digest.hexdigest()[:16]


def provide_cached(
    name: str,
    build: Callable[[BuildFolder], None],
    waiting: Callable[[], None],
) -> Path:
    """Return the folder of a package in the cache; build the package if it is not there.

    Args:
        name: the name of the folder.
        build: fills the folder.
        waiting: called before waiting for another process that builds the same package.

    Raises:
        CacheError: the cache cannot be written.
    """
    cache = find_cache()
    place = cache / name
    if place.is_dir():
        return place
    try:
        cache.mkdir(parents=True, exist_ok=True)
        with _lock(place, waiting) as descriptor:
            if not place.is_dir():
                _fill(place, BuildFolder(_partial(place), descriptor), build)
    except OSError as error:
        message = f'the cache of built interface packages cannot be written: {error}'
        advice = 'make room there, or name another folder in XDG_CACHE_HOME'
        raise CacheError(message, help=advice) from error
    return place


def _fill(place: Path, folder: BuildFolder, build: Callable[[BuildFolder], None]) -> None:
    _remove_leftovers(place.parent, place)
    shutil.rmtree(folder.path, ignore_errors=True)
    folder.path.mkdir()
    with interrupting():
        try:
            build(folder)
            folder.path.rename(place)
        finally:
            shutil.rmtree(folder.path, ignore_errors=True)


@contextmanager
def _lock(place: Path, waiting: Callable[[], None]) -> Iterator[int]:
    """Hold the lock of a package; it is free when no process has its file open."""
    descriptor = os.open(_lock_file(place), os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            waiting()
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield descriptor
    finally:
        os.close(descriptor)


def _remove_leftovers(cache: Path, current: Path) -> None:
    """Remove the partial folders that killed builds of other packages left."""
    for path in cache.glob('*.partial'):
        place = path.with_suffix('')
        if place == current:
            continue
        with suppress(OSError):
            descriptor = os.open(_lock_file(place), os.O_RDWR | os.O_CREAT, 0o644)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(path, ignore_errors=True)
            finally:
                os.close(descriptor)


def _partial(place: Path) -> Path:
    return place.with_name(f'{place.name}.partial')


def _lock_file(place: Path) -> Path:
    return place.with_name(f'{place.name}.lock')


def _numpy_version() -> str:
    """Return the version of NumPy, on which built extensions depend, without importing it."""
    spec = find_spec('numpy')
    with suppress(OSError):
        if spec and spec.origin:
            return Path(spec.origin).with_name('version.py').read_text(encoding='utf-8')
    return ''


def _package_version(package: str, prefixes: Iterable[Path]) -> str:
    """Return the manifest of a package, which has its version; an empty text if it is missing."""
    for prefix in prefixes:
        with suppress(OSError):
            return (prefix / 'share' / package / 'package.xml').read_text(encoding='utf-8')
    return ''
