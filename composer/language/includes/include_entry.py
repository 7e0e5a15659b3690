"""An include as it is written in a file: its file, its namespace, and whether it is left out."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from composer.diagnostics import Related, diagnostic_at
from composer.language.paths import (
    PackagePathError,
    PathError,
    explain_absent,
    is_in_package,
    resolve_path,
)
from composer.names import find_namespace_problem
from composer.records import record

if TYPE_CHECKING:
    from composer.diagnostics import Span
    from composer.language.loaded_system import LoadedSystem
    from composer.yaml_text.positions import DataPath


@record
class IncludeEntry:
    """An include of a file.

    Attributes:
        system: The file that it is written in.
        at: Its path there.
        data: What it says.
    """

    system: LoadedSystem
    at: DataPath
    data: dict[str, Any]

    @property
    def file(self) -> str:
        """The file that is included, as written."""
        return str(self.data['file'])

    @property
    def label(self) -> str:
        """The name of the include."""
        return str(self.at[-1])

    @property
    def remap(self) -> dict[str, str]:
        """Rules for all that comes out of the file."""
        rules: dict[str, str] = self.data.get('remap', {})
        return rules

    @property
    def span(self) -> Span:
        """Where the file is named."""
        return self.system.positions.value((*self.at, 'file'))

    @property
    def here(self) -> Related:
        """The include, as findings in its file refer to it."""
        return Related('included here', self.span)

    @property
    def is_left_out(self) -> bool:
        """Whether its `when` does not hold."""
        return self.at in self.system.left_out

    def is_open(self, path: DataPath) -> bool:
        """Return whether the value at a path may be another one when the include is used."""
        is_computed = self.is_left_out and path in self.system.notes
        return is_computed or self.system.positions.value(path) in self.system.sampled

    def find_file(self) -> Path | None:
        """Return the file that is named; report it if there is none, and return `None`."""
        try:
            # It may come later.
            self.system.named[resolve_path(self.file, self.span.source.folder)] = None
            return locate_file(self.file, self.span)
        except PathError as error:
            # What is left out may be in a package of other machines, and have a name that is whole
            # only when it is used.
            may_be_absent = is_in_package(self.file) or self.is_open((*self.at, 'file'))
            if not (self.is_left_out and may_be_absent):
                is_package = isinstance(error, PackagePathError)
                rule = 'uninstalled-package' if is_package else 'missing-include'
                self.report(rule, str(error), error.help)
        return None

    def find_namespace(self) -> str:
        """Return the namespace of all that comes out of the file.

        One that ROS does not allow is reported here, once, and not for each node in it; another
        one is returned in its place.
        """
        path = (*self.at, 'namespace')
        if path in self.system.dropped:
            # Without one of their own, its nodes might be called like others.
            return _allowed(self.label)
        namespace = str(self.data.get('namespace', ''))
        problem = find_namespace_problem(namespace) if namespace else None
        if problem is None:
            return namespace
        span = self.system.positions.value(path)
        finding = diagnostic_at(span, 'bad-name', f"'{namespace}': {problem}")
        self.system.diagnostics.append(finding)
        self.system.dropped.add(path)
        return _allowed(namespace)

    def report(
        self,
        rule: str,
        message: str,
        help: str | None = None,  # noqa: A002 - the word that the finding shows
    ) -> None:
        """Add a finding about the file that is named."""
        finding = diagnostic_at(self.span, rule, message, help=help)
        self.system.diagnostics.append(finding)


def shown_path(path: Path) -> str:
    """Return a path as findings show it: relative to the working folder if it is inside it."""
    if '\0' in str(path):
        return str(path)  # no path at all, and `realpath` raises
    real = os.path.realpath(path)
    try:
        return str(Path(real).relative_to(Path.cwd()))
    except ValueError:
        # 'folder/..' is another folder if 'folder' is a link.
        plain = os.path.normpath(path)
        return plain if os.path.realpath(plain) == real else real


def locate_file(text: str, place: Span) -> Path:
    """Return the file that a text names which is written at `place`.

    Raises:
        PathError: There is no such file.
    """
    if '\0' in text:
        message = 'no file has a null character in its name'
        raise PathError(message)
    path = resolve_path(text, place.source.folder)
    if not _is_there(path):
        message = f"there is no file '{shown_path(path)}'"
        raise PathError(message, help=explain_absent(path, place))
    return path


def _is_there(path: Path) -> bool:
    """Return whether there is something to read, although reading may fail."""
    # The functions of pathlib raise for names that are too long.
    leads_back = os.path.islink(path) and not os.path.exists(os.path.realpath(path))  # noqa: PTH114
    return (os.path.exists(path) or leads_back) and not os.path.isdir(path)


def _allowed(namespace: str) -> str:
    tokens = (re.sub(r'\W|^(?=\d)', '_', token, flags=re.ASCII) for token in namespace.split('/'))
    slash = '/' if namespace.startswith('/') else ''
    return slash + '/'.join(filter(None, tokens))
