"""Data → specs: each short form means a long one, and defaults are inherited."""

import pytest

from composer.language.pipeline import load_system, load_system_text
from composer.language.specs import BehaviourSpec, ParameterSpec, QosSpec


def load(text):
    """Return the spec of a text in which nothing is wrong."""
    loaded = load_system_text('version: 1\n' + text)
    assert loaded.diagnostics == []
    return loaded.spec


def load_node(text, rest=''):
    return load(f'{rest}\nnodes: {{rover: {text}}}').nodes['rover']


def test_a_system_has_the_name_of_its_file(tmp_path):
    path = tmp_path / 'fleet.of.rovers.yaml'
    path.write_text('version: 1\nnodes: {}\n')
    assert load_system(path).spec.name == 'fleet.of.rovers'


def test_a_system_without_anything_has_the_defaults():
    spec = load('nodes: {}')
    assert (spec.description, dict(spec.qos), dict(spec.nodes)) == ('', {}, {})
    assert (spec.threads, spec.shutdown_timeout_sec) == (None, 5.0)


def test_the_executor_is_as_declared():
    spec = load('nodes: {}\nexecutor: {threads: 2, shutdown_timeout: 1}')
    assert (spec.threads, spec.shutdown_timeout_sec) == (2, 1.0)
    assert isinstance(spec.shutdown_timeout_sec, float)


@pytest.mark.parametrize(
    ('written', 'period_sec'),
    [
        ('', 1.0),
        ('diagnostics: true', 1.0),
        ('diagnostics: {}', 1.0),
        ('diagnostics: {period: 5}', 5.0),
        ('diagnostics: false', None),
    ],
)
def test_diagnostics_have_a_period_or_are_off(written, period_sec):
    assert load(f'nodes: {{}}\n{written}').diagnostics_period_sec == period_sec


def test_a_node_has_parameter_services_and_rosout_by_itself():
    node = load_node('{}')
    assert (node.parameter_services, node.rosout) == (True, True)
    assert (node.type_description_service, node.logger_services) == (False, False)


@pytest.mark.parametrize(
    'key', ['parameter_services', 'rosout', 'type_description_service', 'logger_services']
)
@pytest.mark.parametrize('value', [True, False])
def test_defaults_turn_services_on_or_off_and_a_node_has_the_last_word(key, value):
    word, opposite = str(value).lower(), str(not value).lower()
    spec = load(
        f'defaults: {{{key}: {word}}}\n'
        'nodes:\n'
        '  heir: {parameters: {speed: 1}}\n'
        '  plain: {}\n'
        f'  own: {{{key}: {opposite}}}\n'
    )
    assert [getattr(spec.nodes[name], key) for name in ('heir', 'plain', 'own')] == [
        value, value, not value
    ]  # fmt: skip


def test_nodes_inherit_what_they_do_not_say():
    spec = load(
        'defaults: {namespace: fleet, log_level: warn, use_sim_time: true, on_error: restart, qos: 3}\n'
        'nodes:\n'
        '  heir: {publishers: {a: std_msgs/msg/String}}\n'
        '  own:\n'
        '    namespace: /elsewhere\n'
        '    log_level: debug\n'
        '    use_sim_time: false\n'
        '    on_error: shutdown\n'
        '    publishers: {a: {type: std_msgs/msg/String, qos: 4}}\n'
    )
    heir, own = spec.nodes['heir'], spec.nodes['own']
    assert (heir.namespace, heir.log_level, heir.use_sim_time, heir.on_error) == (
        '/fleet', 'warn', True, 'restart'
    )  # fmt: skip
    assert (own.namespace, own.log_level, own.use_sim_time, own.on_error) == (
        '/elsewhere', 'debug', False, 'shutdown'
    )  # fmt: skip
    path = ('nodes', 'heir', 'publishers', 'a', 'qos')
    assert heir.publishers['a'].qos == QosSpec('default', {'depth': 3}, path)
    assert own.publishers['a'].qos.policies == {'depth': 4}


