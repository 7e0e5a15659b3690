"""The result of a check, which every format shows."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from composer.diagnostics import has_errors
from composer.rules import Severity

if TYPE_CHECKING:
    from composer.diagnostics import Diagnostic


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """A file and its findings.

    Attributes:
        name: The path as the user wrote it.
        findings: From top to bottom, with those in the files that it includes.
        nodes: How many nodes it declares; `None` if it could not be read.
    """

    name: str
    findings: tuple[Diagnostic, ...] = ()
    nodes: int | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """All that a run of `composer check` found.

    Attributes:
        not_checked: What could not be checked on this machine, a line each.
        is_strict: Whether warnings count as errors.
    """

    files: tuple[CheckedFile, ...]
    not_checked: tuple[str, ...] = ()
    is_strict: bool = False

    @property
    def findings(self) -> list[Diagnostic]:
        """All findings, file by file; one that several files share is listed once."""
        found = [finding for file in self.files for finding in file.findings]
        return list({finding.sort_key: finding for finding in reversed(found)}.values())[::-1]

    @property
    def has_failed(self) -> bool:
        """Whether there are errors, or warnings that count as errors."""
        return has_errors(self.findings) or (self.is_strict and bool(self.findings))


def count_severities(findings: list[Diagnostic]) -> tuple[int, int]:
    """Return the number of errors and of warnings."""
    errors = sum(finding.severity is Severity.ERROR for finding in findings)
    return errors, len(findings) - errors


def relative_path(name: str) -> str:
    """Return a path relative to the working folder if it lies in it, with forward slashes."""
    if name.startswith('<'):
        return name
    path = Path(os.path.abspath(name))  # noqa: PTH100 - `resolve` would follow links
    folder = Path.cwd()
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.as_posix()
