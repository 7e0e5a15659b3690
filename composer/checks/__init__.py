"""`LoadedSystem` → findings. The rules, a function each, in one table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from composer.checks.annotations import check_annotations
from composer.checks.behaviours import check_behaviour_sources
from composer.checks.context import CheckContext
from composer.checks.fields import check_messages
from composer.checks.ignoring import apply_ignore_comments
from composer.checks.names import check_names
from composer.checks.node_uses import UseReader
from composer.checks.parameter_files import check_parameter_files
from composer.checks.parameters import check_parameters
from composer.checks.processes import check_environment, check_processes, check_waits
from composer.checks.references import check_publish, check_qos, check_types
from composer.checks.uses import check_uses
from composer.checks.wiring import check_wiring
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.interfaces.declared import describe_declared
from composer.language import LoadedSystem, load_system
from composer.module_finder import ModuleFinder, project_search_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from composer.diagnostics import Diagnostic
    from composer.rules.record import Need

RULES: tuple[Callable[[CheckContext], Iterable[Diagnostic]], ...] = (
    check_names,
    check_qos,
    check_publish,
    check_types,
    check_messages,
    check_parameters,
    check_parameter_files,
    check_behaviour_sources,
    check_processes,
    check_waits,
    check_environment,
    check_annotations,
    check_uses,
    check_wiring,
)


def create_context(
    system: LoadedSystem, installed: InterfaceCatalogue
) -> tuple[CheckContext | None, list[Diagnostic]]:
    """Return what the rules look at, and what is wrong with the interfaces that a file declares.

    The context is `None` if the file could not be read at all.
    """
    if system.spec is None:
        return None, []
    catalogue, unreadable, findings = describe_declared(system, installed)
    modules = ModuleFinder(project_search_path(system.path))
    uses = UseReader(modules)
    return CheckContext(system, system.spec, catalogue, modules, uses, unreadable), findings


def check_system(
    system: LoadedSystem,
    catalogue: InterfaceCatalogue,
    further: Callable[[CheckContext, list[Diagnostic]], Iterable[Diagnostic]] | None = None,
) -> list[Diagnostic]:
    """Return all that is wrong with a system, by its place in the file.

    Args:
        further: What else is to be checked; it is given what was found so far.
    """
    context, declared = create_context(system, catalogue)
    found = [finding for rule in RULES for finding in rule(context)] if context else []
    if context and further:
        found += further(context, found)
    found = [finding for finding in found if not _hangs_on_samples(finding, system)]
    # What several entries share through an alias is wrong once.
    once = dict.fromkeys([*system.diagnostics, *declared, *found])
    unchecked: set[Need] = set() if catalogue.available else {'interfaces'}
    unchecked |= set() if further else {'import'}
    heard = apply_ignore_comments(
        once, system.positions.source, None if system.diagnostics else unchecked
    )
    return sorted(heard, key=lambda finding: finding.sort_key)


def _hangs_on_samples(finding: Diagnostic, system: LoadedSystem) -> bool:
    """Return whether a finding is about a value that is not the real one."""
    place = finding.span
    return place is not None and any(
        span.source is place.source
        and span.line == place.line
        and span.column <= place.column < span.column + span.length
        for span in system.sampled
    )


def check_files(paths: Iterable[Path]) -> Iterator[tuple[Path, list[Diagnostic]]]:
    """Yield each file with all that is wrong with it."""
    catalogue = InterfaceCatalogue()
    for path in paths:
        yield path, check_system(load_system(path), catalogue)
