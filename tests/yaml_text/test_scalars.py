"""Which type a scalar has: YAML 1.2.2, section 10.3.2."""

import math

import pytest

from composer.yaml_text.scalars import ScalarError, parse_plain_scalar, parse_tagged_scalar

TAG = 'tag:yaml.org,2002:'

VALUES = {
    '': None,
    '~': None,
    'null': None,
    'true': True,
    'false': False,
    '0': 0,
    '-0': 0,
    '+12': 12,
    '010': 10,
    '0o14': 12,
    '0xC': 12,
    '18446744073709551616': 2**64,
    '1e3': 1000.0,
    '12e03': 12000.0,
    '1.': 1.0,
    '.5': 0.5,
    '0.1': 0.1,
    '-0.0': -0.0,
    '1e999': math.inf,
    '.inf': math.inf,
    '-.INF': -math.inf,
}

STRINGS = [
    'on', 'off', 'On', 'OFF', 'yes', 'no', 'Yes', 'NO', 'y', 'n', 'Y', 'N',
    'tRUE', 'nULL', 'none', 'None', 'nil', 'nan', 'inf', 'NaN', '.Nan', '.iNF', '-.nan', '+.nan',
    '12:30', '1:2:3', '190:20:30', '1_000', '0b11', '0o8', '0o', '0x', '0xg', '-0x1', '+0o7',
    '1e', 'e3', '.', '-', '+', '..5', '1.2.3', '- 1', '1 2', '1,5', '--1', '.e3', '.1e', '+.',
    '2001-12-14', '2001-12-14t21:59:43.10-05:00', '=', '<<', '0.1m', '10 Hz', '١٢', '1e٣', '½',
]  # fmt: skip


@pytest.mark.parametrize(('text', 'value'), VALUES.items())
def test_a_plain_scalar_has_the_type_of_the_core_schema(text, value):
    parsed = parse_plain_scalar(text)
    assert type(parsed) is type(value)
    assert repr(parsed) == repr(value)


@pytest.mark.parametrize('text', ['.nan', '.NaN', '.NAN'])
def test_not_a_number_is_a_number(text):
    parsed = parse_plain_scalar(text)
    assert isinstance(parsed, float)
    assert math.isnan(parsed)


@pytest.mark.parametrize('text', STRINGS)
def test_everything_else_is_a_string(text):
    assert parse_plain_scalar(text) == text


@pytest.mark.parametrize(
    'digits', ['1' * 251, '0o' + '7' * 249, '0x' + 'f' * 249, '-' + '1' * 250]
)
def test_an_endless_number_is_refused(digits):
    with pytest.raises(
        ScalarError, match=f'^a number of {len(digits)} digits does not fit any ROS type$'
    ):
        parse_plain_scalar(digits)


@pytest.mark.parametrize(
    ('text', 'tag', 'value'),
    [
        ('12', 'str', '12'),
        ('', 'str', ''),
        ('12', 'int', 12),
        ('0x1f', 'int', 31),
        ('12', 'float', 12.0),
        ('1e3', 'float', 1000.0),
        ('true', 'bool', True),
        ('~', 'null', None),
    ],
)
def test_a_tag_says_the_type(text, tag, value):
    parsed = parse_tagged_scalar(text, TAG + tag)
    assert (type(parsed), parsed) == (type(value), value)


@pytest.mark.parametrize(
    ('text', 'tag', 'message'),
    [
        ('twelve', TAG + 'int', "'twelve' is not a !!int"),
        ('1.5', TAG + 'int', "'1.5' is not a !!int"),
        ('true', TAG + 'int', "'true' is not a !!int"),
        ('true', TAG + 'float', "'true' is not a !!float"),
        ('yes', TAG + 'bool', "'yes' is not a !!bool"),
        ('1', TAG + 'bool', "'1' is not a !!bool"),
        ('0', TAG + 'null', "'0' is not a !!null"),
        ('a', TAG + 'binary', "the tag !!binary is not part of YAML's core schema"),
        ('a', '!own', "the tag !own is not part of YAML's core schema"),
    ],
)
def test_text_that_is_not_of_its_tag_is_refused(text, tag, message):
    with pytest.raises(ScalarError) as raised:
        parse_tagged_scalar(text, tag)
    assert str(raised.value) == message
