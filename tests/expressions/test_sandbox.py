"""No expression runs long or makes much: it is refused before, the same on every machine."""

import json

import pytest

from composer.expressions.limits import MAX_SIZE
from composer.language.pipeline import load_system_text

TOO_LARGE = [
    "'x' * 10 ** 9",
    "('x' * 900000 ~ 'x' * 900000)",
    "'x' | center(10 ** 9)",
    "'%1000000000d' % 1",
    "('%s' * 300000) % 1",
    "'%(a)s%(a)s' % {'a': 'x' * 900000}",
    "'{:1000000000}'.format(1)",
    "('x' * 10000).replace('', 'y' * 10000)",
    "range(99999) | join('x' * 1000000)",
    "range(99999) | map('center', 1000)",
    '[[1]] * 90000 | sum(start=[])',
    '[1] | batch(10 ** 9, 0)',
    '1.5 | round(10 ** 9)',
    "[[['x' * 1000] * 30] * 30] * 30",
    'range(10 ** 6)[5]',
    "('\"' * 200000)" + ' | tojson' * 9,
    '-' * 4000 + '1',
    "'x' | string" + ' | string' * 900,
    "'" + 'x' * 20_000 + "'",
    ' == '.join(['([1] * 60000)'] * 300),
    '([1] * 60000)' + '[0:]' * 100,
]


@pytest.mark.parametrize('expression', TOO_LARGE, ids=range(len(TOO_LARGE)))
def test_what_would_be_enormous_is_refused(expression):
    text = json.dumps(f'{{{{ {expression} }}}}')
    loaded = load_system_text(f'version: 1\nnodes: {{n: {{state: {{x: {text}}}}}}}\n')
    (finding,) = loaded.diagnostics
    assert finding.rule == 'bad-expression'
    reasons = ('large', 'work', 'deep', 'big', 'too many', 'width', 'numbers', 'characters', 'sum')
    assert any(reason in finding.message.lower() for reason in reasons)


@pytest.mark.parametrize(
    'expression',
    [
        '1' + ' ~ 1' * 1000,
        "'x' * 500000",
        'range(9999) | list',
        "range(2000) | map('string') | join(', ')",
        "'%5.2f' % 3.14159",
        '2 ** 100',
    ],
)
def test_what_a_system_may_need_is_not_refused(expression):
    text = json.dumps(f'{{{{ {expression} }}}}')
    loaded = load_system_text(f'version: 1\nnodes: {{n: {{state: {{x: {text}}}}}}}\n')
    assert loaded.diagnostics == []


def test_all_expressions_of_a_file_together_are_bounded():
    half = f"{{{{ 'x' * {MAX_SIZE // 2} }}}}"
    entries = ', '.join(f's{number}: "{half}{number}"' for number in range(200))
    loaded = load_system_text(f'version: 1\nnodes: {{n: {{state: {{{entries}}}}}}}\n')
    messages = {finding.message for finding in loaded.diagnostics}
    assert messages == {'the expressions of this file take too much work'}


@pytest.mark.parametrize(
    'expression',
    ["'a'.encode('idna')", "'a'.expandtabs(9)", '[].append(1)', "'{}'.format_map({})", '(1).to_bytes(9)'],
)  # fmt: skip
def test_methods_that_are_not_listed_are_refused(expression):
    text = json.dumps(f'{{{{ {expression} }}}}')
    (finding,) = load_system_text(
        f'version: 1\nnodes: {{n: {{state: {{x: {text}}}}}}}\n'
    ).diagnostics
    assert 'unsafe' in finding.message
