"""Values of a file against the annotations of parameters."""

import pytest

from composer.python_source.annotations import find_wanted_values


def wanted(annotation, value, **others):
    return [each.text for each in find_wanted_values(annotation, value, others)]


@pytest.mark.parametrize(
    ('annotation', 'value'),
    [
        ('int', 3),
        ('int', 3.0),
        ('float', 3),
        ('int | str', 'a'),
        ('Optional[int]', 3),
        ('Union[int, str]', 'a'),
        ("'int | None'", 3),
        ('int', None),
        ("Literal['a', 1]", 1),
        ("Literal['a'] | float", 0.5),
        ("Annotated[float, '> 0']", 0.1),
        ("typing.Annotated[float, '> 0', '<= 1']", 1),
        ("Annotated[int, '>= -5']", -5),
        ("Annotated[int, 'in metres', Gt(0)]", -5),
        ("Annotated[str, '> 0']", 'a'),
        ("Annotated[int, '< other']", 3),
        ('Sequence[int]', 'a'),
        ('list[int]', [1, 2]),
        ('list[Colour]', [1, 'a']),
        ('dict[str, int]', {'a': 1}),
        ('Mapping[str, str]', {'a': 1}),
        ('tuple[int, int]', [1]),
        ('int |', 'a'),
        ('Colour', 'a'),
        ('list', []),
    ],
)
def test_a_value_that_fits_or_may_fit_is_let_pass(annotation, value):
    assert wanted(annotation, value) == []


@pytest.mark.parametrize(
    ('annotation', 'value', 'texts'),
    [
        ('int', 'a', ['int']),
        ('int', True, ['int']),
        ('int', 0.5, ['int']),
        ('int | str', [1], ['int', 'str']),
        ("Literal['fast', 'slow']", 'fats', ["'fast'", "'slow'"]),
        ('Literal[1]', True, ['1']),
        ("Annotated[float, '> 0']", 0, ['float > 0']),
        ("Annotated[float, '> 0'] | None", -1, ['float > 0']),
        ("Annotated[float, '>= 0', '< 1']", 1, ['float >= 0 and < 1']),
        ("Annotated[float, '> 0']", 'a', ['float > 0']),
        ('list[int] | None', [1, 'a'], ['a list of int']),
        ('Sequence[str]', 3, ['a list']),
        ('Mapping[str, str]', ['a'], ['a mapping']),
        ("Annotated[int, '< other']", 7, ["int < 'other' (5)"]),
    ],
)
def test_a_value_that_does_not_fit_is_told_what_would(annotation, value, texts):
    assert wanted(annotation, value, other=5) == texts
