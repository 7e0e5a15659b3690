"""However much is wrong with a file, what is said of it has an end."""

import pytest

from composer.checks.checker import check_system
from composer.input_limits import MAX_FINDINGS
from composer.interfaces.catalogue import InterfaceCatalogue
from composer.language.pipeline import load_system_text

HEAD = 'version: 1\nnodes:\n  n:\n'
COUNT = MAX_FINDINGS + 200


def check(text):
    return check_system(load_system_text(text), InterfaceCatalogue([]))


@pytest.mark.parametrize(
    ('text', 'rule'),
    [
        (HEAD + ''.join(f'    tmers{i}: 1\n' for i in range(COUNT)), 'unknown-key'),
        (HEAD + '    state: {' + ', '.join(f'a{i}: "{{{{ b }}}}"' for i in range(COUNT)) + '}\n', 'undefined-name'),
        ('version: 1\nqos: {' + ', '.join(f'q{i}: {{profile: q{i + 1}}}' for i in range(COUNT)) + '}\nnodes: {}\n', 'cyclic-qos-profile'),
    ],
)  # fmt: skip
def test_the_first_thousand_findings_are_shown_and_that_there_are_more(text, rule):
    findings = check(text)
    assert len(findings) == MAX_FINDINGS
    assert {finding.rule for finding in findings} == {rule}
    assert findings[-1].help == (
        'only the first 1000 findings are shown: fix them to see the others'
    )


def test_a_message_that_quotes_enormous_text_is_cut():
    text = 'version: 1\nx-l: &l "' + 'a b' * 100_000 + '"\n'
    text += 'nodes: {n: {publishers: {p: {type: std_msgs/msg/String, topic: *l}}}}\n'
    messages = [finding.message for finding in check(text)]
    assert any(message.startswith("'a ba ba b") for message in messages)
    assert all(len(message) < 3000 for message in messages)


def test_a_message_holds_nothing_that_a_terminal_would_obey():
    (finding,) = check('version: 1\nnodes: {"a\\e[2J\\n": {}}\n')
    assert finding.message.startswith("'a\\x1b[2J\\n' cannot name a node")


def test_many_keys_with_expressions_keep_their_places():
    entries = ''.join(f'  "n{{{{ 1 }}}}_{i}": {{timers: 3}}\n' for i in range(500))
    findings = check(f'version: 1\nnodes:\n{entries}')
    assert [finding.span.line for finding in findings] == list(range(3, 503))
