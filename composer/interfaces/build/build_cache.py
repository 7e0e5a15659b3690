"""Cache built interface packages.

    $XDG_CACHE_HOME/composer/interfaces/
        example_interfaces-1f6a…/          a finished package, never changed
        example_interfaces-1f6a….partial/  an unfinished package
        example_interfaces-1f6a….lock      locked by the process that builds it

A package is built in its partial folder, which is renamed at the end. A folder that does not fit
its manifest is damaged, and built again. Generators and compilers inherit the lock: no other
process builds the package while one of them still writes, even if the process that started them
was killed. A partial folder whose lock is free is removed.
"""

import errno
import fcntl
import hashlib
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path

from composer.ament import BUILD_MANIFEST
from composer.errors import ComposerError
from composer.input_limits import UnreadableFileError, read_file
from composer.interfaces.build.manifest import is_intact, read_manifest, write_manifest
from composer.interfaces.definitions.package_folder import PackageDefinitions
from composer.records import record
from composer.signals import interrupting

# Raise it whenever the builder builds something else from the same definitions.
BUILDER_FORMAT = 2

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


# What the system says if a disk, or the user's part of it, is full.
FULL = (errno.ENOSPC, errno.EDQUOT)


class CacheError(ComposerError):
    """The cache cannot be written."""


@record
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
    parts = [compute_environment_key(prefixes), definitions.package]
    parts += [f'{name} {key}' for name, key in sorted(used.items())]
    parts += [text for source in sorted(definitions.sources.items()) for text in source]
    used_names = {reference.message.partition('/')[0] for reference in definitions.references}
    parts += [_package_version(name, prefixes) for name in sorted(used_names)]
    return _hash(parts)


def compute_environment_key(prefixes: Iterable[Path]) -> str:
    """Compute the key of the ROS, the Python and the Composer that packages are built for.

    Args:
        prefixes: where ROS is installed, and other workspaces.
    """
    prefixes = tuple(prefixes)
    parts = [str(BUILDER_FORMAT), EXTENSION_SUFFIXES[0], _numpy_version()]
    return _hash([*parts, *(_package_version(name, prefixes) for name in _VERSIONED_PACKAGES)])


def _hash(parts: Iterable[str]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode()
        digest.update(b'%d:%b' % (len(data), data))
    return digest.hexdigest()[:16]


def provide_cached(
    name: str,
    environment: str,
    build: Callable[[BuildFolder], None],
    progress: Callable[[str], None],
) -> Path:
    """Return the folder of a package in the cache; build it if it is not there or is damaged.

    Args:
        name: the name of the folder.
        environment: the key of the ROS and Python that it is built for.
        build: fills the folder.
        progress: told before waiting for another process that builds the same package, and if
            the folder is damaged.

    Raises:
        CacheError: the cache cannot be written, or has a colon in its path.
        UntrustedFolderError: another user can change the folder.
    """
    place = find_cache() / name
    if os.pathsep in str(place):
        message = f"built interface packages cannot be in '{place.parent}': no program finds them"
        raise CacheError(message, help="name a folder without ':' in XDG_CACHE_HOME")
    try:
        if not is_intact(place):
            with interrupting():
                _provide(place, environment, build, progress)
        with suppress(OSError):
            # The time of the last use, for `list_built`.
            (place / BUILD_MANIFEST).touch()
    except OSError as error:
        if error.errno in FULL:
            message = f"there is no space left for built interface packages in '{place.parent}'"
        else:
            message = f'the cache of built interface packages cannot be written: {error}'
        advice = 'make room there, or name another folder in XDG_CACHE_HOME'
        raise CacheError(message, help=advice) from error
    return place


def list_built(prefixes: Iterable[Path]) -> dict[str, Path]:
    """Return the folder of each package in the cache; of several builds, the last one used.

    Args:
        prefixes: where ROS is installed; what was built for another ROS is left out.

    Raises:
        UntrustedFolderError: another user can change a folder.
    """
    environment = compute_environment_key(prefixes)
    found: list[tuple[int, Path]] = []
    for manifest in find_cache().glob(f'*/{BUILD_MANIFEST}'):
        with suppress(OSError, ValueError):
            fits = read_manifest(manifest.parent).get('environment') == environment
            if fits and is_intact(manifest.parent):
                found.append((manifest.stat().st_mtime_ns, manifest.parent))
    return {place.name.rpartition('-')[0]: place for _, place in sorted(found)}


def _provide(
    place: Path,
    environment: str,
    build: Callable[[BuildFolder], None],
    progress: Callable[[str], None],
) -> None:
    place.parent.mkdir(parents=True, exist_ok=True)
    with _lock(place, progress) as descriptor:
        if is_intact(place):
            return
        _remove_leftovers(place.parent, place)
        partial = _partial(place)
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(mode=0o755)
        try:
            if os.path.lexists(place):
                progress('the build in the cache is damaged')
            build(BuildFolder(partial, descriptor))
            write_manifest(partial, place, environment)
            _remove(place)
            partial.rename(place)
        finally:
            shutil.rmtree(partial, ignore_errors=True)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


@contextmanager
def _lock(place: Path, progress: Callable[[str], None]) -> Iterator[int]:
    """Hold the lock of a package; it is free when no process has its file open."""
    descriptor = os.open(_lock_file(place), os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            progress('waiting for another start that builds it')
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
    return _read_text(Path(spec.origin).with_name('version.py')) if spec and spec.origin else ''


def _package_version(package: str, prefixes: Iterable[Path]) -> str:
    """Return where a package is, and its manifest, which has its version; or an empty text.

    Built libraries name the folders of those that they use. Other workspaces change nothing.
    """
    for prefix in prefixes:
        if text := _read_text(prefix / 'share' / package / 'package.xml'):
            return f'{prefix}\n{text}'
    return ''


def _read_text(path: Path) -> str:
    """Return the text of a file; an empty text if it cannot be read."""
    with suppress(UnreadableFileError):
        return read_file(path).decode(errors='replace')
    return ''
