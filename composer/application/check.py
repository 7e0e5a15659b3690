"""Checks files for errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.application.file_selection import (
    SelectedSystem,
    Selection,
    has_arguments,
    read_standard_input,
    select_systems,
)
from composer.application.launch_file import is_launch_file, load_launch_file, relocate
from composer.checks.absent_packages import AbsentPackages
from composer.checks.checker import check_in_context, create_context
from composer.checks.placement.crossings import list_crossings
from composer.errors import UsageError
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_combinations, load_system
from composer.records import record
from composer.reports.report import CheckedFile, Report, name_combinations
from composer.scenarios.recognition import SUFFIXES
from composer.stubs.checking.kept_types import TypesCheck
from composer.stubs.checking.type_checker import find_program

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from composer.checks.checker import FurtherCheck
    from composer.language.loaded_system import LoadedSystem
    from composer.rules import Need
    from composer.runtime.behaviours.import_check import ImportCheck


@record
class CheckOptions:
    """What is checked, and how.

    Attributes:
        set_values: Values to change, as in `nodes.talker.log_level=debug`.
        matrix: The file with the combinations to check; `None` for those of the system itself.
        is_strict: Whether warnings count as errors.
        ignored: Rules whose findings are left out.
        imports: Whether to import the behaviours.
        skip_other_files: Whether to skip named files that do not look like systems.
        strict_packages: Whether packages that are not installed are errors without ROS 2, too.
        stdin_name: The path that findings in standard input are reported under.
    """

    is_strict: bool = False
    set_values: tuple[str, ...] = ()
    matrix: Path | None = None
    ignored: tuple[str, ...] = ()
    imports: bool = False
    skip_other_files: bool = False
    strict_packages: bool = False
    stdin_name: str = '<stdin>'


def check(words: Sequence[str], options: CheckOptions) -> Report:
    """Check systems and scenarios; return what was found.

    Args:
        words: Files, folders, patterns, and `-` for standard input; or one file with its layers
            and arguments.

    Raises:
        UsageError: Arguments or `--set` do not fit the file, or are given together with a matrix.
    """
    catalogue = InterfaceCatalogue()
    selection = _select(words, options)
    absent = AbsentPackages(is_strict=options.strict_packages)
    imports = _import_check() if options.imports else None
    further: dict[Need, FurtherCheck] = {'import': imports} if imports else {}
    types = TypesCheck(find_program())
    if types.program:
        further['types'] = types
    files = [CheckedFile(finding.file, (finding,)) for finding in selection.findings]
    scenarios = list(selection.scenarios)
    context = None
    for selected in selection.systems:
        if str(selected.path) == '-' and options.stdin_name.endswith(SUFFIXES):
            scenarios.append(selected.path)
            continue
        checked = []
        for given, combination, system in _load(selected, options):
            # Systems of a project have modules in common.
            context = create_context(system, catalogue, context)
            if context and not types.program:
                types(context, [])
            findings = relocate(absent.leave_out(check_in_context(system, context, further)))
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
    notes = (types.note,) if types.note else ()
    return Report(tuple(files), (*unchecked, *notes), options.is_strict)


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


def _load(
    selected: SelectedSystem, options: CheckOptions
) -> Iterator[tuple[str, str | None, LoadedSystem]]:
    """Yield the system in each combination: what the command line gives, the name, the system."""
    path, text = read_standard_input(selected.path, options.stdin_name)
    layers, arguments, set_values = selected.layers, selected.arguments, options.set_values
    given = ' '.join([*map(str, layers), *arguments, *map('--set {}'.format, set_values)])
    if text is None and is_launch_file(path):
        yield given, None, load_launch_file(path, arguments, layers, set_values)
        return
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
