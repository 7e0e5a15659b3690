"""`composer check`: check files for errors."""

from __future__ import annotations

import gc
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from composer.checks.checker import check_system
from composer.cli.file_selection import select_files
from composer.cli.output import wants_colour, write_file
from composer.errors import ExitCode, UsageError
from composer.input_limits import MAX_FILE_BYTES
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system, load_system_text
from composer.reports import render_report
from composer.reports.report import CheckedFile, Report
from composer.reports.text import render_files, summarize

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.cli.import_check import ImportCheck
    from composer.language.loaded_system import LoadedSystem

_STANDARD_INPUT = '-'


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckOptions:
    """The options of `composer check`.

    Attributes:
        format: One of `composer.reports.FORMATS`.
        output: The file to write the report to; `None` for standard output.
        is_strict: Whether warnings count as errors.
        ignored: Rules whose findings are left out.
        expected: If not empty, the check passes only if exactly these rules fire.
        is_quiet: Whether to print only findings.
        imports: Whether to import the behaviours.
        skip_other_files: Whether to skip named files that do not look like systems.
        stdin_name: The path that findings in standard input are reported under.
    """

    format: str = 'text'
    output: Path | None = None
    is_strict: bool = False
    ignored: tuple[str, ...] = ()
    expected: tuple[str, ...] = ()
    is_quiet: bool = False
    imports: bool = False
    skip_other_files: bool = False
    stdin_name: str = '<stdin>'


def check(words: Sequence[str], options: CheckOptions) -> int:
    """Check files and report what was found; return the exit code.

    Args:
        words: Files, folders, patterns, and `-` for standard input.

    Raises:
        UsageError: A rule is both ignored and expected.
        ComposerError: The report cannot be written.
    """
    _refuse_contradictions(options)
    # What is read lives until the end: to look for garbage as often as usual takes a fifth more.
    gc.set_threshold(50_000)
    report = _inspect(words, options)
    _show(report, options)
    if options.expected:
        return _compare(report, options)
    return ExitCode.FAILED if report.has_failed else ExitCode.DONE


def _refuse_contradictions(options: CheckOptions) -> None:
    both = set(options.ignored) & set(options.expected)
    if both:
        message = f"'{min(both)}' cannot be both ignored and expected"
        raise UsageError(message, help='use either --ignore or --expect')


def _inspect(words: Sequence[str], options: CheckOptions) -> Report:
    catalogue = InterfaceCatalogue()
    selection = select_files(words, skip_other_files=options.skip_other_files)
    imports = _import_check() if options.imports else None
    files = [CheckedFile(finding.file, (finding,)) for finding in selection.findings]
    for path in selection.paths:
        system = _load(path, options)
        findings = check_system(system, catalogue, imports)
        kept = tuple(finding for finding in findings if finding.rule not in options.ignored)
        nodes = len(system.spec.nodes) if system.spec else None
        files.append(CheckedFile(str(system.path), kept, nodes))
    unchecked = _list_unchecked(catalogue, imports)
    return Report(tuple(files), unchecked, options.is_strict)


def _import_check() -> ImportCheck:
    from composer.cli.import_check import ImportCheck

    return ImportCheck()


def _load(path: Path, options: CheckOptions) -> LoadedSystem:
    if str(path) != _STANDARD_INPUT:
        return load_system(path)
    return load_system_text(sys.stdin.buffer.read(MAX_FILE_BYTES + 1), Path(options.stdin_name))


def _list_unchecked(catalogue: InterfaceCatalogue, imports: ImportCheck | None) -> tuple[str, ...]:
    """Return one line with what could not be checked without ROS 2, if anything."""
    unchecked = []
    if not catalogue.available:
        unchecked.append('interface types and the fields of messages')
    if imports and imports.missing_ros:
        unchecked.append(f'what imports ROS itself ({", ".join(sorted(imports.missing_ros))})')
    return (f'not checked without ROS 2: {"; ".join(unchecked)}',) if unchecked else ()


def _show(report: Report, options: CheckOptions) -> None:
    """Write the report; if it goes to a file, also print the findings as text."""
    if options.output is not None:
        write_file(options.output, render_report(report, options.format), 'the report')
    if options.format == 'text' or options.output is not None:
        colour = wants_colour()
        text = render_files(report, colour=colour, is_quiet=options.is_quiet)
        click.echo(text, nl=False, color=colour)
    else:
        click.echo(render_report(report, options.format), nl=False, color=False)
    if options.is_quiet:
        return
    for line in report.not_checked:
        click.echo(line, err=True)
    if report.findings:
        click.echo(summarize(report.findings), err=True)


def _compare(report: Report, options: CheckOptions) -> int:
    """Compare the rules that fired with those expected; return the exit code."""
    fired = {finding.rule for finding in report.findings}
    expected = set(options.expected)
    for rule in sorted(expected - fired):
        click.echo(f"expected '{rule}', which found nothing", err=True)
    for rule in sorted(fired - expected):
        click.echo(f"'{rule}' was not expected", err=True)
    if fired != expected:
        return ExitCode.FAILED
    if not options.is_quiet:
        click.echo(f'as expected: {", ".join(sorted(expected))}', err=True)
    return ExitCode.DONE
