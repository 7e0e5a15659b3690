"""Run mypy or pyright, and read what they report."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from composer.errors import ComposerError
from composer.records import record

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

# The modules and programs of each, best first.
TYPE_CHECKERS: Final = {
    'mypy': ('mypy',),
    'pyright': ('pyright', 'basedpyright'),
}
# `file:line:column:end line:end column: severity: message  [code]`
_MYPY_LINE = re.compile(
    r'^(?P<path>.+?):(?P<line>\d+):(?P<column>\d+):(?P<end_line>\d+):(?P<end>\d+): '
    r'(?P<severity>error|note): (?P<message>.*?)(?:  \[(?P<code>[\w-]+)\])?$'
)
_TIMEOUT_SEC = 600


class TypeCheckerError(ComposerError):
    """No type checker is installed, or it does not work."""


@record
class TypeChecker:
    """A type checker that is installed.

    Attributes:
        name: `mypy` or `pyright`.
        command: How to run it.
    """

    name: str
    command: tuple[str, ...]


@record
class TypeReport:
    """What a type checker says about a place.

    Attributes:
        path: The file.
        line: Counted from 1; columns likewise.
        column: The first column; `end` is the one after the last.
        code: Its own name for such errors.
        notes: What it adds.
    """

    path: Path
    line: int
    column: int
    end: int
    message: str
    code: str
    notes: tuple[str, ...] = ()


def find_type_checker(name: str | None) -> TypeChecker:
    """Return a type checker: that of Composer's own Python, or a program on the `PATH`.

    Args:
        name: A key of `TYPE_CHECKERS`; `None` for the first that there is.

    Raises:
        TypeCheckerError: It is not installed.
    """
    for each in [name] if name else TYPE_CHECKERS:
        for module in TYPE_CHECKERS[each]:
            if importlib.util.find_spec(module):
                return TypeChecker(each, (sys.executable, '-m', module))
            if program := shutil.which(module):
                return TypeChecker(each, (program,))
    message = f'{name} is not installed' if name else 'neither mypy nor pyright is installed'
    raise TypeCheckerError(message, help=f'pip install {name or "mypy"}')


def run_type_checker(
    checker: TypeChecker, folder: Path, roots: Sequence[Path], cache: Path
) -> list[TypeReport]:
    """Check the modules below a folder.

    Args:
        folder: Has the modules; what the checker needs to be told is written into it.
        roots: Where modules and stubs are found; nothing else is, so that all else is unknown.
        cache: The folder for what the checker remembers.

    Raises:
        TypeCheckerError: It fails.
    """
    run = {'mypy': _run_mypy, 'pyright': _run_pyright}[checker.name]
    return run(checker, folder, roots, cache)


def _run_mypy(
    checker: TypeChecker, folder: Path, roots: Sequence[Path], cache: Path
) -> list[TypeReport]:
    settings = folder.parent / 'mypy.ini'
    settings.write_text(
        '[mypy]\n'
        f'mypy_path = {":".join(map(str, roots))}\n'
        f'cache_dir = {cache}\n'
        'check_untyped_defs = True\n'
        'explicit_package_bases = True\n'
        'ignore_missing_imports = True\n'
        'no_site_packages = True\n'
        'follow_imports = silent\n'
        'allow_redefinition = True\n'
        'local_partial_types = True\n'
        'warn_unused_configs = False\n'
        'show_error_end = True\n'
        'show_column_numbers = True\n'
        'error_summary = False\n'
        'pretty = False\n'
        'hide_error_codes = False\n'
        'strict_equality = True\n',
        encoding='utf-8',
    )
    files = sorted(str(path) for path in folder.rglob('*.py'))
    arguments = ['--config-file', str(settings), '--no-color-output', *files]
    text = _run(checker, arguments, folder)
    return list(_read_mypy(text, folder))


def _read_mypy(text: str, folder: Path) -> Iterator[TypeReport]:
    found: list[TypeReport] = []
    for line in text.splitlines():
        match = _MYPY_LINE.match(line)
        if match is None:
            continue
        same_line = match['line'] == match['end_line']
        column = int(match['column'])
        report = TypeReport(
            folder / match['path'],
            int(match['line']),
            column,
            int(match['end']) + 1 if same_line else column + 1,
            match['message'],
            match['code'] or '',
        )
        if match['severity'] == 'error':
            found.append(report)
        elif found and found[-1].line == report.line:
            last = found.pop()
            notes = (*last.notes, report.message.strip())
            found.append(
                TypeReport(
                    last.path, last.line, last.column, last.end, last.message, last.code, notes
                )
            )
    yield from found


def _run_pyright(
    checker: TypeChecker, folder: Path, roots: Sequence[Path], _cache: Path
) -> list[TypeReport]:
    settings = folder.parent / 'pyrightconfig.json'
    options = {
        'include': [str(folder)],
        'extraPaths': list(map(str, roots)),
        'stubPath': str(roots[-1]),
        'typeCheckingMode': 'basic',
        'reportMissingImports': 'none',
        'reportMissingModuleSource': 'none',
        'reportUnusedCoroutine': 'error',
        'useLibraryCodeForTypes': False,
    }
    settings.write_text(json.dumps(options), encoding='utf-8')
    text = _run(checker, ['--outputjson', '-p', str(settings)], folder)
    try:
        found = json.loads(text)['generalDiagnostics']
    except (ValueError, KeyError) as error:
        message = f'{checker.name} does not work: {text.strip()[:500]}'
        raise TypeCheckerError(message) from error
    return [_read_pyright(each) for each in found if each['severity'] == 'error']


def _read_pyright(found: dict[str, Any]) -> TypeReport:
    start, end = found['range']['start'], found['range']['end']
    first, *rest = found['message'].splitlines()
    column = start['character'] + 1
    same_line = start['line'] == end['line']
    return TypeReport(
        Path(found['file']),
        start['line'] + 1,
        column,
        end['character'] + 1 if same_line else column + 1,
        first,
        found.get('rule', ''),
        tuple(line.strip() for line in rest),
    )


def _run(checker: TypeChecker, arguments: Sequence[str], folder: Path) -> str:
    """Return what a type checker prints; with errors in the modules, it exits with 1."""
    environment = {name: value for name, value in os.environ.items() if name != 'MYPYPATH'}
    try:
        done = subprocess.run(  # noqa: S603 - it is the user who names it
            [*checker.command, *arguments],
            cwd=folder,
            env={**environment, 'NO_COLOR': '1'},
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_SEC,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        message = f'{checker.name} does not work: {error}'
        raise TypeCheckerError(message) from error
    if done.returncode not in (0, 1):
        said = (done.stderr or done.stdout).strip()[-500:]
        message = f'{checker.name} does not work: {said}'
        raise TypeCheckerError(message, help='update it, or use another type checker')
    return done.stdout
