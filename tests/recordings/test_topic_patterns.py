"""Patterns of topics match as those of a shell, and hidden topics only if they are meant."""

import pytest

from composer.errors import UsageError
from composer.recordings.topic_patterns import TopicPatterns

TOPICS = ['/a', '/ab', '/a/b', '/a/_hidden', '/rosout', '/camera/left/image', '/tf']


@pytest.mark.parametrize(
    ('patterns', 'expected'),
    [
        ([], ['/a', '/ab', '/a/b', '/rosout', '/camera/left/image', '/tf']),
        (['/a'], ['/a']),
        (['a'], ['/a']),
        (['/a*'], ['/a', '/ab', '/a/b']),
        (['/a?'], ['/ab']),
        (['/a[b-z]'], ['/ab']),
        (['*image'], ['/camera/left/image']),
        (['/camera/*', '/tf'], ['/camera/left/image', '/tf']),
        (['*'], ['/a', '/ab', '/a/b', '/rosout', '/camera/left/image', '/tf']),
        (['/a/_*'], ['/a/_hidden']),
        (['*/_*'], ['/a/_hidden']),
        (['/A'], []),
    ],
)
def test_patterns_match(patterns, expected):
    chosen = TopicPatterns(patterns)
    assert [each for each in TOPICS if chosen.has(each)] == expected


def test_a_pattern_without_topics_is_named_with_the_nearest():
    unused = TopicPatterns(['/rosuot', '/tf', '/x*']).describe_unused(TOPICS)
    assert unused == [
        "no topic matches '/rosuot'; did you mean '/rosout'?",
        "no topic matches '/x*'",
    ]


@pytest.mark.parametrize('pattern', ['', ' '])
def test_an_empty_pattern_is_an_error(pattern):
    with pytest.raises(UsageError, match='an empty pattern matches no topic'):
        TopicPatterns([pattern])
