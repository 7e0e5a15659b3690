"""`composer check`: check files for errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from composer.checks.absent_packages import AbsentPackages
from composer.checks.checker import check_in_context, create_context
from composer.checks.placement.crossings import list_crossings
from composer.cli.common.argument_types import split_words
from composer.cli.common.file_selection import (
    SelectedSystem,
    Selection,
    has_arguments,
    read_standard_input,
    select_files,
)
from composer.cli.common.output import wants_colour, write_file
from composer.errors import ExitCode, UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_combinations, load_system
from composer.records import record
from composer.reports import render_report
from composer.reports.report import CheckedFile, Report, name_combinations
from composer.reports.text import count, render_files, summarize
from composer.scenarios.recognition import SUFFIXES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from composer.checks.checker import FurtherCheck
    from composer.language.loaded_system import LoadedSystem
    from composer.rules import Need
    from composer.runtime.behaviours.import_check import ImportCheck
    from composer.stubs.types_check import TypesCheck


@record
class CheckOptions:
    """The options of `composer check`.

    Attributes:
        format: One of `composer.reports.FORMATS`.
        output: The file to write the report to; `None` for standard output.
        set_values: Values to change, as in `nodes.talker.log_level=debug`.
        matrix: The file with the combinations to check; `None` for those of the system itself.
        is_strict: Whether warnings count as errors.
        ignored: Rules whose findings are left out.
        expected: If not empty, the check passes only if exactly these rules fire.
        is_quiet: Whether to print only findings.
        imports: Whether to import the behaviours.
        types: Whether to run a type checker over the behaviours.
        type_checker: Its name; `None` for one that is installed.
        skip_other_files: Whether to skip named files that do not look like systems.
        strict_packages: Whether packages that are not installed are errors without ROS 2, too.
        stdin_name: The path that findings in standard input are reported under.
    """

    format: str = 'text'
    output: Path | None = None
    is_strict: bool = False
    set_values: tuple[str, ...] = ()
    matrix: Path | None = None
    ignored: tuple[str, ...] = ()
    expected: tuple[str, ...] = ()
    is_quiet: bool = False
    imports: bool = False
    types: bool = False
    type_checker: str | None = None
    skip_other_files: bool = False
    strict_packages: bool = False
    stdin_name: str = '<stdin>'


def check(words: Sequence[str], options: CheckOptions) -> int:
    """Check systems and report what was found; return the exit code.

    Args:
        words: Files, folders, patterns, and `-` for standard input; or one file with its layers
            and arguments.

    Raises:
        UsageError: A rule is both ignored and expected, arguments or `--set` do not fit the
            file, or are given together with a matrix.
        ComposerError: The report cannot be written, or there is no type checker.
    """
    _refuse_contradictions(options)
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
    selection = _select(words, options)
    absent = AbsentPackages(is_strict=options.strict_packages)
    imports = _import_check() if options.imports else None
    further: dict[Need, FurtherCheck] = {'import': imports} if imports else {}
    if options.types:
        further['types'] = _types_check(options.type_checker)
    files = [CheckedFile(finding.file, (finding,)) for finding in selection.findings]
    scenarios = list(selection.scenarios)
    for selected in selection.systems:
        if str(selected.path) == '-' and options.stdin_name.endswith(SUFFIXES):
            scenarios.append(selected.path)
            continue
        checked = []
        for given, combination, system in _load(selected, options):
            context = create_context(system, catalogue)
            findings = absent.leave_out(check_in_context(system, context, further))
            kept = tuple(finding for finding in findings if finding.rule not in options.ignored)
            nodes = len(system.spec.nodes) if system.spec else None
            crossings = tuple(map(str, list_crossings(context))) if context else ()
            name = str(system.path)
            processes = len(system.spec.processes) if system.spec else 0
            checked.append(
                CheckedFile(
                    name, kept, nodes, given, combination, crossings=crossings, processes=processes
                )
            )
        files += name_combinations(checked)
    files += [_check_scenarios(path, catalogue, absent, options) for path in scenarios]
    unchecked = _list_unchecked(catalogue, imports, absent)
    return Report(tuple(files), unchecked, options.is_strict)


def _check_scenarios(
    path: Path, catalogue: InterfaceCatalogue, absent: AbsentPackages, options: CheckOptions
) -> CheckedFile:
    # Most runs check no scenarios.
    from composer.scenarios.checks import check_scenarios
    from composer.scenarios.scenario_files import load_scenarios

    path, text = read_standard_input(path, options.stdin_name)
    loaded = load_scenarios(path, text=text)
    findings = absent.leave_out(check_scenarios(loaded, catalogue))
    kept = tuple(finding for finding in findings if finding.rule not in options.ignored)
    return CheckedFile(str(path), kept, cases=len(loaded.spec.cases) if loaded.spec else None)


def _import_check() -> ImportCheck:
    from composer.runtime.behaviours.import_check import ImportCheck

    return ImportCheck()


def _types_check(name: str | None) -> TypesCheck:
    from composer.stubs.type_checkers import find_type_checker
    from composer.stubs.types_check import TypesCheck

    return TypesCheck(find_type_checker(name))


def _select(words: Sequence[str], options: CheckOptions) -> Selection:
    """Return the systems to check; one, as for `composer up`, if the words can mean nothing else.

    Raises:
        UsageError: Several systems, or arguments beside a matrix.
    """
    is_changed = has_arguments(words) or bool(options.set_values)
    if is_changed and options.matrix:
        message = '--matrix cannot be used together with arguments or --set'
        raise UsageError(message, help='write them in the combinations of the matrix')
    is_one = is_changed or options.matrix is not None
    return select_systems(words, is_one=is_one, skip_other_files=options.skip_other_files)


def select_systems(
    words: Sequence[str], *, is_one: bool, skip_other_files: bool = False
) -> Selection:
    """Return the systems that a command line gives: one, as to `composer up`, or several.

    Args:
        is_one: Whether an option says that it is one; arguments say so, too.

    Raises:
        UsageError: It is one, and the first word is no file.
    """
    if not (is_one or has_arguments(words)):
        return select_files(words, skip_other_files=skip_other_files)
    (path, *layers), arguments = split_words(words)
    return Selection((SelectedSystem(path, tuple(layers), tuple(arguments)),))


def _load(
    selected: SelectedSystem, options: CheckOptions
) -> Iterator[tuple[str, str | None, LoadedSystem]]:
    """Yield the system in each combination: what the command line gives, the name, the system."""
    path, text = read_standard_input(selected.path, options.stdin_name)
    layers, arguments, set_values = selected.layers, selected.arguments, options.set_values
    given = ' '.join([*map(str, layers), *arguments, *map('--set {}'.format, set_values)])
    if arguments or set_values:
        words = arguments or None
        yield (
            given,
            None,
            load_system(path, words, layers=layers, set_values=set_values, text=text),
        )
        return
    systems = load_combinations(path, layers=layers, matrix=options.matrix, text=text)
    yield from ((given, name, system) for name, system in systems)


def _list_unchecked(
    catalogue: InterfaceCatalogue, imports: ImportCheck | None, absent: AbsentPackages
) -> tuple[str, ...]:
    """Return one line with what could not be checked without ROS 2, if anything."""
    unchecked = []
    if not catalogue.available:
        unchecked.append('interface types and the fields of messages')
    if absent.note:
        unchecked.append(absent.note)
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
    summary = [summarize(report.findings)] if report.findings else []
    if report.combinations:
        summary.append(f'{count(report.combinations, "combination")} checked')
    if summary:
        click.echo(', '.join(summary), err=True)


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
