"""Values of a file against the annotations of parameters."""

import pytest

from composer.python_source.annotations import find_wanted_values


def wanted(annotation, value, **others):
    return [each.text for each in find_wanted_values(annotation, value, others)]


@pytest.mark.parametrize(
    ('annotation', 'value'),
    [
        ('int', 3),
        ('float', 3),
        ('int | str', 'a'),
        ('Union[int, str]', 'a'),
        ('int', None),
        ("Literal['a', 1]", 1),
        ("Annotated[float, '> 0']", 0.1),
        ("typing.Annotated[float, '> 0', '<= 1']", 1),
        ("Annotated[int, '>= -5']", -5),
        ("Annotated[str, '> 0']", 'a'),
        ("Annotated[int, '< other']", 3),
        ('list[int]', [1, 2]),
        ('dict[str, int]', {'a': 1}),
        ('tuple[int, int]', [1]),
        ('int |', 'a'),
        ('Colour', 'a'),
    ],
)
def test_a_value_that_fits_or_may_fit_is_let_pass(annotation, value):
    assert wanted(annotation, value) == []


@pytest.mark.parametrize(
    ('annotation', 'value', 'texts'),
    [
        ('int', 'a', ['int']),
        ('int', 0.5, ['int']),
        ('int | str', [1], ['int', 'str']),
        ("Literal['fast', 'slow']", 'fats', ["'fast'", "'slow'"]),
        ("Annotated[float, '> 0']", 0, ['float > 0']),
        ("Annotated[float, '>= 0', '< 1']", 1, ['float >= 0 and < 1']),
        ("Annotated[float, '> 0']", 'a', ['float > 0']),
        ('list[int] | None', [1, 'a'], ['a list of int']),
        ('Mapping[str, str]', ['a'], ['a mapping']),
        ("Annotated[int, '< other']", 7, ["int < 'other' (5)"]),
    ],
)
def test_a_value_that_does_not_fit_is_told_what_would(annotation, value, texts):
    assert wanted(annotation, value, other=5) == texts
