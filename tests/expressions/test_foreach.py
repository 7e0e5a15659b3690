"""`foreach` and `when`."""

import pytest

from composer.language.pipeline import load_system, load_system_text

HEAD = 'version: 1\n'


def load(text, words=None):
    return load_system_text(HEAD + text, words=words)


def names(system):
    return [node.name for node in system.spec.nodes.values()]


def messages(system):
    return [(each.rule, each.message) for each in system.diagnostics]


def test_a_node_is_repeated_for_each_value_which_keeps_its_type():
    system = load(
        """
nodes:
  "wheel_{{ i }}":
    foreach: {i: [1, 2]}
    parameters: {index: "{{ i }}"}
"""
    )
    assert not system.diagnostics
    assert names(system) == ['wheel_1', 'wheel_2']
    values = [node.parameters['index'].value for node in system.spec.nodes.values()]
    assert values == [1, 2]


def test_several_variables_give_all_combinations_and_see_those_before_them():
    system = load(
        """
args: {sides: 2}
nodes:
  "leg_{{ side }}_{{ joint }}":
    foreach: {side: "{{ range(sides) }}", joint: "{{ range(side + 1) }}"}
"""
    )
    assert names(system) == ['leg_0_0', 'leg_1_0', 'leg_1_1']


def test_a_node_whose_condition_fails_is_not_there_but_still_held_against_the_schema():
    system = load(
        """
args: {sim: true}
nodes:
  real: {when: "{{ not sim }}", log_levl: debug}
  simulated: {when: "{{ sim }}"}
"""
    )
    assert names(system) == ['simulated']
    assert [node.name for node in system.unused.nodes.values()] == ['real']
    assert messages(system) == [('unknown-key', "unknown key 'log_levl' in node 'real'")]


def test_a_condition_sees_the_variables_of_foreach():
    system = load(
        """
nodes:
  "n{{ i }}": {foreach: {i: [0, 1, 2]}, when: "{{ i != 1 }}"}
"""
    )
    assert names(system) == ['n0', 'n2']


def test_findings_in_a_repeated_node_are_at_its_lines_and_said_once():
    system = load(
        """
nodes:
  "n{{ i }}":
    foreach: {i: [0, 1]}
    timers: {t: {period: 0, behaviour: 'a:b'}}
"""
    )
    assert {(each.rule, each.span.line) for each in system.diagnostics} == {('out-of-range', 6)}


@pytest.mark.parametrize(
    ('foreach', 'rule', 'message'),
    [
        ('[1, 2]', 'bad-foreach', "foreach must be a mapping, as in 'foreach: {i: [1, 2]}'"),
        ('{}', 'bad-foreach', 'foreach has no variables'),
        ('{i: 3}', 'bad-foreach', "'i' takes a list of values, not 3"),
        ('{in: [3]}', 'bad-foreach', "'in' cannot be used as a name in expressions"),
        ('{i: "{{ nope }}"}', 'undefined-name', "'nope' is not defined"),
    ],
)
def test_a_foreach_that_makes_no_sense_is_said_at_its_place(foreach, rule, message):
    system = load(f'nodes:\n  "n{{{{ i }}}}":\n    foreach: {foreach}\n')
    assert messages(system)[0] == (rule, message)
    assert system.diagnostics[0].span.line == 4


def test_a_condition_that_is_no_boolean_is_said():
    system = load('nodes: {a: {when: "{{ 1 }}"}}')
    assert messages(system) == [('bad-when', 'when must be true or false, not 1')]


@pytest.mark.parametrize(
    ('name', 'foreach', 'made', 'help_text'),
    [
        ('n', '{i: [1, 2]}', 'n', 'use its variables in the name, as in "n_{{ i }}"'),
        (
            'n_{{ row }}',
            '{row: [1], kind: [a, b]}',
            'n_1',
            'use its variables in the name, as in "n_{{ row }}_{{ kind }}"',
        ),
        ('n{{ i }}', '{i: [1, 1]}', 'n1', "a variable's list should have each value once"),
    ],
)
def test_one_name_for_all_repetitions_is_said_with_the_way_out(name, foreach, made, help_text):
    (finding,) = load(f'nodes: {{"{name}": {{foreach: {foreach}}}}}').diagnostics
    assert finding.message == f"foreach makes more than one '{made}'"
    assert finding.help == help_text


def test_here_is_the_folder_of_the_file_and_env_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv('ROBOT', 'r2')
    path = tmp_path / 'a.yaml'
    path.write_text(
        'version: 1\nnodes: {n: {parameters: {a: "{{ here }}", b: "{{ env(\'ROBOT\') }}", '
        "c: \"{{ env('NO_SUCH', 'none') }}\"}}}\n"
    )

    system = load_system(path)
    values = {name: each.value for name, each in system.spec.nodes['n'].parameters.items()}
    assert values == {'a': str(tmp_path), 'b': 'r2', 'c': 'none'}


