"""`composer plan`: the operations that an edit comes to."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from composer.cli.main import run as run_command
from composer.diagnostics import SourceFile, Span
from composer.planning.plan import Change
from composer.planning.text import describe_change

ROOT = Path(__file__).resolve().parents[2]

SYSTEM = """\
version: 1
qos:
  near: {depth: 3}
nodes:
  talker:
    parameters:
      speed: {default: 1.0, maximum: 10.0}
    parameter_files: [values.yaml]
    state: {count: 0}
    publishers:
      words: {type: std_msgs/msg/String, qos: near}
    timers:
      say: {period: 0.5, behaviour: parts:say, publish: words}
    on_start: parts:begin
  listener:
    subscriptions:
      words: {type: std_msgs/msg/String, behaviour: parts:hear, with: {loud: true}}
processes:
  driver: {command: [sleep, '1'], on_exit: shutdown}
"""
CODE = """\
import helper


def say(node):
    node.state.count += 1
    return str(node.parameters.speed)


def begin(node, loud=True):
    helper.log(node)


def hear(node, message, loud):
    node.logger.info(message.data if loud else '')
"""
HELPER = "def log(node):\n    node.logger.info('begun')\n"
VALUES = 'talker:\n  ros__parameters:\n    speed: 2.0\n'

# What is replaced, by what, in which file (the system's if none is named), and the lines.
EDITS = [
    ('period: 0.5', 'rate: 4', None, ["~ timer 'say' of 'talker': period 0.5 → 0.25 (13 → 13)"]),
    (
        "[sleep, '1']",
        "[sleep, '1'], publishers: {words: std_msgs/msg/String}, nodes: {driver: {}}",
        None,
        [],
    ),
    (
        'speed: 2.0',
        'speed: 2.0\n    use_sim_time: true',
        'values.yaml',
        ["~ node 'talker': use_sim_time false → true (5 → values.yaml:4)"],
    ),
    (
        'depth: 3',
        'depth: 4',
        None,
        [
            "± publisher 'words' of 'talker': qos.depth 3 → 4 (11 → 11); "
            'ROS fixes this when it is created; lost: messages not delivered yet'
        ],
    ),
    (
        'loud: true',
        'loud: false',
        None,
        ["~ subscription 'words' of 'listener': with.loud true → false (17 → 17)"],
    ),
    (
        '  talker:',
        '  talker:\n    local_delivery: false',
        None,
        ["~ publisher 'words' of 'talker': local_delivery true → false (11 → 6)"],
    ),
    (
        'maximum: 10.0',
        'maximum: 10.0, read_only: true',
        None,
        [
            "± parameter 'speed' of 'talker': read_only false → true (7 → 7); "
            'ROS fixes this when the parameter is declared; lost: a value set while it ran'
        ],
    ),
    (
        'speed: 2.0',
        'speed: 3.0',
        'values.yaml',
        ["~ parameter 'speed' of 'talker': value 2.0 → 3.0 (values.yaml:3 → values.yaml:3)"],
    ),
    (
        '  listener:',
        '  hearer:',
        None,
        [
            "- node 'listener' (15); lost: its state, parameters set while it ran, all that is queued",
            "+ node 'hearer' (15)",
        ],
    ),
    (
        '  listener:',
        '  listener:\n    remap: {words: talk}',
        None,
        [
            '± node \'listener\': remap [] → [["words", "talk"]] (15 → 16); '
            'ROS reads this when the node is created; '
            'lost: its state, parameters set while it ran, all that is queued'
        ],
    ),
    (
        "'1'",
        "'2'",
        None,
        [
            '± process \'driver\': command ["sleep", "1"] → ["sleep", "2"] (19 → 19); '
            'a process takes this when it starts; lost: the running process'
        ],
    ),
    (
        'on_exit: shutdown',
        'delay: 2',
        None,
        [
            '~ process \'driver\': on_exit ["shutdown"] → [] (19 → 19), delay 0.0 → 2.0 (19 → 19); '
            'delay counts from its next start'
        ],
    ),
    (
        "'begun'",
        "'began'",
        'helper.py',
        [
            "~ node 'talker': on_start has new code (14); on_start counts from its next start",
            "~ timer 'say' of 'talker': behaviour has new code (13)",
            "~ subscription 'words' of 'listener': behaviour has new code (17)",
        ],
    ),
    (
        'version: 1',
        'version: 1\nexecutor: {threads: 2}',
        None,
        ["~ system 'system': executor.threads = 2 (2)"],
    ),
    (
        'on_start: parts:begin',
        'on_start: {behaviour: parts:begin, with: {loud: false}}',
        None,
        ["~ node 'talker': on_start.with.loud = false (14); on_start counts from its next start"],
    ),
    (
        '    parameters:',
        '    warn_after: null\n    parameters:',
        None,
        [
            "~ node 'talker': warn_after 5.0 → never (5 → 6)",
            "~ timer 'say' of 'talker': warn_after 5.0 → never (13 → 6)",
        ],
    ),
    (
        '  listener:',
        '  listener:\n    namespace: /far',
        None,
        [
            "- node 'listener' (15); lost: its state, parameters set while it ran, all that is queued",
            "+ node '/far/listener' (15)",
        ],
    ),
    ('qos: near}', 'qos: near, topic: /words}', None, []),
    ('version: 1', '# nothing\nversion: 1', None, []),
]


@pytest.fixture
def plan(tmp_path, monkeypatch, capsys):
    """Run `composer plan` on two folders with the files, the second of them edited."""
    monkeypatch.chdir(tmp_path)

    def plan(old, new, name, *options):
        for folder in ('old', 'new'):
            (tmp_path / folder).mkdir()
            texts = {
                'system.yaml': SYSTEM,
                'parts.py': CODE,
                'helper.py': HELPER,
                'values.yaml': VALUES,
            }
            if folder == 'new':
                edited = name or 'system.yaml'
                assert old in texts[edited]
                texts[edited] = texts[edited].replace(old, new, 1)
            for file, text in texts.items():
                (tmp_path / folder / file).write_text(text)
        code = run_command(['plan', 'old/system.yaml', 'new/system.yaml', *options])
        return code, capsys.readouterr().out

    return plan


@pytest.mark.parametrize(('old', 'new', 'name', 'lines'), EDITS)
def test_an_edit_is_told_in_a_line_each(plan, old, new, name, lines):
    code, out = plan(old, new, name, '--exit-code')
    *found, summary = out.splitlines()
    for folder in ('old', 'new'):
        found = [
            line.replace(f'{folder}/system.yaml:', '').replace(f'{folder}/', '') for line in found
        ]
    assert found == lines
    assert summary.startswith('system: ')
    assert code == (2 if lines else 0)


@pytest.mark.parametrize(('old', 'new', 'name', 'lines'), EDITS)
def test_the_document_is_as_its_schema_says(plan, old, new, name, lines):
    code, out = plan(old, new, name, '--format', 'json')
    document = json.loads(out)
    schema = json.loads((ROOT / 'schemas' / 'plan.schema.json').read_text())
    Draft202012Validator(schema).validate(document)
    assert len(document['operations']) == len(lines) == sum(document['counts'].values())
    assert code == 0


def test_long_values_are_cut_around_their_difference():
    words = [f'word_{number}' for number in range(40)]
    changed = [*words[:30], 'other', *words[31:]]
    at = Span(SourceFile('a.yaml', ()), 1, 1, 0)

    text = describe_change(Change('command', words, changed, at, at))

    old, new = text.removesuffix(' (a.yaml:1)').removeprefix('command ').split(' → ')
    assert 'word_30' in old
    assert 'other' in new
    assert all(len(each) <= 62 and each[0] + each[-1] == '……' for each in (old, new))
