"""Texts for terminals and logs."""

import re
import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from composer.terminal import escape, escape_lines, escape_output

# Control characters, surrogates, bidirectional overrides, and line and paragraph separators.
UNSAFE = {'Cc', 'Cf', 'Cs', 'Zl', 'Zp'}


@given(st.text(st.characters(), max_size=50))
def test_nothing_that_a_terminal_obeys_is_left(text):
    assert not {unicodedata.category(each) for each in escape(text)} & UNSAFE
    first, *others = escape_lines(text).split('\n')
    assert not {unicodedata.category(each) for each in first + ''.join(others)} & UNSAFE
    assert all(line.startswith('  ') or not line for line in others)


def test_what_can_be_shown_is_left_as_it_is():
    assert escape('Grüße, 世界 ✓') == 'Grüße, 世界 ✓'
    assert escape('\x1b[31m\x9b\u202e\u2028\ud800\x7f') == r'\x1b[31m\x9b\u202e\u2028\ud800\x7f'
    assert escape_lines('a\n  b\n\nc') == 'a\n    b\n\n  c'


@given(st.text(st.characters() | st.sampled_from('\x1b[]0;52m\r\n\t\a'), max_size=50))
def test_of_what_others_write_only_colours_are_obeyed(text):
    plain = re.sub(r'\x1b\[[0-9;:]*m', '', escape_output(text))
    assert {unicodedata.category(each) for each in plain.replace('\t', '')} & UNSAFE <= {'Cc'}
    assert not any(each < ' ' and each not in '\n\t' for each in plain)


def test_colours_end_with_their_line_and_a_return_begins_a_new_one():
    assert escape_output('a\x1b[31mred\x1b[0m\tb\r\n') == 'a\x1b[31mred\x1b[0m\tb\n'
    assert escape_output('\x1b[1;31mred\nnext') == '\x1b[1;31mred\x1b[0m\nnext'
    assert escape_output('10 %\r20 %\r') == '10 %\n20 %\n'
    assert escape_output('\x1b]52;c;eA==\a\x9b2J\u202e\x1b[2J') == (
        r'\x1b]52;c;eA==\x07\x9b2J\u202e\x1b[2J'
    )
