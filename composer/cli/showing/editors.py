"""`composer schema` and `composer stubs`: what editors and type checkers need."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from composer.application.file_selection import load_given, select_systems
from composer.application.output import show_findings, write_file
from composer.checks.checker import create_context
from composer.diagnostics import has_errors
from composer.errors import ComposerError, ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.schema import SCENARIO_SCHEMA_NAME, SCHEMA_NAME, schema_path
from composer.stubs.system_stubs import module_of, stubs_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


class ConflictingSystemsError(ComposerError):
    """Two files would have their nodes in one module."""


def print_schema(*, path_only: bool, matrix: bool, scenarios: bool = False) -> int:
    """Print the schema of systems, matrix files or scenario files, or the path of a schema.

    Raises:
        UsageError: Two of them are wanted.
    """
    if matrix and scenarios:
        message = '--matrix and --scenarios cannot be used together'
        raise UsageError(message)
    path = schema_path(SCENARIO_SCHEMA_NAME if scenarios else SCHEMA_NAME)
    if matrix:
        schema = json.loads(path.read_text(encoding='utf-8'))
        definitions = {name: schema['$defs'][name] for name in ('combinations', 'combination')}
        part = {'$schema': schema['$schema'], '$ref': '#/$defs/combinations'}
        click.echo(json.dumps(part | {'$defs': definitions}, indent=2))
        return ExitCode.DONE
    click.echo(path if path_only else path.read_text(encoding='utf-8'), nl=path_only)
    return ExitCode.DONE


def write_stubs(words: Sequence[str], set_values: Sequence[str], folder: Path) -> int:
    """Write the stubs of systems into a folder; return the exit code.

    Args:
        words: Files, folders and patterns; or one file with its layers and arguments.

    Raises:
        ConflictingSystemsError: Two files have the same name.
        UsageError: The arguments or `set_values` do not fit the file.
        ComposerError: The folder cannot be written.
    """
    files: dict[str, str] = {}
    modules: dict[str, Path] = {}
    selection = select_systems(words, is_one=bool(set_values))
    show_findings(selection.findings)
    if selection.findings:
        return ExitCode.FAILED
    for each in selection.systems:
        path = each.path
        system = load_given([path, *each.layers], each.arguments or None, set_values)
        context = create_context(system, InterfaceCatalogue())
        findings = [*system.diagnostics, *(context.interfaces.findings if context else ())]
        show_findings(findings)
        if context is None or has_errors(findings):
            return ExitCode.FAILED
        module = module_of(context)
        if module in modules:
            message = f"{modules[module]} and {path} would both be 'composer_stubs.{module}'"
            raise ConflictingSystemsError(message, help='write them into two folders')
        modules[module] = path
        files |= stubs_of(context)
    for name, text in files.items():
        place = folder / name
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            message = f'cannot write {place}: {error.strerror}'
            raise ComposerError(message) from error
        write_file(place, text, 'the stubs')
    for module in modules:
        click.echo(f'{folder}: composer_stubs.{module}')
    return ExitCode.DONE
