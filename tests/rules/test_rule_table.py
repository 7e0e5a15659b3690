"""The rules are whole: what the code can emit has its data, and nothing else has."""

import re
from functools import cache
from pathlib import Path

import pytest

import composer
from composer.diagnostics import Diagnostic
from composer.entity_kinds import USED_KINDS
from composer.rules import (
    RULES_FOLDER,
    Severity,
    list_rule_names,
    load_families,
    load_rule,
)

PACKAGE = Path(composer.__file__).parent
# The rooms whose code emits findings.
SPEAKING = (
    'yaml_text',
    'expressions',
    'schema',
    'ros_parameters',
    'language',
    'interfaces',
    'node_uses',
    'checks',
    'scenarios',
    'application',
    'cli',
)
SPEAKING_FILES = ('entity_kinds.py', 'runtime/behaviours/import_check.py')
# Words of the same form that are no rules.
NO_RULES = {
    'find-pkg-share',
    'x-expected',
    'site-packages',
    'dist-packages',
    'system-out',
    'system-err',
    'rclpy-composer',
    'send-goal',
}
# Names of which the code has one half, and a table the other.
COMPOSED = {'duplicate-field', 'duplicate-constant'} | {
    f'{word}-{kind.slug}' for word in ('unknown', 'unused') for kind in USED_KINDS
}


@cache
def names_in_the_code():
    paths = [path for room in SPEAKING for path in (PACKAGE / room).rglob('*.py')]
    texts = [path.read_text() for path in [*paths, *(PACKAGE / each for each in SPEAKING_FILES)]]
    found = set(re.findall("'([a-z0-9]+(?:-[a-z0-9]+)+)'", '\n'.join(texts)))
    return found - NO_RULES - {rule for rule in found if rule.startswith('utf-')}


def test_each_rule_that_the_code_emits_is_in_the_table():
    assert names_in_the_code() - list_rule_names() == set()


def test_each_rule_of_the_table_is_emitted_by_the_code():
    # One of a single word.
    rest = {'unreadable'}
    assert list_rule_names() - names_in_the_code() - COMPOSED == rest


def test_a_rule_is_a_folder_and_belongs_to_a_family():
    folders = {path.name for path in RULES_FOLDER.iterdir() if path.is_dir()} - {'__pycache__'}
    assert folders == list_rule_names()
    names = [rule.name for family in load_families() for rule in family.rules]
    assert sorted(names) == sorted(list_rule_names())


def test_a_finding_of_an_unknown_rule_has_no_severity():
    with pytest.raises(FileNotFoundError, match='no-such-rule'):
        _ = Diagnostic('no-such-rule', 'a message', 'file.yaml').severity


def test_a_rule_is_explained_in_whole_sentences():
    for rule in map(load_rule, sorted(list_rule_names())):
        for text in (rule.meaning, rule.why):
            assert text.endswith('.')
            assert text[0].isupper() or text[0] == '`'
            assert '\n' not in text


def test_warnings_can_be_silenced_by_a_comment_but_for_those_about_comments():
    stubborn = [
        rule.name
        for rule in map(load_rule, sorted(list_rule_names()))
        if rule.severity is Severity.WARNING and not rule.ignorable
    ]
    assert stubborn == ['unknown-rule', 'unused-ignore']
