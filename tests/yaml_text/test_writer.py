"""Data as YAML that reads back the same."""

import math

from hypothesis import given
from hypothesis import strategies as st

from composer.language.pipeline import load_system_text
from composer.yaml_text.writer import render_yaml

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(2**70), 2**70)
    | st.floats(allow_nan=False)
    | st.text(st.characters(codec='utf-8', exclude_categories=['Cs']))
    | st.sampled_from(
        ['yes', 'null', '~', '0o17', '1e3', '12:30', 'a: b', '- a', '# x', '{{ x }}', '{{', '']
    )
)
KEYS = st.text(min_size=1, alphabet='abcxyz_0~/ {}:#')
DATA = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=12,
)


@given(st.dictionaries(KEYS, DATA, max_size=4))
def test_what_is_rendered_reads_back_as_the_same_data(data):
    text = render_yaml({'version': 1, 'nodes': {'n': {'state': data}}})
    assert load_system_text(text).data['nodes']['n']['state'] == data


def test_numbers_that_are_none_are_written_as_yaml_has_them():
    text = render_yaml({'a': math.nan, 'b': math.inf, 'c': -math.inf})
    assert text == 'a: .nan\nb: .inf\nc: -.inf\n'


def test_remarks_stand_beside_the_values():
    text = render_yaml({'a': {'b': 1, 'c': [1, 2]}}, remark='.'.join)
    assert [line.split('  #') for line in text.splitlines()] == [
        ['a:'],
        [f'{"  b: 1":<48}', ' a.b'],
        [f'{"  c: [1, 2]":<48}', ' a.c'],
    ]
