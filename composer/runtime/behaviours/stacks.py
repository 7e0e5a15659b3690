"""The stacks of running behaviours: of a thread, or of a coroutine and what it awaits."""

from __future__ import annotations

import gc
import sys
import traceback
from itertools import dropwhile
from pathlib import Path
from types import AsyncGeneratorType, CoroutineType, GeneratorType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import CodeType, FrameType

_SUSPENDABLE = (CoroutineType, GeneratorType, AsyncGeneratorType)
_FRAMES = ('cr_frame', 'gi_frame', 'ag_frame')
_AWAITED = ('cr_await', 'gi_yieldfrom', 'ag_await')
_OWN_FOLDER = str(Path(__file__).resolve().parents[2])
# Its frames are in the place of those of what a behaviour waits with.
_VIRTUAL_TIME = str(Path(_OWN_FOLDER, 'virtual_time'))
# What calls behaviours; the frames around it are of no interest.
_WRAPPER = str(Path(__file__).resolve().with_name('calls.py'))
_MOST_FRAMES = 200


def format_thread(thread: int) -> str:
    """Return the stack of a thread, innermost call last, from the behaviour on.

    Args:
        thread: As `threading.get_ident` returns it.
    """
    return _format(_stack(sys._current_frames().get(thread)))  # noqa: SLF001 - the only way


def format_coroutine(coroutine: CoroutineType[Any, Any, Any]) -> str:
    """Return the stack of a coroutine, innermost call last, whether it waits or runs."""
    return _format(_coroutine_frames(coroutine))


def thread_codes(thread: int) -> Iterator[CodeType]:
    """Yield the code of each call on the stack of a thread."""
    return (frame.f_code for frame in _stack(sys._current_frames().get(thread)))  # noqa: SLF001


def coroutine_codes(coroutine: CoroutineType[Any, Any, Any]) -> Iterator[CodeType]:
    """Yield the code of each call on the stack of a coroutine."""
    return (frame.f_code for frame in _coroutine_frames(coroutine))


def is_own(filename: str) -> bool:
    """Return whether a source file is one of Composer's own."""
    return filename.startswith(_OWN_FOLDER)


def _stack(frame: FrameType | None) -> list[FrameType]:
    frames = []
    while frame is not None:
        frames.append(frame)
        frame = frame.f_back
    return frames[::-1]


def _coroutine_frames(coroutine: CoroutineType[Any, Any, Any]) -> list[FrameType]:
    if coroutine.cr_running:
        # What it awaits is known only while it waits; while it runs, a thread has its frames.
        for frame in sys._current_frames().values():  # noqa: SLF001 - the only way
            frames = _stack(frame)
            if coroutine.cr_frame in frames:
                return frames[frames.index(coroutine.cr_frame) :]
    return _awaited_frames(coroutine)


def _awaited_frames(suspended: Any) -> list[FrameType]:
    frames: list[FrameType] = []
    while suspended is not None and len(frames) < _MOST_FRAMES:
        frame = _first_of(suspended, _FRAMES)
        if frame is not None:
            frames.append(frame)
            suspended = _first_of(suspended, _AWAITED)
        elif isinstance(suspended, _SUSPENDABLE):
            break
        else:
            # For example a step of an async generator, which only the garbage collector can name.
            held = gc.get_referents(suspended)
            suspended = next((one for one in held if isinstance(one, _SUSPENDABLE)), None)
    return frames


def _first_of(suspended: Any, names: tuple[str, ...]) -> Any:
    return next(filter(None, (getattr(suspended, name, None) for name in names)), None)


def _format(frames: list[FrameType]) -> str:
    files = [frame.f_code.co_filename for frame in frames]
    outer = files.index(_WRAPPER) + 1 if _WRAPPER in files else 0
    inner = list(dropwhile(lambda frame: is_own(frame.f_code.co_filename), frames[outer:]))
    while inner and inner[-1].f_code.co_filename.startswith(_VIRTUAL_TIME):
        inner.pop()
    walked = ((frame, frame.f_lineno) for frame in inner or frames)
    text = ''.join(traceback.StackSummary.extract(walked).format()).rstrip()
    return text or '  (it has ended)'
