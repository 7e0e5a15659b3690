"""The interface packages that a file declares: described for checks, provided for a start."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.diagnostics import Diagnostic, diagnostic_at
from composer.errors import ComposerError
from composer.interfaces.catalogue import InterfaceCatalogue

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from composer.language import LoadedSystem


def declared_folders(system: LoadedSystem) -> dict[str, Path]:
    """Return the folder of each interface package that a file declares.

    Folders are relative to that of the file.
    """
    declared = system.spec.interfaces if system.spec else {}
    return {package: system.path.parent / folder for package, folder in declared.items()}


def describe_declared(
    system: LoadedSystem, installed: InterfaceCatalogue
) -> tuple[InterfaceCatalogue, list[Diagnostic]]:
    """Return what describes the types of a system, and what is wrong with those it declares."""
    folders = declared_folders(system)
    if not folders:
        return installed, []
    catalogue = InterfaceCatalogue()
    missing = [
        diagnostic_at(
            system.positions.value(('interfaces', package)),
            'unknown-interfaces',
            f"there is no folder '{folder}' with the definitions of '{package}'",
        )
        for package, folder in folders.items()
        if not folder.is_dir()
    ]
    present = {package: folder for package, folder in folders.items() if folder.is_dir()}
    if not present or not catalogue.available:
        return catalogue, missing
    # The parser of definitions is slow to import, and most files declare no packages.
    from composer.interfaces.packages import DefinitionsError, load_packages

    try:
        packages = load_packages(present)
    except DefinitionsError as error:
        return catalogue, [*missing, *error.diagnostics]
    except ComposerError as error:
        span = system.positions.key(('interfaces',))
        fault = diagnostic_at(span, 'unreadable-interfaces', str(error), help=error.help)
        return catalogue, [*missing, fault]
    for package in packages:
        for description in package.interfaces.values():
            catalogue.add(description)
    return catalogue, missing


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
