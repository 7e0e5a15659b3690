"""Comments that silence rules are told from text that looks like them."""

import pytest

from composer.diagnostics import SourceFile
from composer.yaml_text.comments import read_ignore_comments


def read(text):
    """Return line and column of each comment, with the rules that it names."""
    source = SourceFile('a.yaml', tuple(text.splitlines()))
    return [
        (comment.span.line, comment.span.column, [rule.text for rule in comment.rules])
        for comment in read_ignore_comments(source)
    ]


@pytest.mark.parametrize(
    ('text', 'found'),
    [
        ('a: 1  # composer: ignore[one]', (1, 7, ['one'])),
        ('# composer: ignore[one, two]', (1, 1, ['one', 'two'])),
        ('a: 1\t#composer:ignore[ one,two ]', (1, 6, ['one', 'two'])),
        ('a: 1 # composer: ignore', (1, 6, [])),
        ('a: 1 # composer: ignore[one', (1, 6, [])),
        ('a: "b"  # composer: ignore[one]', (1, 9, ['one'])),
        ('a: |  # composer: ignore[one]\n  text', (1, 7, ['one'])),
        ('a: |\n  text\n# composer: ignore[one]\nb: 1', (3, 1, ['one'])),
        ('日本: "é"  # composer: ignore[one]', (1, 10, ['one'])),
    ],
)  # fmt: skip
def test_a_comment_is_found_with_its_rules(text, found):
    assert read(text) == [found]


@pytest.mark.parametrize(
    'text',
    [
        'a: "b # composer: ignore[one]"',
        'a: "b\n  # composer: ignore[one]\n  c"',
        'a: |\n  text # composer: ignore[one]',
        'a: b# composer: ignore[one]',
        'a: 1  # composer: ignored[one]',
        '',
    ],
)
def test_what_is_no_comment_silences_nothing(text):
    assert read(text) == []


def test_of_a_text_that_is_not_yaml_the_comments_before_the_finding_are_read():
    text = 'a: 1  # composer: ignore[one]\nb: "\nc: 2  # composer: ignore[two]\n'
    assert read(text) == [(1, 7, ['one'])]
    assert read('a: 1  # composer: ignore[one]\nb: \x07') == []
