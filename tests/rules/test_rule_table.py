"""The table of rules is whole: what the code can emit is in it, and nothing else."""

import ast
import re
from pathlib import Path

import pytest

import composer
from composer.diagnostics import Severity
from composer.rules import FAMILIES, FAMILY_OF, RULES

PACKAGE = Path(composer.__file__).parent
# The rooms whose code emits findings.
SPEAKING = (
    'yaml_text',
    'expressions',
    'schema',
    'ros_parameters',
    'language',
    'interfaces',
    'checks',
    'cli',
)
# Words of the same form that are no rules.
NO_RULES = {'x-expected', 'site-packages'}
# Of these names one half is put in when they are emitted.
COMPOSED = {'duplicate-field', 'duplicate-constant'}


def names_in_the_code():
    found = set()
    for folder in SPEAKING:
        for path in (PACKAGE / folder).rglob('*.py'):
            for node in ast.walk(ast.parse(path.read_text())):
                text = node.value if isinstance(node, ast.Constant) else None
                if isinstance(text, str) and re.fullmatch('[a-z0-9]+(-[a-z0-9]+)+', text):
                    found.add(text)
    return found - NO_RULES - {rule for rule in found if rule.startswith('utf-')}


def test_each_rule_that_the_code_emits_is_in_the_table():
    assert names_in_the_code() - set(RULES) == set()


def test_each_rule_of_the_table_is_emitted_by_the_code():
    # The one rule of a single word.
    assert set(RULES) - names_in_the_code() - COMPOSED == {'unreadable'}


def test_a_rule_has_one_row():
    names = [rule.name for family in FAMILIES for rule in family.rules]
    assert sorted(names) == sorted(set(names))


@pytest.mark.parametrize('rule', RULES.values(), ids=lambda rule: rule.name)
def test_a_rule_is_explained_in_whole_sentences(rule):
    for text in (rule.meaning, rule.why):
        assert text.endswith('.')
        assert text[0].isupper() or text[0] == '`'
        assert '\n' not in text
    assert FAMILY_OF[rule.name].title


def test_warnings_can_be_silenced_by_a_comment_but_for_those_about_comments():
    stubborn = [
        rule.name
        for rule in RULES.values()
        if rule.severity is Severity.WARNING and not rule.is_ignorable
    ]
    assert stubborn == ['unknown-rule', 'unused-ignore']
