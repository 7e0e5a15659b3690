"""Texts for terminals and logs."""

import unicodedata

from hypothesis import given
from hypothesis import strategies as st

from composer.terminal import escape, escape_lines

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
