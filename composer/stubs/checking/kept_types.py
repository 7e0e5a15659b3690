"""Check the types of behaviours, unless the same ones were found to be right before."""

from __future__ import annotations

import hashlib
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from composer.ament import INTERFACE_INDEX, ament_prefixes, find_package
from composer.stubs.checking.type_checker import (
    TESTED_VERSION,
    TypeCheckerError,
    keep_result,
    load_result,
)
from composer.stubs.project_modules import all_nodes, find_project_modules

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from composer.checks.context import CheckContext
    from composer.diagnostics import Diagnostic
    from composer.stubs.project_modules import ProjectModule


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
        digest = _digest(self.program, context, modules)
        kept = load_result(digest)
        if kept is not None:
            self.versions.add(kept.version)
            if kept.is_clean:
                return []
        # To import it takes longer than all the rest here.
        from composer.stubs.checking.types_check import find_type_errors

        try:
            findings, result = find_type_errors(self.program, context, modules, kept, found)
        except TypeCheckerError as error:
            self.failure = str(error)
            return []
        self.versions.add(result.version)
        if result != kept:
            keep_result(digest, result)
        return findings

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
