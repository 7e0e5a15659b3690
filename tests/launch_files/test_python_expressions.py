"""Python in launch files → expressions of the language: both have the same value."""

import re

import pytest

from composer.expressions.evaluation import evaluate_expression
from composer.expressions.sandbox import Sandbox
from composer.launch_files.substitutions import UnlikeError, translate
from composer.launch_files.texts import Text, one

NAMES = {'mode': 'race', 'count': '3', 'sim': 'True'}


def source_of(written):
    """Return a text with the values of `«name»` in it."""
    parts = []
    for index, piece in enumerate(re.split('[«»]', written)):
        parts += one(piece, NAMES[piece]).parts if index % 2 else [piece]
    return Text(tuple(each for each in parts if each))


@pytest.mark.parametrize(
    'written',
    [
        "'«mode»' == 'race' and «count» > 1",
        "'«mode»'.lower() in ['race', 'slow']",
        'not «sim»',
        '«count» * 2 - 1',
        "'fast' if «sim» else 'slow'",
        "'«mode»_«count»'",
        "'' == '«mode»' or «count» // 2 == 1",
        "'«mode»'.startswith('r')",
        '«sim» and («count» < 4 or False)',
    ],
)
def test_the_value_is_that_of_python(written):
    source = source_of(written)
    result = eval(source.text)
    found = translate(source, str(result))
    assert not found.is_constant
    (part,) = found.parts
    assert evaluate_expression(Sandbox(), part.code, NAMES) == result


@pytest.mark.parametrize(
    'written', ["__import__('os').getenv('«mode»')", "['«mode»' for _ in '']"]
)
def test_what_the_language_lacks_is_told(written):
    with pytest.raises(UnlikeError):
        translate(source_of(written), '')


def test_what_depends_on_nothing_is_constant():
    assert translate(Text(('1 + 1',)), '2').written() == '2'