def test_a_missing_variable_or_package_is_a_finding(monkeypatch):
    monkeypatch.delenv('NO_SUCH', raising=False)
    system = load(
        """
nodes:
  n:
    parameters:
      a: "{{ env('NO_SUCH') }}"
      b: "{{ find('no_such_package') }}"
"""
    )
    assert messages(system) == [
        (
            'bad-expression',
            "the environment variable 'NO_SUCH' is not set; give a default, as in env('NO_SUCH', 'none')",
        ),
        ('uninstalled-package', "no package 'no_such_package' is installed"),
    ]


# A value of each kind of entity, repeated and left out.
ENTITIES = {
    'parameters': 'default: 1',
    'publishers': 'type: std_msgs/msg/String',
    'subscriptions': 'type: std_msgs/msg/String, behaviour: "m:f"',
    'timers': 'rate: 1, behaviour: "m:f"',
    'services': 'type: std_srvs/srv/Empty, behaviour: "m:f"',
    'service_clients': 'type: std_srvs/srv/Empty',
    'actions': 'type: example_interfaces/action/Fibonacci, behaviour: "m:f"',
    'action_clients': 'type: example_interfaces/action/Fibonacci',
}


@pytest.mark.parametrize('section', ENTITIES)
def test_entities_of_every_section_are_repeated_and_left_out_as_nodes_are(section):
    system = load(
        f"""
args: {{count: 2}}
nodes:
  "n_{{{{ k }}}}":
    foreach: {{k: [a, b]}}
    {section}:
      "x_{{{{ k }}}}_{{{{ i }}}}":
        foreach: {{i: "{{{{ range(count) }}}}"}}
        {ENTITIES[section].replace(', ', chr(10) + '        ')}
      plain: {{ {ENTITIES[section]} }}
      gone: {{ when: "{{{{ count > 2 }}}}", {ENTITIES[section]} }}
"""
    )
    assert not system.diagnostics
    assert {name: [*getattr(node, section)] for name, node in system.spec.nodes.items()} == {
        'n_a': ['x_a_0', 'x_a_1', 'plain'],
        'n_b': ['x_b_0', 'x_b_1', 'plain'],
    }
    # They are still read, and have their places in the file.
    assert [*getattr(system.unused.nodes['n_a'], section)][-1] == 'gone'
    span = system.positions.key(('nodes', 'n_b', section, 'x_b_1'))
    assert (span.line, span.column) == (8, 7)


def test_what_is_wrong_with_a_repeated_entity_is_reported_at_its_place():
    system = load(
        """
nodes:
  n:
    publishers:
      "p_{{ i }}": {foreach: {i: 3}, type: std_msgs/msg/String}
      "q": {foreach: {i: [1, 2]}, type: std_msgs/msg/String}
      "r": {when: 1, type: std_msgs/msg/String}
      "s": {foreach: {}, type: std_msgs/msg/String}
    timers:
      t: {whn: "{{ false }}", rate: 1, behaviour: "m:f"}
    subscription:
      "x_{{ i }}": {foreach: {i: [1, 2]}, typ: std_msgs/msg/String, behaviour: "m:f"}
"""
    )
    found = [(each.rule, each.span.line, each.span.column) for each in system.diagnostics]
    assert sorted(found) == [
        ('bad-foreach', 6, 34),
        ('bad-foreach', 9, 22),
        ('bad-when', 8, 19),
        ('duplicate-key', 7, 7),
        ('unknown-key', 11, 11),
        ('unknown-key', 12, 5),
        ('unknown-key', 13, 43),
        ('unknown-key', 13, 43),
    ]
    assert [*system.spec.nodes['n'].subscriptions] == ['x_1', 'x_2']
    assert not system.spec.nodes['n'].timers


def test_an_expression_without_a_value_leaves_out_what_it_stands_for():
    text = """
args: {simulated: false, file: ''}
processes:
  p:
    command: [echo, "{{ file if file else none }}", end]
    name: p
    env: {A: "{{ 'x' if simulated else none }}"}
    remap: {a: "{{ 'b' if simulated else none }}"}
    parameters: {use_sim_time: "{{ true if simulated else none }}"}
    lifecycle: "{{ 'active' if simulated else none }}"
    on_exit: "{{ 'shutdown' if simulated else none }}"
environment: {B: "{{ 'x' if simulated else none }}"}
"""
    system = load(text, [])
    process = system.spec.processes['p']
    assert (messages(system), process.command) == ([], ('echo', 'end'))
    assert not any((process.env, process.remap, process.parameters, process.lifecycle))
    assert system.spec.environment == {}
    process = load(text, ['simulated:=true', 'file:=x']).spec.processes['p']
    assert process.command == ('echo', 'x', 'end')
    assert (process.env, process.remap) == ({'A': 'x'}, (('a', 'b'),))
    assert process.parameters == {'use_sim_time': True}
