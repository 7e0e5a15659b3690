"""Compares the orders of two runs: where they first differ, and what happened around it."""

from __future__ import annotations

from itertools import islice, zip_longest
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

# So many events are shown before the first that differs, and from it on.
_BEFORE, _AFTER = 3, 4


def compare_orders(default: Path, shuffled: Path, seed: int) -> tuple[str, ...]:
    """Return where two traces first differ, a line each; nothing if they are the same.

    A process that ended before it could write a trace has an empty one.
    """
    before: list[str] = []
    with _open(default) as default_lines, _open(shuffled) as shuffled_lines:
        for pair in zip_longest(default_lines, shuffled_lines):
            if pair[0] != pair[1]:
                return (
                    *_describe('the default order', before, pair[0], default_lines),
                    *_describe(f'the order of seed {seed}', before, pair[1], shuffled_lines),
                )
            before = [*before[1 - _BEFORE :], pair[0] or '']
    return ()


def _open(path: Path) -> IO[str]:
    path.touch()
    return path.open(encoding='utf-8', errors='replace')


def _describe(
    title: str, before: list[str], first: str | None, following: Iterator[str]
) -> Iterator[str]:
    yield f'{title}:'
    yield from (f'    {line.rstrip()}' for line in before)
    if first is None:
        yield '  > (the end)'
        return
    yield f'  > {first.rstrip()}'
    yield from (f'    {line.rstrip()}' for line in islice(following, _AFTER))