@pytest.mark.parametrize(
    ('default', 'own', 'full'),
    [
        ('', None, '/'),
        ('fleet', None, '/fleet'),
        ('/fleet', None, '/fleet'),
        ('fleet', 'first', '/fleet/first'),
        ('fleet', '/first', '/first'),
        ('fleet', '/', '/'),
    ],
)
def test_a_relative_namespace_lies_in_the_default_one(default, own, full):
    text = '{}' if own is None else f'{{namespace: "{own}"}}'
    assert load_node(text, f'defaults: {{namespace: "{default}"}}').namespace == full


def test_entities_inherit_how_long_they_may_run():
    def entities(key, entry):
        return f' {key}: {{a: {{{entry}}}, b: {{{entry}, warn_after: 0.5}}, c: {{{entry}, warn_after: null}}}},'

    node = load_node(
        '{warn_after: 2,'
        + entities('timers', 'period: 1, behaviour: m:f')
        + entities('subscriptions', 'type: p/msg/T, behaviour: m:f')
        + entities('services', 'type: p/srv/T, behaviour: m:f')
        + entities('actions', 'type: p/action/T, behaviour: m:f')
        + '}',
        'defaults: {warn_after: null}',
    )
    assert node.warn_after_sec == 2.0
    for kind in (node.timers, node.subscriptions, node.services, node.actions):
        assert [entity.warn_after_sec for entity in kind.values()] == [2.0, 0.5, None]
    assert load_node('{}', 'defaults: {warn_after: null}').warn_after_sec is None


def test_entities_inherit_whether_they_deliver_locally():
    entities = (
        ' publishers: {a: p/msg/T, b: {type: p/msg/T, local_delivery: false},'
        ' c: {type: p/msg/T, local_delivery: true}},'
        ' services: {s: {type: p/srv/T, behaviour: m:f}}, service_clients: {s: p/srv/T},'
        ' actions: {s: {type: p/action/T, behaviour: m:f}}, action_clients: {s: p/action/T}'
    )
    for own, default, inherited in (
        ('', '', True),
        ('', 'defaults: {local_delivery: false}', False),
        ('local_delivery: true,', 'defaults: {local_delivery: false}', True),
        ('local_delivery: false,', '', False),
    ):
        node = load_node(f'{{{own}{entities}}}', default)
        found = [each.local_delivery for each in node.publishers.values()]
        assert found == [inherited, False, True]
        for kind in (node.services, node.service_clients, node.actions, node.action_clients):
            assert kind['s'].local_delivery == inherited


def test_a_publisher_may_be_its_type_alone():
    node = load_node(
        '{publishers: {scan: p/msg/T, own: {type: p/msg/T, topic: /x, qos: sensor_data}}}'
    )
    short, long = node.publishers.values()
    assert (short.name, short.type, short.topic) == ('scan', 'p/msg/T', 'scan')
    assert short.qos == QosSpec('default', {}, ())
    assert short.path == ('nodes', 'rover', 'publishers', 'scan')
    assert (long.name, long.type, long.topic) == ('own', 'p/msg/T', '/x')
    assert long.qos == QosSpec('sensor_data', {}, (*long.path, 'qos'))


@pytest.mark.parametrize(
    ('text', 'profile', 'policies'),
    [
        ('10', 'default', {'depth': 10}),
        ('10.0', 'default', {'depth': 10}),
        ('sensor_data', 'sensor_data', {}),
        ('{depth: 3}', 'default', {'depth': 3}),
        (
            '{profile: fast, reliability: reliable, deadline: infinite, lifespan: 0.5}',
            'fast',
            {'reliability': 'reliable', 'deadline': 'infinite', 'lifespan': 0.5},
        ),
    ],
)
def test_qos_has_three_forms(text, profile, policies):
    node = f'{{publishers: {{a: {{type: p/msg/T, qos: {text}}}}}}}'
    qos = load_node(node, 'qos: {fast: {depth: 1}}').publishers['a'].qos
    assert (qos.profile, qos.policies) == (profile, policies)
    assert all(type(value) is not float for key, value in policies.items() if key == 'depth')


