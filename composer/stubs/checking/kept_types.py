"""Check the types of behaviours, unless they were found to be right before."""

from __future__ import annotations

import hashlib
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package
from composer.interfaces.build.build_cache import find_cache
from composer.stubs.checking.type_checker import TESTED_VERSION, TypeCheckerError
from composer.stubs.project_modules import all_nodes, find_project_modules

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.stubs.project_modules import ProjectModule

# As many right systems are remembered.
_MOST_KEPT: Final = 200


@dataclass(slots=True)
class TypesCheck:
    """Has the types of behaviours checked.

    Attributes:
        program: Pyrefly; `None` if it is not installed.
        was_needed: Whether a system has behaviours in the project.
        versions: The versions of pyrefly that checked one.
        failure: Why pyrefly does not work.
    """

    program: Path | None
    was_needed: bool = False
    versions: set[str] = field(default_factory=set)
    failure: str = ''

    def __call__(self, context: CheckContext, found: list[Diagnostic]) -> list[Diagnostic]:
        """Return what is wrong where the other checks found nothing."""
        modules = find_project_modules(context)
        self.was_needed |= bool(modules)
        if not modules or self.program is None:
            return []
        place = find_cache().parent / 'types' / _digest(self.program, context, modules)
        if place.is_file():
            self.versions.add(place.read_text(encoding='utf-8'))
            return []
        # To import it takes longer than all the rest here.
        from composer.stubs.checking.types_check import find_type_errors

        try:
            version, findings = find_type_errors(self.program, context, modules)
        except TypeCheckerError as error:
            self.failure = str(error)
            return []
        self.versions.add(version)
        if not findings:
            _keep(place, version)
        return [*_leave_out_told(findings, found)]

    @property
    def note(self) -> str | None:
        """What was not checked, or by an untested version."""
        if self.was_needed and self.program is None:
            advice = "pip install 'rclpy-composer[types]'"
            return f'not checked without pyrefly: the types of behaviours ({advice})'
        if self.failure:
            return f'not checked: the types of behaviours ({self.failure})'
        untested = ', '.join(sorted(self.versions - {TESTED_VERSION}))
        if untested:
            return f'pyrefly {untested} is untested: Composer reads what {TESTED_VERSION} prints'
        return None


def _leave_out_told(
    findings: list[tuple[Diagnostic, range]], found: list[Diagnostic]
) -> Iterator[Diagnostic]:
    """Yield the first finding of each statement in which the other checks found nothing."""
    told = {
        (span.source.name, span.line)
        for finding in found
        for span in (finding.span, *(related.span for related in finding.related))
        if span is not None
    }
    for finding, lines in findings:
        name = finding.span.source.name if finding.span else ''
        if not told & {(name, line) for line in lines}:
            told.add((name, lines[0]))
            yield finding


def _keep(place: Path, version: str) -> None:
    """Remember a right system; where nothing can be written, the next run is like the first."""
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(version, encoding='utf-8')
        kept = sorted(place.parent.iterdir(), key=lambda path: path.stat().st_mtime)
        for path in kept[:-_MOST_KEPT]:
            path.unlink(missing_ok=True)
    except OSError:
        return


def _digest(program: Path, context: CheckContext, modules: Mapping[str, ProjectModule]) -> str:
    """Return a text that is another one if anything may be found that was not before."""
    unused = context.system.unused
    facts = [
        sys.version_info[:2],
        _times([program, *sorted(Path(__file__).parent.parent.rglob('*.py*'))]),
        context.spec,
        unused,
        context.interfaces.definitions,
        {name: module.source.lines for name, module in modules.items()},
        _times(_interface_folders(context, modules)),
    ]
    return hashlib.sha256(repr(facts).encode(errors='replace')).hexdigest()


def _interface_folders(
    context: CheckContext, modules: Mapping[str, ProjectModule]
) -> Iterator[Path]:
    """Yield the folders with the definitions of the interfaces that a system may use."""
    names = {end.type for node in all_nodes(context) for _, end in node.ends()}
    for module in modules.values():
        names.update(name.replace('.', '/') for name in module.imports)
    prefixes = ament_prefixes()
    for package in sorted({name.partition('/')[0] for name in names if name}):
        prefix = find_package(package, prefixes, INTERFACE_INDEX)
        if prefix is not None:
            share = prefix / 'share' / package
            yield from (share / kind for kind in ('msg', 'srv', 'action'))


def _times(paths: Iterator[Path] | list[Path]) -> list[tuple[str, int]]:
    return [(str(path), path.stat().st_mtime_ns) for path in paths if path.exists()]
