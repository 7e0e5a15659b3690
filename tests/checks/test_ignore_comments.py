"""A comment silences what its line holds; a comment that does not is a finding itself."""

import pytest

from composer.checks.checker import check_system
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system

DRIVING = 'def start(node): ...\n\ndef steer(node, *, heading): ...\n'
HEAD = 'version: 1\nnodes:\n  rover:\n'


@pytest.fixture
def check(tmp_path):
    """Return severity, rule, line and message of all that is found."""
    (tmp_path / 'driving.py').write_text(DRIVING)

    def check(text, *, further=None, catalogue=None):
        path = tmp_path / 'rover.yaml'
        path.write_text(HEAD + text)
        found = check_system(load_system(path), catalogue or InterfaceCatalogue(), further)
        return [
            (finding.severity.value, finding.rule, finding.span.line, finding.message)
            for finding in found
        ]

    return check


def nothing_more(_context, _found):
    return ()


def test_a_comment_silences_its_rules_in_its_line(check):
    assert check('    on_start: driving:steer  # composer: ignore[bad-signature]\n') == []


def test_the_lines_around_it_are_heard(check):
    found = check(
        '    on_start: driving:steer  # composer: ignore[bad-signature]\n'
        '    on_stop: driving:steer\n'
    )
    assert [finding[:3] for finding in found] == [('error', 'bad-signature', 5)]


def test_a_rule_that_the_comment_does_not_name_is_heard(check):
    found = check('    on_start: driving:steer  # composer: ignore[bad-argument]\n')
    assert [finding[:3] for finding in found] == [('error', 'bad-signature', 4)]


def test_an_unknown_rule_is_a_warning_with_the_nearest_one(check):
    assert check('    log_level: info  # composer: ignore[bad-signatur]\n') == [
        ('warning', 'unknown-rule', 4, "there is no rule 'bad-signatur'")
    ]


def test_a_comment_that_silences_nothing_is_a_warning(check):
    assert check('    log_level: info  # composer: ignore[bad-name]\n') == [
        ('warning', 'unused-ignore', 4, "there is no 'bad-name' in this line to ignore")
    ]


def test_a_comment_without_a_rule_is_a_warning(check):
    assert check('    log_level: info  # composer: ignore\n') == [
        ('warning', 'unused-ignore', 4, 'the comment names no rule')
    ]


def test_what_stops_a_start_cannot_be_silenced(check):
    found = check('    log_level: loud  # composer: ignore[bad-value]\n')
    assert [finding[:3] for finding in found] == [
        ('error', 'bad-value', 4),
        ('warning', 'unused-ignore', 4),
    ]
    assert found[1][3] == "'bad-value' cannot be silenced: nothing can run until it is fixed"


def test_what_only_an_import_may_show_is_no_unused_comment_without_it(check):
    text = '    on_start: driving:start  # composer: ignore[bad-signature]\n'
    assert check(text) == []
    assert [finding[1] for finding in check(text, further={'import': nothing_more})] == [
        'unused-ignore'
    ]


def test_while_findings_hide_others_no_comment_is_called_unused(check):
    found = check(
        '    log_levl: info\n    on_start: driving:start  # composer: ignore[bad-name]\n'
    )
    assert [finding[1] for finding in found] == ['unknown-key']
