"""The interface packages that a file declares: read once, for checks and for a start."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import diagnostic_at
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.paths import explain_absent, path_of_folder
from composer.records import record
from composer.spelling import suggest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from composer.diagnostics import Diagnostic, Span
    from composer.interfaces.build.provision import ProvidedPackage
    from composer.interfaces.definitions.package_folder import PackageDefinitions
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec
    from composer.yaml_text.positions import SourceMap


@record
class DeclaredPackages:
    """The interface packages that a file declares, and the types that its system can use.

    Attributes:
        catalogue: Describes the types of installed and of declared packages.
        folders: The folder of each package that the system needs.
        definitions: What the folders define, each package after those that it uses; `None` if
            they were not read.
        unreadable: The packages with errors; nothing is known of their types.
        findings: These errors.
        listed: What alone is built of a package.
    """

    catalogue: InterfaceCatalogue
    folders: Mapping[str, Path] = field(default_factory=dict)
    definitions: Sequence[PackageDefinitions] | None = None
    unreadable: frozenset[str] = frozenset()
    findings: Sequence[Diagnostic] = ()
    listed: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def explain_left_out(self, full_name: str) -> str | None:
        """Return the help for a type that the file leaves out of its package, if it does."""
        package, _, interface = full_name.partition('/')
        if any(full_name in definitions.left_out for definitions in self.definitions or ()):
            return f"add '{interface}' to 'only:' of '{package}' under 'interfaces:'"
        return None


def load_declared(system: LoadedSystem, installed: InterfaceCatalogue) -> DeclaredPackages:
    """Read the definitions of the packages that a file declares.

    Without any installed interface package, which is without ROS, only the folders are checked.
    """
    needed = _folders_of(system.spec)
    # Nodes that are left out are checked too, which needs their types.
    folders = _folders_of(system.unused) | needed
    if not folders:
        return DeclaredPackages(installed)
    catalogue = InterfaceCatalogue()
    listed = {
        package: interfaces
        for spec in (system.unused, system.spec)
        if spec
        for package, interfaces in spec.listed_interfaces.items()
    }

    def place(package: str) -> Span:
        return system.positions.value(path_of_folder(package, system.positions))

    absent = {package: folder for package, folder in folders.items() if not _is_folder(folder)}
    findings = [
        diagnostic_at(
            place(package),
            'unknown-interfaces',
            f"there is no folder '{folder}' with the definitions of '{package}'",
            help=explain_absent(folder, place(package), is_folder=True),
        )
        for package, folder in absent.items()
    ]
    present = {package: folder for package, folder in folders.items() if package not in absent}
    if not present or not catalogue.available:
        return DeclaredPackages(catalogue, needed, None, frozenset(absent), findings, listed)
    definitions, errors = _load_folders(present, catalogue, system, listed)
    for package in definitions:
        for description in package.interfaces.values():
            catalogue.add(description)
    unreadable = frozenset(folders if errors else absent)
    errors = [*findings, *errors, *_find_unknown(definitions, listed, system.positions)]
    return DeclaredPackages(catalogue, needed, definitions, unreadable, errors, listed)


def provide_declared(
    declared: DeclaredPackages, progress: Callable[[str], None]
) -> Sequence[ProvidedPackage]:
    """Find the packages that a file declares, and build those that are not installed.

    Raises:
        ComposerError: A package cannot be provided; the help says what to install or change.
    """
    if not declared.folders:
        return ()
    # Most files declare no packages, and should not pay for these imports.
    from composer.interfaces.build.provision import provide_packages
    from composer.interfaces.definitions.packages import load_packages

    definitions = declared.definitions
    if definitions is None:
        definitions = load_packages(declared.folders, declared.catalogue, declared.listed)
    needed = [each for each in definitions if each.package in declared.folders]
    return provide_packages(needed, progress)


def import_declared(declared: DeclaredPackages, progress: Callable[[str], None]) -> list[Path]:
    """Make the packages that a file declares importable; see `provide_declared`.

    Returns:
        The prefixes of those that are not installed, each after those that it uses.

    Raises:
        ComposerError: A package cannot be provided, or another Python module has its name.
    """
    provided = provide_declared(declared, progress)
    if not provided:
        return []
    from composer.interfaces.build.provision import import_packages

    return import_packages(provided)


def _folders_of(spec: SystemSpec | None) -> dict[str, Path]:
    return {package: Path(folder) for package, folder in spec.interfaces.items()} if spec else {}


def _load_folders(
    folders: Mapping[str, Path],
    catalogue: InterfaceCatalogue,
    system: LoadedSystem,
    listed: Mapping[str, Sequence[str]],
) -> tuple[list[PackageDefinitions], Sequence[Diagnostic]]:
    """Return what the folders define, or nothing and the errors."""
    from composer.interfaces.definitions.packages import DefinitionsError, load_packages

    try:
        return load_packages(folders, catalogue, listed), ()
    except DefinitionsError as error:
        return [], [_placed(each, folders, system.positions) for each in error.diagnostics]
    except ComposerError as error:
        span = system.positions.key(('interfaces',))
        return [], [diagnostic_at(span, 'unreadable-interfaces', str(error), help=error.help)]


def _find_unknown(
    definitions: Iterable[PackageDefinitions],
    listed: Mapping[str, Sequence[str]],
    positions: SourceMap,
) -> Iterator[Diagnostic]:
    """Find listed interfaces that their package does not have."""
    for package in definitions:
        names = {*package.names().values(), *package.left_out}
        known = {name.partition('/')[2] for name in names}
        for index, interface in enumerate(listed.get(package.package, ())):
            if interface not in known:
                yield diagnostic_at(
                    positions.value(('interfaces', package.package, 'only', index)),
                    'unknown-type',
                    f"the package '{package.package}' has no '{interface}'",
                    help=suggest(interface, known, 'it has'),
                )


def _placed(finding: Diagnostic, folders: Mapping[str, Path], positions: SourceMap) -> Diagnostic:
    """Return a finding; one in a folder as a whole stands where the file names the folder."""
    package = next((each for each, path in folders.items() if str(path) == finding.file), None)
    if finding.span is not None or package is None:
        return finding
    span = positions.value(path_of_folder(package, positions))
    return diagnostic_at(span, finding.rule, finding.message, help=finding.help)


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        # The path is too long, or a folder on it cannot be searched.
        return False
