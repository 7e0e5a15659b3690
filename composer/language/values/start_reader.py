"""Reads values when the system starts: runs commands, and reads files.

What was read is kept while a system runs: an edit runs a command again if the words of the command
or the files among them have changed.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from composer.confidential import hide
from composer.errors import ComposerError
from composer.input_limits import MAX_FILE_BYTES, explain_missing
from composer.language.paths import PathError, resolve_path
from composer.programs import base_environment, find_program_problem, shell_environment
from composer.ros_parameters.parameter_types import convert_parameter_value, find_type_problem
from composer.spelling import suggest
from composer.yaml_text.reader import parse_document, read_document

if TYPE_CHECKING:
    from typing import IO

    from composer.language.values.start_values import StartValue

_CHUNK = 1 << 16
# Of what a command prints on standard error, its end is shown.
_MOST_LINES = 20


class StartValueError(ComposerError):
    """A value cannot be read, and the system cannot start."""


class StartValueReader:
    """Reads values, each once as long as nothing that it depends on has changed.

    Args:
        host: The host whose part needs them: samples stand for the values of others. Empty for the
            whole system.
    """

    def __init__(self, host: str = '') -> None:
        self._host = host
        self._printed: dict[tuple[Any, ...], str] = {}

    def read(self, value: StartValue) -> Any:
        """Return a value, of its type.

        Raises:
            StartValueError: Its command fails or prints nothing, its file cannot be read or has
                no such key, or it is of another type.
        """
        if value.is_elsewhere(self._host):
            return value.sample
        try:
            found = self._find(value)
            if not value.command:
                hide(found, value.origin)
            return _converted(value, found)
        except ComposerError as error:
            message = f'{value.span}: {value.name}: {error}'
            raise StartValueError(message, help=error.help) from error

    def _find(self, value: StartValue) -> Any:
        if not value.command:
            return _read_file(value)
        stamps = [(path, path.stat().st_mtime_ns, path.stat().st_size) for path in _files(value)]
        variables = tuple(sorted(shell_environment().items()))
        key = (value.command, value.timeout_sec, *stamps, variables)
        if key not in self._printed:
            self._printed[key] = _run(value.command, value.timeout_sec)
        return self._printed[key]


def read_from_file(value: StartValue) -> Any:
    """Return a value that is in a file.

    Raises:
        ComposerError: The file cannot be read or has no such key, or it is of another type.
    """
    return _converted(value, _read_file(value))


def _files(value: StartValue) -> list[Path]:
    return [path for path in value.named_files if os.path.exists(path)]


def _converted(value: StartValue, found: Any) -> Any:
    if isinstance(found, str) and (value.key is None or value.type not in (None, 'string')):
        if not found.strip():
            source = f"'{value.command[0]}' has printed" if value.command else 'the file holds'
            message = f'{source} nothing'
            raise StartValueError(message)
        if value.type in (None, 'string'):
            return found if value.is_exact else found.rstrip('\r\n')
        found = _parse(found.strip())
    if value.type is None:
        return found
    found = convert_parameter_value(found, value.type)
    if problem := find_type_problem(found, value.type):
        raise StartValueError(problem, help=f"'type' says what it is, here {value.type}")
    return found


def _parse(text: str) -> Any:
    """Return a text as a YAML scalar or list; the text itself if it is neither."""
    document = parse_document(f'value: {text}'.encode(), '<value>')
    if document.data is None or document.diagnostics:
        return text
    return document.data.get('value')


def _read_file(value: StartValue) -> Any:
    try:
        path = resolve_path(value.file, Path())
    except PathError as error:
        raise StartValueError(str(error), help=error.help) from error
    if not os.path.exists(path):
        message = f"there is no file '{path}'"
        raise StartValueError(message, help=explain_missing(path, None))
    if value.key is None:
        from composer.input_limits import read_file

        return _decoded(read_file(path), f"'{path}'")
    document = read_document(path)
    if document.data is None or document.diagnostics:
        finding = document.diagnostics[0]
        message = f'{finding.span or finding.file}: {finding.message}'
        raise StartValueError(message, help=finding.help)
    return _value_at(document.data, value.key, path)


def _value_at(data: dict[str, Any], key: str, path: Path) -> Any:
    """Return the value at a dotted key; the keys in the file may contain dots."""
    inside: Any = data
    rest = key
    while rest:
        known = inside if isinstance(inside, dict) else {}
        fitting = [each for each in known if rest == each or rest.startswith(f'{each}.')]
        if not fitting:
            begun = key.removesuffix(rest)
            message = f"'{path}' has no key '{key}'"
            options = [f'{begun}{each}' for each in known]
            raise StartValueError(message, help=suggest(key, options, 'there are'))
        found = max(fitting, key=len)
        inside, rest = known[found], rest[len(found) + 1 :]
    if inside is None:
        message = f"'{key}' in '{path}' has no value"
        raise StartValueError(message)
    return inside


def _run(command: tuple[str, ...], timeout_sec: float) -> str:
    """Return what a command prints.

    Raises:
        StartValueError: It cannot be run, fails, or does not end in time.
    """
    environment = base_environment(shell_environment())
    if problem := find_program_problem(command[0], Path(), environment):
        message, advice = problem
        raise StartValueError(message, help=advice)
    try:
        process = subprocess.Popen(  # noqa: S603 - what the file says
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
            # What it starts ends with it.
            start_new_session=True,
        )
    except (OSError, ValueError) as error:
        message = f"'{command[0]}' cannot be run: {error}"
        raise StartValueError(message) from error
    try:
        with process:
            printed, complaints = _collect(process, monotonic() + timeout_sec)
            ended = printed is not None
            if not ended:
                _kill(process)
    except BaseException:
        _kill(process)
        raise
    said = '\n'.join(complaints.decode(errors='backslashreplace').splitlines()[-_MOST_LINES:])
    if printed is None:
        message = f"'{command[0]}' has not ended after {timeout_sec:g} s"
        raise StartValueError(message, help=said or "give it more time with 'timeout'")
    if process.returncode:
        message = f"'{command[0]}' has ended with exit code {process.returncode}"
        raise StartValueError(message, help=said or None)
    if not printed.strip():
        message = f"'{command[0]}' has printed nothing"
        raise StartValueError(message, help=said or None)
    return _decoded(printed, f"what '{command[0]}' prints")


def _collect(process: subprocess.Popen[bytes], deadline: float) -> tuple[bytes | None, bytes]:
    """Return what a process prints until it ends, `None` if it does not; and its complaints."""
    printed: dict[IO[bytes] | None, bytearray] = {
        process.stdout: bytearray(),
        process.stderr: bytearray(),
    }
    with selectors.DefaultSelector() as selector:
        for stream in filter(None, printed):
            selector.register(stream, selectors.EVENT_READ)
        while selector.get_map():
            ready = selector.select(max(deadline - monotonic(), 0))
            if not ready:
                return None, bytes(printed[process.stderr])
            for key, _ in ready:
                chunk = os.read(key.fd, _CHUNK)
                stream = next(each for each in printed if each is key.fileobj)
                if not chunk:
                    selector.unregister(key.fileobj)
                elif len(printed[stream]) + len(chunk) > MAX_FILE_BYTES:
                    message = f'it prints more than {MAX_FILE_BYTES:,} bytes'
                    raise StartValueError(message)
                printed[stream] += chunk
    try:
        process.wait(max(deadline - monotonic(), 0))
    except subprocess.TimeoutExpired:
        return None, bytes(printed[process.stderr])
    return bytes(printed[process.stdout]), bytes(printed[process.stderr])


def _kill(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def _decoded(content: bytes, what: str) -> str:
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        message = f'{what} is not UTF-8: {error.reason} at byte {error.start}'
        raise StartValueError(message) from error
