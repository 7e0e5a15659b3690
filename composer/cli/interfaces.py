"""`composer interfaces`: build, list and show interface packages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.ament import ament_prefixes
from composer.cli.output import show_findings
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared_packages import load_declared, provide_declared
from composer.interfaces.definitions.installed_definitions import describe_interface
from composer.interfaces.definitions.rendering import render_definition
from composer.language.pipeline import load_system
from composer.spelling import did_you_mean, find_nearest, suggest

if TYPE_CHECKING:
    from pathlib import Path

    from composer.interfaces.catalogue import InterfaceKind

_KINDS: tuple[InterfaceKind, ...] = ('msg', 'srv', 'action')


class UnknownInterfaceError(ComposerError):
    """No installed package has such an interface."""


def build(path: Path) -> int:
    """Build the packages that a file declares and that are not installed or built yet."""
    system = load_system(path)
    declared = load_declared(system, InterfaceCatalogue())
    findings = [*system.diagnostics, *declared.findings]
    show_findings(findings)
    if has_errors(findings):
        return ExitCode.FAILED
    packages = provide_declared(declared, lambda line: click.echo(line, err=True))
    for package in packages:
        click.echo(f'{package}: ready')
    if not packages:
        click.echo(f'{path} declares no interfaces')
    return ExitCode.DONE


def list_all(package: str | None) -> int:
    """Print the full names of all interfaces that are installed, or of one package."""
    catalogue = InterfaceCatalogue()
    if package is not None and package not in catalogue.packages():
        message = f"no interface package '{package}' is installed"
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
    description = describe_interface(name, ament_prefixes())
    if description is None:
        message = f"no installed package has an interface '{name}'"
        raise UnknownInterfaceError(message, help=_advise(name))
    click.echo(f'# {description.name}')
    for line in render_definition(description, comments=True):
        click.echo(line)
    return ExitCode.DONE


def _advise(name: str) -> str | None:
    """Return the help for an interface that does not exist."""
    catalogue = InterfaceCatalogue()
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
