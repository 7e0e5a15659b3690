"""What a behaviour raised, in words: whatever the exception is, and never too much of it."""

from __future__ import annotations

import traceback

from composer.errors import ComposerError
from composer.runtime.behaviours.stacks import is_own

_LONGEST_SUMMARY = 500
_LONGEST_TRACEBACK = 12_000


def summarize(error: BaseException) -> str:
    """Return its type and message, and never raise."""
    try:
        text = str(error)
    except BaseException as fault:  # noqa: BLE001 - it is the behaviour's code that runs here
        text = f'<its __str__ raised {type(fault).__name__}>'
    return f'{_cut(type(error).__name__, _LONGEST_SUMMARY)}: {_cut(text, _LONGEST_SUMMARY)}'


def represent(error: BaseException) -> str:
    """Return it as Python shows values, and never raise."""
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


def format_error(error: BaseException) -> str:
    """Return its traceback without Composer's own frames around the behaviour, and the help."""
    try:
        described = traceback.TracebackException.from_exception(error, compact=True)
        _drop_own_frames(described, error)
        text = ''.join(described.format()).rstrip()
    except BaseException as fault:  # noqa: BLE001 - an exception can be made to break anything
        text = f'(its traceback cannot be shown: {type(fault).__name__})'
    help_text = _help_of(error)
    return _cut(text, _LONGEST_TRACEBACK) + (f'\nhelp: {help_text}' if help_text else '')


def format_fault(error: BaseException) -> str:
    """Return its traceback with all frames, for what is no error of a behaviour; never raise."""
    try:
        text = ''.join(traceback.format_exception(error)).rstrip()
    except BaseException:  # noqa: BLE001 - as above
        text = represent(error)
    return _cut(text, _LONGEST_TRACEBACK)


def _help_of(error: BaseException) -> str | None:
    if isinstance(error, SystemExit):
        return 'to end the system call node.shutdown()'
    return error.help if isinstance(error, ComposerError) else None


def _drop_own_frames(described: traceback.TracebackException, error: BaseException | None) -> None:
    """Leave the frames from the first of the behaviour on.

    Those at the end go too if Composer raised the error on purpose: the behaviour's call is what
    is wrong then.
    """
    frames = list(described.stack)
    foreign = [index for index, frame in enumerate(frames) if not is_own(frame.filename)]
    if isinstance(error, ComposerError):
        frames = frames[foreign[0] : foreign[-1] + 1] if foreign else []
    elif foreign:
        frames = frames[foreign[0] :]
    if frames:
        described.stack[:] = frames
    else:
        # So that no heading is printed either.
        described.stack = None  # type: ignore[assignment]
    if described.__cause__ is not None:
        _drop_own_frames(described.__cause__, error.__cause__ if error else None)
    if described.__context__ is not None:
        _drop_own_frames(described.__context__, error.__context__ if error else None)
    for part in described.exceptions or ():
        _drop_own_frames(part, None)


def _cut(text: str, longest: int) -> str:
    """Return no more than `longest` characters of it, all of which ROS can log.

    What it cannot is in the names of files that are not in UTF-8, for example.
    """
    if len(text) > longest:
        half = longest // 2
        left_out = len(text) - 2 * half
        text = f'{text[:half]} … ({left_out} characters) … {text[-half:]}'
    return text.encode(errors='backslashreplace').decode().replace('\0', '\\x00')
