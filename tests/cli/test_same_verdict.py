"""`composer up` says of a file what `composer check` says, and refuses what that refuses."""

import pytest

from composer.cli import main as cli
from composer.rules import RULES_FOLDER, load_rule
from composer.scenarios.recognition import is_scenario_file

# Of each part of the check.
RULES = """
    yaml-syntax alias-bomb unknown-key missing-include bad-expression incompatible-qos
    conflicting-domains unknown-behaviour bad-signature broken-behaviour unknown-state
    unknown-type no-definitions unknown-executable unknown-topic
"""
REFUSED = [
    pytest.param(name, marks=pytest.mark.ros if load_rule(name).needs else ())
    for name in RULES.split()
]


@pytest.mark.parametrize('rule', REFUSED)
def test_what_check_refuses_is_refused_in_the_same_words(rule, capsys, monkeypatch):
    monkeypatch.chdir(RULES_FOLDER / rule)
    imports = ['--import'] if rule == 'broken-behaviour' else []
    assert cli.run(['check', '--quiet', *imports, 'bad.yaml']) == 1
    said = capsys.readouterr().out
    assert f'error[{rule}]: ' in said
    if is_scenario_file(RULES_FOLDER / rule / 'bad.yaml'):
        assert cli.run(['up', 'bad.yaml']) == 2
        assert 'run it with composer test bad.yaml' in capsys.readouterr().err
        return
    assert cli.run(['up', 'bad.yaml']) == 1
    assert capsys.readouterr() == ('', said)


@pytest.mark.ros
def test_what_a_comment_silences_is_started_with(compose):
    code = 'def start(node, speed): ...\n\ndef end(node):\n    node.shutdown(0)\n'
    text = """
        version: 1
        nodes:
          rover:
            on_stop: parts:start  # composer: ignore[bad-signature]
            timers: {end: {period: 0.1, behaviour: parts:end}}
        """
    child = compose(text, code)
    assert child.wait() == 0
    assert 'error[' not in child.output
