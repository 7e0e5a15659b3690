"""Which topics a user means: names with the wildcards of a shell."""

from __future__ import annotations

import re
from fnmatch import translate
from typing import TYPE_CHECKING, Final, Protocol

from composer.errors import UsageError
from composer.spelling import did_you_mean, find_nearest

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

_WILDCARDS: Final = '*?['
# Of names that tools do not list (https://design.ros2.org/articles/topic_and_service_names.html).
_HIDDEN: Final = '/_'


class Patterns(Protocol):
    """Which topics are meant; see `TopicPatterns`."""

    def has(self, topic: str) -> bool:
        """Return whether a topic is."""

    def describe_unused(self, topics: Collection[str]) -> list[str]:
        """Return what is missing."""


class TopicPatterns:
    """The topics that some patterns match; all that are not hidden if there are none.

    `*` stands for any characters, slashes included, `?` for one, `[ab]` for one of these. A hidden
    topic, as `/move/_action/status` is, must be named with its `/_`.

    Args:
        patterns: As the user wrote them.

    Raises:
        UsageError: A pattern matches no topic of any name.
    """

    def __init__(self, patterns: Sequence[str] = ()) -> None:
        self._matches = {each: re.compile(translate(_absolute(each))) for each in patterns}
        self._known: dict[str, bool] = {}

    def has(self, topic: str) -> bool:
        """Return whether a topic is meant, by its full name."""
        found = self._known.get(topic)
        if found is None:
            found = self._known[topic] = self._find(topic)
        return found

    def describe_unused(self, topics: Collection[str]) -> list[str]:
        """Return a sentence for each pattern that none of the topics matches."""
        return [
            f"no topic matches '{pattern}'; {_suggest(pattern, topics)}".rstrip('; ')
            for pattern, match in self._matches.items()
            if not any(match.match(each) for each in topics)
        ]

    def _find(self, topic: str) -> bool:
        is_hidden = _HIDDEN in topic
        if not self._matches:
            return not is_hidden
        return any(
            match.match(topic) and (not is_hidden or _HIDDEN in pattern)
            for pattern, match in self._matches.items()
        )


def _absolute(pattern: str) -> str:
    if not pattern or pattern.isspace():
        message = 'an empty pattern matches no topic'
        raise UsageError(message, help="name topics, as in --topics '/camera/*'")
    return pattern if pattern.startswith(('/', '*', '[')) else f'/{pattern}'


def _suggest(pattern: str, topics: Collection[str]) -> str:
    if any(each in pattern for each in _WILDCARDS):
        return ''
    return did_you_mean(find_nearest(_absolute(pattern), topics)) or ''
