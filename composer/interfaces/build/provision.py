"""Provide interface packages: installed ones, cached ones, and those built now."""

import importlib
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Literal, TypeAlias

from composer.ament import BUILD_MANIFEST, INTERFACE_INDEX, ament_prefixes, find_package
from composer.errors import ComposerError
from composer.interfaces.build.build_cache import (
    BuildFolder,
    compute_environment_key,
    compute_key,
    provide_cached,
)
from composer.interfaces.definitions.package_folder import PackageDefinitions
from composer.interfaces.definitions.packages import (
    used_packages,
)
from composer.records import record

# To build so many takes a minute.
_MANY_INTERFACES = 50

Origin: TypeAlias = Literal['installed', 'cached', 'built']


class ModuleTakenError(ComposerError):
    """Another Python module has the name of an interface package."""


@record
class ProvidedPackage:
    """An interface package that is built.

    Attributes:
        package: its name.
        prefix: where it is, for an `InterfaceCatalogue`.
        origin: `installed`, `cached` by an earlier start, or `built` now.
    """

    package: str
    prefix: Path
    origin: Origin

    @property
    def is_installed(self) -> bool:
        """Whether it is installed; all others have a prefix of their own in the cache."""
        return self.origin == 'installed'


def provide_packages(
    packages: Iterable[PackageDefinitions],
    progress: Callable[[str], None],
) -> list[ProvidedPackage]:
    """Find interface packages, and build those that are neither installed nor cached.

    Args:
        packages: definitions without errors, each package after those that it uses.
        progress: gets a short line about each step that takes long.

    Raises:
        DefinitionsDifferError: a package is installed with other definitions.
        BuildToolsMissingError: the system has not all that a build needs.
        BuildError: a generator or compiler failed.
        CacheError: the cache cannot be written.
        UntrustedFolderError: another user can change a package in the cache.
    """
    provider = _Provider(ament_prefixes(), progress)
    return [provider.provide(definitions) for definitions in packages]


class _Provider:
    """Provides packages one after the other; each can use those before it."""

    def __init__(self, prefixes: Sequence[Path], progress: Callable[[str], None]) -> None:
        self._prefixes = prefixes
        self._progress = progress
        self._places: dict[str, Path] = {}
        self._keys: dict[str, str] = {}

    def provide(self, definitions: PackageDefinitions) -> ProvidedPackage:
        installed = find_package(definitions.package, self._prefixes, INTERFACE_INDEX)
        if installed is not None:
            # Imported here, as the builder below: with a cached package it is not needed.
            from composer.interfaces.definitions.differences import require_same

            require_same(definitions, installed)
            return ProvidedPackage(definitions.package, installed, 'installed')
        return self._provide_built(definitions)

    def _provide_built(self, definitions: PackageDefinitions) -> ProvidedPackage:
        package = definitions.package
        used = used_packages(definitions)
        keys = {name: key for name, key in self._keys.items() if name in used}
        key = compute_key(definitions, self._prefixes, keys)
        origin: Origin = 'cached'

        def build(folder: BuildFolder) -> None:
            nonlocal origin
            origin = 'built'
            self._build(definitions, folder)

        place = provide_cached(
            f'{package}-{key}',
            compute_environment_key(self._prefixes),
            build,
            lambda line: self._progress(f'{package}: {line}'),
        )
        self._places[package], self._keys[package] = place, key
        return ProvidedPackage(package, place, origin)

    def _build(self, definitions: PackageDefinitions, folder: BuildFolder) -> None:
        from composer.interfaces.build.builder import Dependencies, build_package

        count = len(definitions.interfaces)
        interfaces = '1 interface' if count == 1 else f'{count} interfaces'
        of_all = f' of {count + len(definitions.left_out)}' if definitions.left_out else ''
        self._progress(f'{definitions.package}: building {interfaces}{of_all} ...')
        if count > _MANY_INTERFACES:
            self._progress(
                f"{definitions.package}: to build less, list what you use under 'only:'"
            )
        start = time.monotonic()
        build_package(
            definitions,
            folder.path,
            Dependencies(self._prefixes, self._places),
            descriptors=[folder.descriptor],
        )
        duration_sec = time.monotonic() - start
        self._progress(f'{definitions.package}: built in {duration_sec:.1f} s')


def import_packages(provided: Iterable[ProvidedPackage]) -> list[Path]:
    """Let Python import packages.

    Returns:
        The prefixes of those that are not installed.

    Raises:
        ModuleTakenError: another Python module has a package's name.
    """
    built = [each for each in provided if not each.is_installed]
    for each in built:
        make_importable(each.package, each.prefix)
    return [each.prefix for each in built]


def make_importable(package: str, prefix: Path) -> None:
    """Let Python import a package from a prefix.

    Another build of it, to which `PYTHONPATH` leads in a shell that was set up for it, is left.

    Raises:
        ModuleTakenError: Python finds another module of that name first.
    """
    folder = prefix / 'python'
    sys.path[:] = [each for each in sys.path if not _is_other_build(Path(each), folder, package)]
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
        importlib.invalidate_caches()
    _forget_definitions(package)
    origin = _find_origin(package)
    if origin != folder / package / '__init__.py':
        message = (
            f'the interface package {package!r} cannot be imported: '
            f'{origin or "another package"} has that name'
        )
        raise ModuleTakenError(
            message,
            help='rename one of them; if the definitions, or the list of those to build, changed '
            'since the package was imported, start again',
        )


def _is_other_build(entry: Path, folder: Path, package: str) -> bool:
    is_build = entry != folder and (entry.parent / BUILD_MANIFEST).exists()
    return is_build and (entry / package).is_dir()


def _forget_definitions(package: str) -> None:
    """Forget the folder of a package's definitions: an import before the build has taken it."""
    loaded = sys.modules.get(package)
    if loaded is not None and loaded.__spec__ and loaded.__spec__.origin is None:
        for name in [each for each in sys.modules if f'{each}.'.startswith(f'{package}.')]:
            del sys.modules[name]


def _find_origin(package: str) -> Path | None:
    loaded = sys.modules.get(package)
    spec = loaded.__spec__ if loaded else find_spec(package)
    return Path(spec.origin) if spec and spec.origin else None
