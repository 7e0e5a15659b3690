"""Where built interface packages are kept, so that they are built once.

    $XDG_CACHE_HOME/composer/interfaces/
        example_interfaces-1f6a…/          a finished package, never changed
        example_interfaces-1f6a….partial/  one in the making
        example_interfaces-1f6a….lock      locked by whoever makes it

A package is made in its partial folder and renamed at the end, so a name without `.partial` is
whole. The lock is passed on to generators and compilers: while one of them still writes, nobody
else starts, even if the process that wanted the package was killed. A partial folder without a
lock is waste.
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

# To be raised whenever the builder makes something else of the same definitions.
BUILDER_FORMAT = 1

# Packages of ROS whose releases may change what is built, or what it runs with.
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
    """Get the cache's folder; a relative `XDG_CACHE_HOME` does not count, by its specification."""
    home = os.environ.get('XDG_CACHE_HOME', '')
    base = Path(home) if home.startswith('/') else Path.home() / '.cache'
    return base / 'composer' / 'interfaces'


def compute_key(
    definitions: PackageDefinitions,
    prefixes: Iterable[Path],
    used: Mapping[str, str],
) -> str:
    """Compute by what a built package is known: equal keys mean an equal result.

    Args:
        definitions: what it is built from.
        prefixes: where ROS is installed.
        used: the keys of packages that it uses and that are built as well.

    Returns:
        16 hexadecimal digits.
    """
    prefixes = tuple(prefixes)
    digest = hashlib.sha256()
    parts = [str(BUILDER_FORMAT), definitions.package, EXTENSION_SUFFIXES[0], _numpy_version()]
    parts += [f'{name} {key}' for name, key in sorted(used.items())]
    parts += [text for source in sorted(definitions.sources.items()) for text in source]
    parts += map(str, prefixes)
    foreign = {reference.message.partition('/')[0] for reference in definitions.references}
    names = (*_VERSIONED_PACKAGES, *sorted(foreign - {definitions.package}))
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
    """Get a package from the cache, building it if it is not there.

    Args:
        name: of the package's folder in the cache.
        build: fills the folder.
        waiting: called before waiting for another process that builds the same.

    Returns:
        the package's folder.

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
    _remove_waste(place.parent, place)
    shutil.rmtree(folder.path, ignore_errors=True)
    folder.path.mkdir()
    try:
        build(folder)
        folder.path.rename(place)
    finally:
        shutil.rmtree(folder.path, ignore_errors=True)


@contextmanager
def _lock(place: Path, waiting: Callable[[], None]) -> Iterator[int]:
    """Hold the lock of a package; it ends when no process has its file open any more."""
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


def _remove_waste(cache: Path, current: Path) -> None:
    """Remove what killed builds of other packages left."""
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
    """Get NumPy's version without importing it: built extensions depend on it."""
    spec = find_spec('numpy')
    with suppress(OSError):
        if spec and spec.origin:
            return Path(spec.origin).with_name('version.py').read_text(encoding='utf-8')
    return ''


def _package_version(package: str, prefixes: Iterable[Path]) -> str:
    """Read a package's manifest, which has its version; a missing package is a version, too."""
    for prefix in prefixes:
        with suppress(OSError):
            return (prefix / 'share' / package / 'package.xml').read_text(encoding='utf-8')
    return ''
