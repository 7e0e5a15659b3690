"""`composer interfaces`: build, find, list and show interface packages."""

from __future__ import annotations

import re
import shlex
from typing import TYPE_CHECKING

import click

from composer.ament import ament_prefixes
from composer.application.output import show_findings
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode
from composer.interfaces.build.build_cache import list_built
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared_packages import load_declared, provide_declared
from composer.interfaces.definitions.installed_definitions import describe_interface
from composer.interfaces.definitions.rendering import render_definition
from composer.interfaces.search_paths import Entries, find_entries
from composer.language.pipeline import load_system
from composer.spelling import did_you_mean, find_nearest, suggest
from composer.terminal import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from composer.interfaces.build.provision import ProvidedPackage
    from composer.interfaces.catalogue import InterfaceKind
    from composer.interfaces.declared_packages import DeclaredPackages

_KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')


class UnknownInterfaceError(ComposerError):
    """No package that is installed or built has such an interface."""


class ConflictingPackagesError(ComposerError):
    """Two files declare packages of one name that differ."""


def build(paths: Sequence[Path]) -> int:
    """Build the packages that files declare and that are not installed or built yet."""
    declared = _load(paths)
    if declared is None:
        return ExitCode.FAILED
    for package in dict.fromkeys(each.package for each in _provide(declared)):
        click.echo(f'{package}: ready')
    return ExitCode.DONE


def print_path(paths: Sequence[Path]) -> int:
    """Print the prefixes of the packages that files declare, or of all that were built."""
    prefixes = _find_prefixes(paths)
    if prefixes is None:
        return ExitCode.FAILED
    for prefix in prefixes:
        click.echo(str(prefix))
    return ExitCode.DONE


def print_environment(paths: Sequence[Path], shell: str) -> int:
    """Print commands of a shell that set the variables by which programs find the packages.

    The shell adds to its own variables: wheels of ROS change those of this process.
    """
    prefixes = _find_prefixes(paths)
    if prefixes is None:
        return ExitCode.FAILED
    for name, entries in find_entries(prefixes).items():
        click.echo(_SHELLS[shell](name, entries))
    return ExitCode.DONE


def _find_prefixes(paths: Sequence[Path]) -> list[Path] | None:
    """Return the prefixes of packages that are not installed; `None` if a file has errors."""
    if not paths:
        return [*list_built(ament_prefixes()).values()]
    declared = _load(paths)
    if declared is None:
        return None
    _require_same(declared)
    provided = _provide(declared)
    return [*dict.fromkeys(each.prefix for each in provided if not each.is_installed)]


def _load(paths: Sequence[Path]) -> list[DeclaredPackages] | None:
    """Return what files declare; `None` if one has errors, which are shown."""
    declared = []
    findings = []
    for path in paths:
        system = load_system(path)
        declared.append(load_declared(system, InterfaceCatalogue()))
        findings += [*system.diagnostics, *declared[-1].findings]
    show_findings(findings)
    if has_errors(findings):
        return None
    for path, each in zip(paths, declared, strict=True):
        if not each.folders:
            click.echo(f'{path} declares no interfaces', err=True)
    return declared


def _provide(declared: Sequence[DeclaredPackages]) -> list[ProvidedPackage]:
    return [
        provided
        for each in declared
        for provided in provide_declared(each, lambda line: click.echo(line, err=True))
    ]


def _require_same(declared: Sequence[DeclaredPackages]) -> None:
    """Check that packages of one name are the same.

    Raises:
        ConflictingPackagesError: They are not; a program could import only one of them.
    """
    sources: dict[str, Mapping[str, str]] = {}
    for package in (package for each in declared for package in each.definitions or ()):
        if sources.setdefault(package.package, package.sources) != package.sources:
            message = f"the files declare different packages '{package.package}'"
            raise ConflictingPackagesError(message, help='name only one of these files')


def _format_for_sh(name: str, entries: Entries) -> str:
    first, last = shlex.quote(':'.join(entries.first)), shlex.quote(':'.join(['', *entries.last]))
    value = f'{first}"${{{name}:+:${name}}}"{last if entries.last else ""}'
    return f'export {name}={value}'


def _format_for_fish(name: str, entries: Entries) -> str:
    first, last = map(_quote_for_fish, entries.first), map(_quote_for_fish, entries.last)
    return ' '.join(['set -gx', name, *first, f'${name}', *last])


def _quote_for_fish(text: str) -> str:
    return "'" + re.sub(r"(['\\])", r'\\\1', text) + "'"


# How shells set a variable that holds a list of paths.
_SHELLS: dict[str, Callable[[str, Entries], str]] = {
    'sh': _format_for_sh,
    'fish': _format_for_fish,
}


def list_all(package: str | None) -> int:
    """Print the full names of all interfaces that are installed or built, or of one package."""
    catalogue = InterfaceCatalogue(_known_prefixes())
    if package is not None and package not in catalogue.packages():
        message = f"no interface package '{package}' is installed or built"
        raise UnknownInterfaceError(
            message, help=suggest(package, catalogue.packages(), 'there are')
        )
    for kind in _KINDS:
        for name in catalogue.names(kind, package):
            click.echo(name)
    return ExitCode.DONE


def show(name: str) -> int:
    """Print the fields, types, constants and comments of an interface.

    Raises:
        UnknownInterfaceError: There is no such interface.
    """
    description = describe_interface(name, _known_prefixes())
    if description is None:
        message = f"no package that is installed or built has an interface '{name}'"
        raise UnknownInterfaceError(message, help=_advise(name))
    click.echo(f'# {description.name}')
    for line in render_definition(description, comments=True):
        click.echo(escape(line.expandtabs()))
    return ExitCode.DONE


def _known_prefixes() -> list[Path]:
    """Return where interfaces are: those of installed packages, and of built ones."""
    installed = ament_prefixes()
    return [*installed, *list_built(installed).values()]


def _advise(name: str) -> str | None:
    """Return the help for an interface that does not exist."""
    catalogue = InterfaceCatalogue(_known_prefixes())
    package, _, rest = name.partition('/')
    if package not in catalogue.packages():
        names = [known for kind in _KINDS for known in catalogue.names(kind)]
        return suggest(name, names, otherwise="'composer interfaces list' shows all")
    listing = f"'composer interfaces list {package}'"
    if not rest:
        return f"'{package}' is a package: {listing} shows its interfaces"
    names = [known for kind in _KINDS for known in catalogue.names(kind, package)]
    by_last_part = {known.rpartition('/')[2]: known for known in names}
    last_part = find_nearest(rest.rpartition('/')[2], by_last_part)
    return did_you_mean(
        last_part and by_last_part[last_part], otherwise=f'{listing} shows its interfaces'
    )
