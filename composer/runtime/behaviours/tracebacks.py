"""Exceptions as text of limited length, whatever they are."""

from __future__ import annotations

import traceback

from composer.errors import (
    ActionNotAvailableError,
    ComposerError,
    EndedWhileWaitingError,
    ServiceNotAvailableError,
)
from composer.runtime.behaviours.stacks import is_own

_LONGEST_SUMMARY = 500
_LONGEST_TRACEBACK = 12_000


def summarize(error: BaseException) -> str:
    """Return its type and message; never raise."""
    try:
        text = str(error)
    except BaseException as other:  # noqa: BLE001 - it is the behaviour's code that runs here
        text = f'<its __str__ raised {type(other).__name__}>'
    return f'{_cut(type(error).__name__, _LONGEST_SUMMARY)}: {_cut(text, _LONGEST_SUMMARY)}'


def represent(error: BaseException) -> str:
    """Return its `repr`; never raise."""
    try:
        text = repr(error)
    except BaseException:  # noqa: BLE001 - as above
        text = f'{type(error).__name__}()'
    return _cut(text, _LONGEST_SUMMARY)


def place_of(error: BaseException) -> tuple[str, int | None]:
    """Return the file and line where it was raised."""
    trace = error.__traceback__
    if trace is None:
        return '', None
    while trace.tb_next:
        trace = trace.tb_next
    return trace.tb_frame.f_code.co_filename, trace.tb_lineno


def format_behaviour_error(error: BaseException) -> str:
    """Return its traceback, without Composer's own frames around the behaviour, and its help.

    That a server is not there is no error in the code: it has no traceback.
    """
    help_text = _help_of(error)
    advice = f'\nhelp: {help_text}' if help_text else ''
    if isinstance(error, ServiceNotAvailableError | ActionNotAvailableError):
        return advice.lstrip('\n')
    try:
        described = traceback.TracebackException.from_exception(error, compact=True)
        _drop_own_frames(described, error)
        text = ''.join(described.format()).rstrip()
    except BaseException as other:  # noqa: BLE001 - an exception can be made to break anything
        text = f'(its traceback cannot be shown: {type(other).__name__})'
    return _cut(text, _LONGEST_TRACEBACK) + advice


def format_internal_error(error: BaseException) -> str:
    """Return the full traceback of an error outside of all behaviours; never raise."""
    try:
        text = ''.join(traceback.format_exception(error)).rstrip()
    except BaseException:  # noqa: BLE001 - as above
        text = represent(error)
    return _cut(text, _LONGEST_TRACEBACK)


def _help_of(error: BaseException) -> str | None:
    if type(error) is SystemExit:
        return 'to end the system call node.shutdown()'
    return error.help if isinstance(error, ComposerError) else None


def _drop_own_frames(described: traceback.TracebackException, error: BaseException | None) -> None:
    """Drop the frames before those of the behaviour.

    If Composer raised the error on purpose, its frames at the end are dropped too: the call in the
    behaviour is the wrong line then.
    """
    frames = list(described.stack)
    others = [index for index, frame in enumerate(frames) if not is_own(frame.filename)]
    if isinstance(error, ComposerError | EndedWhileWaitingError):
        frames = frames[others[0] : others[-1] + 1] if others else []
    elif others:
        frames = frames[others[0] :]
    if frames:
        described.stack[:] = frames
    else:
        # Without a heading either.
        described.stack = None  # type: ignore[assignment]
    if described.__cause__ is not None:
        _drop_own_frames(described.__cause__, error.__cause__ if error else None)
    if described.__context__ is not None:
        _drop_own_frames(described.__context__, error.__context__ if error else None)
    for part in described.exceptions or ():
        _drop_own_frames(part, None)


def _cut(text: str, longest: int) -> str:
    """Return at most `longest` characters, with those escaped that ROS cannot log.

    Names of files that are not in UTF-8 have such characters, for example.
    """
    if len(text) > longest:
        half = longest // 2
        left_out = len(text) - 2 * half
        text = f'{text[:half]} … ({left_out} characters) … {text[-half:]}'
    return text.encode(errors='backslashreplace').decode().replace('\0', '\\x00')
