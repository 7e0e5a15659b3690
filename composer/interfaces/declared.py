"""The interface packages that a file declares: described for checks, provided for a start."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import diagnostic_at
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from composer.diagnostics import Diagnostic
    from composer.language.loaded_system import LoadedSystem
    from composer.language.specs import SystemSpec


def declared_folders(system: LoadedSystem) -> dict[str, Path]:
    """Return the folder of each interface package that a system declares."""
    return _folders_of(system.spec)


def _folders_of(spec: SystemSpec | None) -> dict[str, Path]:
    return {package: Path(folder) for package, folder in spec.interfaces.items()} if spec else {}


def describe_declared(
    system: LoadedSystem, installed: InterfaceCatalogue
) -> tuple[InterfaceCatalogue, frozenset[str], list[Diagnostic]]:
    """Read the packages that a file declares.

    Returns:
        What describes the types of the system, the packages of which nothing is known because
        something is wrong with them, and what that is.
    """
    # What is left out is checked all the same, and needs its types for that.
    folders = _folders_of(system.unused) | declared_folders(system)
    if not folders:
        return installed, frozenset(), []
    catalogue = InterfaceCatalogue()
    absent = {package: folder for package, folder in folders.items() if not _is_folder(folder)}
    findings = [
        diagnostic_at(
            system.positions.value(('interfaces', package)),
            'unknown-interfaces',
            f"there is no folder '{folder}' with the definitions of '{package}'",
        )
        for package, folder in absent.items()
    ]
    present = {package: folder for package, folder in folders.items() if package not in absent}
    if present and catalogue.available:
        faults = _describe_folders(present, catalogue, system)
        absent |= present if faults else {}
        findings += faults
    return catalogue, frozenset(absent), findings


def _describe_folders(
    folders: Mapping[str, Path], catalogue: InterfaceCatalogue, system: LoadedSystem
) -> list[Diagnostic]:
    """Add what folders define to a catalogue; return what is wrong with it instead, if it is."""
    # The parser of definitions is slow to import, and most files declare no packages.
    from composer.interfaces.packages import DefinitionsError, load_packages

    try:
        packages = load_packages(folders)
    except DefinitionsError as error:
        return list(error.diagnostics)
    except ComposerError as error:
        span = system.positions.key(('interfaces',))
        return [diagnostic_at(span, 'unreadable-interfaces', str(error), help=error.help)]
    for package in packages:
        for description in package.interfaces.values():
            catalogue.add(description)
    return []


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        # The path is too long, or leads through what may not be searched.
        return False


def provide_declared(system: LoadedSystem, progress: Callable[[str], None]) -> Sequence[str]:
    """Make the packages that a file declares importable, building what has to be built.

    Returns:
        Their names.

    Raises:
        ComposerError: One of them cannot be provided; its help says what to install or mend.
    """
    folders = declared_folders(system)
    if not folders:
        return ()
    from composer.interfaces.packages import provide_packages

    return [provided.package for provided in provide_packages(folders, progress)]
