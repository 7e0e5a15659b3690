"""The nearest right spelling of a wrong name, and the help that suggests it."""

from __future__ import annotations

import heapq
from collections import Counter
from functools import lru_cache
from itertools import zip_longest
from operator import itemgetter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

# With more options, or longer ones, the search for the nearest would take seconds.
_MOST_OPTIONS = 2000
_LONGEST_WORD = 255
_FEW = 100
# Of more options these share most pairs of letters with the word, and are compared.
_PRESELECTED = 25
# How long the abbreviation of a word is at least.
_SHORTEST = 3
_LONGEST_COMPARED = 64
# Of more options the help lists the first.
_MOST_LISTED = 12


def suggest(
    word: object,
    options: Iterable[object],
    listed: str | None = None,
    otherwise: str | None = None,
) -> str | None:
    """Return the help for a wrong name.

    Args:
        word: The wrong name; of what is no string, nothing is near.
        options: The right names; what is no string is left out.
        listed: What introduces a list of the options if none is near, as in `it has`.
        otherwise: The help if no option is near and none is listed.
    """
    names = _strings(options)
    near = _search(word, names)
    if near is None and listed and names:
        shown = ', '.join(heapq.nsmallest(_MOST_LISTED, names))
        otherwise = f'{listed}: {shown}' + (', …' if len(names) > _MOST_LISTED else '')
    return did_you_mean(near, otherwise)


def did_you_mean(meant: str | None, otherwise: str | None = None) -> str | None:
    """Return the help that suggests a name; `otherwise` if there is none."""
    return otherwise if meant is None else f"did you mean '{meant}'?"


def find_nearest(word: object, options: Iterable[object]) -> str | None:
    """Return the option that `word` was most likely meant to be, or `None`.

    Among more than two thousand options, and for words longer than any name of ROS, there is no
    search.
    """
    return _search(word, _strings(options))


def _search(word: object, names: frozenset[str]) -> str | None:
    if not isinstance(word, str) or len(word) > _LONGEST_WORD or len(names) > _MOST_OPTIONS:
        return None
    return _find_nearest(word.lower(), _first_of_equals(names))


@lru_cache(maxsize=64)
def _first_of_equals(names: frozenset[str]) -> frozenset[str]:
    """Return names as they were given first: the caches keep them once."""
    return names


def _strings(options: Iterable[object]) -> frozenset[str]:
    return frozenset(option for option in options if isinstance(option, str))


@lru_cache(maxsize=4096)
def _find_nearest(word: str, choices: frozenset[str]) -> str | None:
    lowered = _lower(choices)
    if word in lowered:
        return lowered[word]
    # Most files have nothing misspelt.
    import difflib

    close = difflib.get_close_matches(word, _preselect(word, choices), n=5, cutoff=0.6)
    if not close:
        return None
    # Of those that look alike, the one that takes the fewest edits; else the first.
    return lowered[min(close, key=lambda option: count_edits(word, option))]


def count_edits(word: str, other: str) -> int:
    """Return how many edits make one word of another.

    An edit adds, removes or replaces a letter, or swaps two (the distance of Damerau and
    Levenshtein, in its restricted form). Of long words only the beginning counts.
    """
    word, other = word[:_LONGEST_COMPARED], other[:_LONGEST_COMPARED]
    before: list[int] = []
    row = list(range(len(other) + 1))
    for i, letter in enumerate(word):
        above, before, row = before, row, [i + 1]
        for j, wanted in enumerate(other):
            cost = min(before[j + 1] + 1, row[j] + 1, before[j] + (letter != wanted))
            if i and j and (letter, word[i - 1]) == (other[j - 1], wanted):
                cost = min(cost, above[j - 1] + 1)
            row.append(cost)
    return row[-1]


def is_typo(word: str, meant: str) -> bool:
    """Return whether a word looks like another one that is misspelt, not like its sibling.

    `offset_y` beside `offset_x`, `out2` beside `out` and `min` beside `max` are siblings: what
    differs is a digit, a last letter that is another one, or more than one letter in six. One
    that differs in capitals only is misspelt.
    """
    is_same, word, meant = word == meant, word.lower(), meant.lower()
    if word == meant:
        return not is_same
    if any(letter.isdigit() for letter in set(word) ^ set(meant)):
        return False
    edits = count_edits(word, meant)
    is_sibling = len(word) == len(meant) and word[:-1] == meant[:-1]
    return 0 < edits <= max(1, len(meant) // 6) and not is_sibling


def is_short(word: str, other: str) -> bool:
    """Return whether one of two names abbreviates the other: `min_voltage`, `minimum_voltage`."""
    pairs = zip_longest(word.lower().split('_'), other.lower().split('_'), fillvalue='')
    return word != other and all(
        one == two or (len(one) >= _SHORTEST and two.startswith(one))
        for one, two in (sorted(pair, key=len) for pair in pairs)
    )


@lru_cache(maxsize=64)
def _lower(choices: frozenset[str]) -> dict[str, str]:
    return {choice.lower(): choice for choice in sorted(choices, reverse=True)}


def _preselect(word: str, choices: frozenset[str]) -> list[str]:
    """Return the options to compare: of many, those that share most pairs of letters."""
    options = [option for option in _lower(choices) if len(option) <= _LONGEST_WORD]
    if len(options) <= _FEW:
        return options
    by_pair = _group_by_pairs(choices)
    shared: Counter[str] = Counter()
    for pair in _pairs(word):
        shared.update(by_pair.get(pair, ()))
    most = heapq.nlargest(_FEW, shared.items(), key=itemgetter(1))
    scores = ((count / (len(word) + len(option)), option) for option, count in most)
    return [option for _, option in heapq.nlargest(_PRESELECTED, scores)]


@lru_cache(maxsize=64)
def _group_by_pairs(choices: frozenset[str]) -> dict[str, list[str]]:
    groups: dict[str, list[str]] = {}
    for option in _lower(choices):
        if len(option) <= _LONGEST_WORD:
            for pair in _pairs(option):
                groups.setdefault(pair, []).append(option)
    return groups


def _pairs(word: str) -> frozenset[str]:
    return frozenset(f' {word}'[i : i + 2] for i in range(len(word)))
