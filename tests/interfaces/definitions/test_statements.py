import pytest

from composer.diagnostics import SourceFile
from composer.interfaces.definitions.statements import (
    Statement,
    is_near_separator,
    split_line,
    split_sections,
)


def split(line: str) -> Statement | None:
    return split_line(SourceFile('Some.msg', (line,)), 1)


def test_a_field_is_cut_into_type_name_and_default() -> None:
    statement = split('float64  speed   1.5  # [m/s]')
    assert statement is not None
    assert statement.kind == 'field'
    assert (statement.type.text, statement.type.column) == ('float64', 1)
    assert (statement.name.text, statement.name.column) == ('speed', 10)
    assert statement.value is not None
    assert (statement.value.text, statement.value.column) == ('1.5', 18)


def test_an_equals_sign_behind_the_type_makes_a_constant() -> None:
    statement = split('uint8 RED = 7')
    assert statement is not None
    assert statement.value is not None
    assert (statement.kind, statement.name.text, statement.value.text) == ('constant', 'RED', '7')
    bounded = split('string<=5 name')
    assert bounded is not None
    assert bounded.kind == 'field'


def test_a_constant_may_have_an_empty_value() -> None:
    statement = split('string NOTHING=')
    assert statement is not None
    assert statement.value is not None
    assert (statement.value.text, statement.value.column) == ('', 16)


def test_a_tab_counts_as_one_space() -> None:
    statement = split('int32\tnumber')
    assert statement is not None
    assert (statement.type.text, statement.name.text, statement.name.column) == (
        'int32',
        'number',
        7,
    )


def test_a_comment_begins_even_inside_quotes() -> None:
    statement = split('string text "a#b"')
    assert statement is not None
    assert statement.value is not None
    assert statement.value.text == '"a'


def test_a_type_alone_is_unfinished() -> None:
    statement = split('  int32  # nothing')
    assert statement is not None
    assert (statement.kind, statement.indent, statement.name.column) == ('unfinished', 2, 8)


@pytest.mark.parametrize('line', ['', '   ', '# all', '   # all'])
def test_empty_lines_and_comments_define_nothing(line: str) -> None:
    assert split(line) is None


@pytest.mark.parametrize(
    ('line', 'near'),
    [
        ('---', True),
        ('--- ', True),
        (' ----', True),
        ('--- # x', True),
        ('-', False),
        ('int32 a', False),
        ('# ---', False),
    ],
)
def test_sloppy_separators_are_recognised(line: str, *, near: bool) -> None:
    assert is_near_separator(line) is near


def test_sections_lie_between_separators() -> None:
    source = SourceFile('Some.action', ('a', 'b', '---', '---', 'c'))
    assert [(section.start, section.text) for section in split_sections(source)] == [
        (1, 'a\nb'),
        (4, ''),
        (5, 'c'),
    ]