def test_a_subscription_has_all_that_is_declared():
    relay, full = load_node(
        '{subscriptions: {relay: {type: p/msg/T, publish: out},'
        ' full: {type: p/msg/T, topic: ~/x, qos: 1, behaviour: a.b:c, with: {d: 1}, publish: out,'
        ' group: reentrant}}}'
    ).subscriptions.values()
    assert (relay.topic, relay.behaviour, relay.publish, relay.group) == (
        'relay',
        None,
        'out',
        None,
    )
    assert (full.topic, full.publish, full.group) == ('~/x', 'out', 'reentrant')
    assert full.behaviour == BehaviourSpec('a.b', 'c', {'d': 1}, (*full.path, 'behaviour'))
    assert full.behaviour.name == 'a.b:c'


def test_a_timer_has_a_period_or_a_rate():
    node = load_node('{timers: {a: {period: 2, behaviour: m:f}, b: {rate: 4, behaviour: m:f}}}')
    assert [timer.period_sec for timer in node.timers.values()] == [2.0, 0.25]
    assert [timer.clock for timer in node.timers.values()] == ['ros', 'ros']
    assert [timer.group for timer in node.timers.values()] == [None, None]


def test_a_timer_may_publish_a_constant():
    timer = load_node(
        '{timers: {a: {period: 1, publish: out, message: {data: 1}, clock: steady, group: g}}}'
    ).timers['a']
    assert timer.behaviour is None
    assert (timer.publish, timer.message, timer.clock, timer.group) == (
        'out', {'data': 1}, 'steady', 'g'
    )  # fmt: skip


def test_a_hook_has_two_forms():
    node = load_node('{on_start: m:f, on_stop: {behaviour: m:g, with: {a: [1]}}}')
    assert node.on_start == BehaviourSpec('m', 'f', {}, ('nodes', 'rover', 'on_start'))
    path = ('nodes', 'rover', 'on_stop', 'behaviour')
    assert node.on_stop == BehaviourSpec('m', 'g', {'a': [1]}, path)


def test_a_parameter_may_be_its_value_alone():
    path = ('nodes', 'rover', 'parameters', 'speed')
    assert load_node('{parameters: {speed: 3}}').parameters['speed'] == ParameterSpec(
        'speed', 'integer', 3, '', read_only=False,
        minimum=None, maximum=None, step=None, choices=None, path=path,
    )  # fmt: skip


def test_a_parameter_has_all_that_is_declared():
    path = ('nodes', 'rover', 'parameters', 'speed')
    node = load_node(
        '{parameters: {speed: {default: 1, type: double, description: fast, read_only: true,'
        ' minimum: 0, maximum: 2.5, step: 0.5, choices: [1, 2]}}}'
    )
    parameter = node.parameters['speed']
    assert parameter == ParameterSpec(
        'speed', 'double', 1.0, 'fast', read_only=True,
        minimum=0, maximum=2.5, step=0.5, choices=(1.0, 2.0), path=path,
    )  # fmt: skip
    assert [type(value) for value in (parameter.value, *parameter.choices)] == [float] * 3


@pytest.mark.parametrize(
    ('text', 'type_name', 'value'),
    [
        ('true', 'bool', True),
        ('1', 'integer', 1),
        ('1.0', 'double', 1.0),
        ('one', 'string', 'one'),
        ('[true]', 'bool_array', [True]),
        ('[1, 2]', 'integer_array', [1, 2]),
        ('[1, 2.5]', 'double_array', [1.0, 2.5]),
        ('{type: double_array}', 'double_array', None),
        ('{default: [1], type: double_array}', 'double_array', [1.0]),
        ('{default: 1, type: double}', 'double', 1.0),
        ('[]', None, []),
    ],
)
def test_the_type_of_a_parameter_is_told_by_its_value(text, type_name, value):
    parameter = load_node(f'{{parameters: {{a: {text}}}}}').parameters['a']
    assert parameter.type == type_name
    assert repr(parameter.value) == repr(value)
