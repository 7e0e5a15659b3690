"""Which arguments foreign code only writes into its result, and which of them decide what it does.

The code is run with the arguments as they are, and again with a mark in place of each that it has
read. If the result is the same but for the mark, an expression can take its place.
"""

from __future__ import annotations

import contextlib
import os
from typing import TYPE_CHECKING, Any, TypeVar

from composer.launch_files.texts import Text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from composer.launch_files.surroundings import Scope

_Result = TypeVar('_Result')
# Each is a run of the code.
_MOST_TRIED = 40


def run_marked(
    scope: Scope,
    attempt: Callable[[frozenset[str]], tuple[_Result, Iterable[str]]],
    outcome: Callable[[_Result], Any],
) -> tuple[_Result, list[str]]:
    """Return the result with as many marks as possible, and the names that decide.

    Args:
        attempt: Runs the code with marks for some names; returns what it has read, too.
        outcome: Returns the result with the values of marks in place.
    """
    plain, read = attempt(frozenset())
    expected = outcome(plain)

    def succeeds(names: frozenset[str]) -> _Result | None:
        try:
            with _quiet():
                result, _ = attempt(names)
                return result if outcome(result) == expected else None
        except Exception:  # noqa: BLE001 - foreign code, given what it never expected
            return None

    names = [
        name
        for name in read
        if isinstance(value := scope.configurations.get(name), Text) and not value.is_constant
    ]
    safe = frozenset(each for each in names[:_MOST_TRIED] if succeeds(frozenset((each,))))
    best = succeeds(safe) if safe else None
    if best is None:
        return plain, names
    return best, [name for name in names if name not in safe]


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Hide what the code prints in its further runs."""
    with (
        open(os.devnull, 'w', encoding='utf-8') as null,  # noqa: PTH123 - not a path
        contextlib.redirect_stdout(null),
        contextlib.redirect_stderr(null),
    ):
        yield
