"""The filters that read texts as launch files do."""

import pytest
from jinja2 import TemplateRuntimeError

from composer.expressions.functions import from_yaml, path_join, to_bool


@pytest.mark.parametrize(
    ('text', 'value'),
    [('true', True), (' True', True), ('1', True), ('FALSE', False), ('0', False), (True, True)],
)
def test_bool_reads_what_conditions_read(text, value):
    assert to_bool(text) is value


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('', ''),
        ('left', 'left'),
        ('1', 1),
        ('1.5', 1.5),
        ('True', True),
        ("'1'", '1'),
        ('[1, 2]', [1, 2]),
        (3, 3),
    ],
)
def test_from_yaml_reads_what_parameters_read(text, value):
    found = from_yaml(text)
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize('text', ['maybe', ''])
def test_bool_refuses_all_else(text):
    with pytest.raises(TemplateRuntimeError, match='neither true nor false'):
        to_bool(text)


@pytest.mark.parametrize('text', ['{a: 1}', '2020-01-01', '[[1]]', 'a: b: c', '[&a 1, *a]'])
def test_from_yaml_refuses_what_no_parameter_can_be(text):
    with pytest.raises(TemplateRuntimeError):
        from_yaml(text)


@pytest.mark.parametrize(
    ('parts', 'path'),
    [(['/a', 'b'], '/a/b'), (['/a/', 'b', ''], '/a/b/'), (['/a', '/b', 'c'], '/b/c'), ('a', 'a')],
)
def test_an_absolute_part_of_a_path_replaces_those_before_it(parts, path):
    assert path_join(parts) == path


@pytest.mark.parametrize('parts', [[], ['a', 1], 3])
def test_path_join_refuses_all_but_texts(parts):
    with pytest.raises(TemplateRuntimeError, match='needs a list of texts'):
        path_join(parts)
