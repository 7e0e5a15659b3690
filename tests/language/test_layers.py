"""Several files as one, and settings on the command line."""

import textwrap

import pytest

from composer.errors import UsageError
from composer.language.pipeline import load_system
from composer.rules import Severity

BASE = """
    version: 1
    args: {robots: 1}
    nodes:
      talker:
        log_level: info
        parameters: {rate: 1.0, a.b: 2}
        publishers: {chatter: std_msgs/msg/String}
        timers: {tick: {period: 1.0, publish: chatter, message: hello}}
      listener: {}
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(**files):
        paths = []
        for name, text in files.items():
            path = tmp_path / f'{name}.yaml'
            path.write_text(textwrap.dedent(text).lstrip())
            paths.append(path.relative_to(tmp_path))
        return paths

    return write


def load(paths, *set_values, words=None):
    return load_system(paths[0], words, layers=paths[1:], set_values=set_values)


def test_mappings_merge_and_all_else_replaces(write):
    site = """
        nodes:
          talker: {log_level: debug, timers: {tick: {period: 0.5}}}
          extra: {}
    """
    system = load(write(base=BASE, site=site))
    assert not system.diagnostics
    talker = system.spec.nodes['talker']
    assert talker.log_level == 'debug'
    assert (talker.timers['tick'].period_sec, talker.timers['tick'].message) == (0.5, 'hello')
    assert list(system.spec.nodes) == ['talker', 'listener', 'extra']


def test_null_removes(write):
    system = load(write(base=BASE, site='nodes: {listener: null, talker: {log_level: null}}'))
    assert list(system.spec.nodes) == ['talker']
    assert system.spec.nodes['talker'].log_level is None


@pytest.mark.parametrize(
    ('site', 'place', 'message', 'help_text'),
    [
        (
            'nodes: {listner: null}',
            'site.yaml:1:9',
            "null removes 'listner', which does not exist",
            "did you mean 'listener'?",
        ),
        (
            'nodes: {talker: {publishers: {x: {type: std_msgs/msg/Empty, qos: null}}}}',
            'site.yaml:1:61',
            "null removes 'qos', which does not exist",
            None,
        ),
        (
            'nodes: {talkr: {log_level: debug}}',
            'site.yaml:1:9',
            "there is no node 'talkr' to change",
            "did you mean 'talker'?",
        ),
    ],
)
def test_a_layer_that_changes_nothing_is_a_finding(write, site, place, message, help_text):
    (finding,) = load(write(base=BASE, site=site)).diagnostics
    assert (finding.rule, finding.severity) == ('changes-nothing', Severity.WARNING)
    assert (str(finding.span), finding.message, finding.help) == (place, message, help_text)


@pytest.mark.parametrize(
    ('site', 'place', 'what', 'meant'),
    [
        ('nodes: {talker: {timers: {tik: {period: 2}}}}', 'site.yaml:1:27', "timer 'tik'", 'tick'),
        ('include: {prat: {args: {x: 1}}}', 'site.yaml:1:11', "include 'prat'", 'part'),
    ],
)
def test_a_layer_with_half_an_entry_means_the_nearest(write, site, place, what, meant):
    base = (
        textwrap.dedent(BASE)
        + 'processes: {driver: {command: [sh]}}\ninclude: {part: {file: part.yaml}}\n'
    )
    paths = write(base=base, site=site, part='version: 1\nargs: {x: 2}\nnodes: {}\n')[:2]
    (finding,) = load(paths).diagnostics
    message = f'there is no {what} to change, and for a new one keys are missing'
    assert (finding.rule, str(finding.span), finding.message) == ('missing-key', place, message)
    assert finding.help == f"did you mean '{meant}'?"


@pytest.mark.parametrize(
    ('layers', 'found'),
    [
        (['args: {rat: 2}'], ["there is no argument 'rat' to change"]),
        (['args: {rate: 2}'], []),
        (['args: {level: debug}\nnodes: {talker: {log_level: "{{ level }}"}}'], []),
        (
            ['args: {level: debug}', 'args: {level: info}'],
            ["there is no argument 'level' to change"],
        ),
        (
            ['args: {level: debug}\nnodes: {talker: {log_level: debug}}'],
            ["there is no argument 'level' to change"],
        ),
    ],
)
def test_a_layer_declares_only_arguments_that_it_uses(write, layers, found):
    texts = {f'layer_{index}': text for index, text in enumerate(layers)}
    system = load(write(base='version: 1\nargs: {rate: 1}\nnodes: {talker: {}}', **texts))
    assert [each.message for each in system.diagnostics] == found


def test_a_later_layer_wins_over_an_earlier_one(write):
    layers = {name: f'nodes: {{talker: {{log_level: {name}}}}}' for name in ('debug', 'error')}
    assert load(write(base=BASE, **layers)).spec.nodes['talker'].log_level == 'error'


def test_a_finding_in_a_layer_is_said_at_the_layer(write):
    (finding,) = load(write(base=BASE, site='nodes: {talker: {log_levl: debug}}')).diagnostics
    assert str(finding.span) == 'site.yaml:1:18'


def test_a_layer_that_cannot_be_read_stops_all(write):
    paths = write(base=BASE)
    system = load([*paths, paths[0].with_name('none.yaml')])
    assert system.spec is None
    assert system.diagnostics[0].rule == 'unreadable-file'


def test_a_layer_may_change_arguments(write):
    system = load(write(base=BASE, site='args: {robots: 3}'))
    assert system.arguments['robots'].default == 3


@pytest.mark.parametrize(
    ('setting', 'read'),
    [
        ('nodes.talker.log_level=debug', lambda talker: talker.log_level == 'debug'),
        ('nodes.talker.timers.tick.period=0.1', lambda t: t.timers['tick'].period_sec == 0.1),
        ('nodes.talker.parameters.rate=2', lambda t: t.parameters['rate'].value == 2),
        ('nodes.talker.parameters.a.b=5', lambda t: t.parameters['a.b'].value == 5),
        ('nodes.talker.log_level=null', lambda talker: talker.log_level is None),
        ('nodes.talker.remap={a: b}', lambda talker: talker.remap == (('a', 'b'),)),
        ('nodes.talker.description="{{ robots }} robots"', lambda t: t.description == '1 robots'),
    ],
)
def test_a_setting_is_the_last_layer_and_typed_as_in_a_file(write, setting, read):
    system = load(write(base=BASE), setting)
    assert not system.diagnostics
    assert read(system.spec.nodes['talker'])


@pytest.mark.parametrize(
    ('setting', 'message', 'help_text'),
    [
        ('nodes.talkr.log_level=debug', "there is no 'talkr' in nodes", "did you mean 'talker'?"),
        (
            'nodes.talker.log_level.x=1',
            "'nodes.talker.log_level' is a value, and has no 'x' in it",
            None,
        ),
        (
            'nodes.talker',
            "'nodes.talker' sets nothing",
            'write path=value, as in executor.threads=4',
        ),
        (
            'nodes.talker.timers.tock=null',
            "there is no 'tock' in nodes.talker.timers",
            "did you mean 'tick'?",
        ),
        (
            'executr=null',
            "there is no 'executr' to remove",
            'there are: args, nodes, version',
        ),
    ],
)
def test_a_setting_that_leads_nowhere_is_refused(write, setting, message, help_text):
    with pytest.raises(UsageError) as caught:
        load(write(base=BASE), setting)
    assert str(caught.value).endswith(message)
    assert caught.value.help == help_text


def test_a_finding_in_a_setting_is_said_at_the_setting(write):
    (finding,) = load(write(base=BASE), 'nodes.talker.log_level=loud').diagnostics
    assert finding.span.source.name == '--set nodes.talker.log_level=loud'
    assert finding.span.text == 'loud'


def test_names_of_sections_are_names_like_others(write):
    system = load(
        write(base='version: 1\nnodes: {timers: {description: x}}\n'),
        'nodes.timers.log_level=debug',
    )
    assert system.spec.nodes['timers'].log_level == 'debug'
