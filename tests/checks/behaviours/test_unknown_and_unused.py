"""What behaviours use and nodes declare: alarms for what is wrong, none for what cannot be told."""

import pytest

NODE = """
  a:
    parameters: {speed: 1.0}
    publishers: {out: {type: std_msgs/msg/String, external: true}}
    on_start: parts:run
"""
USES_ALL = 'print(node.parameters.speed); node.publish("out", "hello")'


def run(*lines, head='def run(node):'):
    return '\n'.join([head, *(f'    {line}' for line in lines)]) + '\n'


@pytest.mark.parametrize(
    'line',
    [
        "node.publish('outt', 1)",
        "if node.now(): node.publish('outt', 1)",
        "[node.publish('outt', each) for each in range(3)]",
        "if node.parameters.speed > 2: node.publish('outt', 1)",
        "publish = node.publish; publish('outt', 1)",
        "node.now() or node.publish('outt', 1)",
        "node.publishers['outt'].publish(1)",
        "node.publishers['outt'].active = False",
    ],
)
def test_a_name_that_the_node_does_not_declare_is_a_finding(check, line):
    assert check(NODE, run(USES_ALL, line)) == [(3, 'unknown-publisher')]


@pytest.mark.parametrize(
    'line',
    [
        "node.publishers['out'].publish('x')",
        "send = node.publishers['out'].publish; send('x')",
        "for each in node.publishers.values(): each.publish('x')",
        "ends = node.publishers; ends['out'].publish('x')",
    ],
)
def test_a_publisher_that_is_taken_is_used(check, line):
    found = check(NODE, run(line))
    assert 'unused-publisher' not in [rule for _, rule in found]


@pytest.mark.parametrize(
    ('line', 'rules'),
    [
        ('print(node.ros.get_clock(), node.parameters.sped)', ['unknown-parameter']),
        ("print(node.ros.declare_parameter('sped', 1), node.parameters.sped)", []),
        ("print(node.parameters.gear == 'high')", ['never-equal']),
        ("print(self.node.parameters.gear == 'high')", ['never-equal']),
        ("print(node.parameters.gear in ('low', 'high'))", ['never-equal']),
        ("match node.parameters.gear:\n            case 'low' | 'high': pass", ['never-equal']),
        ("print(node.parameters.gear == 'fast')", []),
        ("try: print(node.parameters.gear == 'high')\n        except KeyError: pass", []),
    ],
)
def test_in_a_class_parameters_are_known_by_their_names_and_choices(check, line, rules):
    gears = 'gear: {default: low, choices: [low, fast]}'
    text = NODE.replace('speed: 1.0', f'speed: 1.0, {gears}').replace('parts:run', 'parts:Car.run')
    code = f"""
class Car:
    def __init__(self, node):
        self.node = node

    def run(self, node):
        print(node.parameters.gear)
        {USES_ALL}
        {line}
"""
    assert [rule for _, rule in check(text, code)] == rules


@pytest.mark.parametrize(
    ('types', 'rules'),
    [
        (['std_msgs/msg/String'], ['unknown-field']),
        (['std_msgs/msg/String', 'geometry_msgs/msg/Point'], ['unknown-field']),
        (['std_msgs/msg/Strin'], ['unknown-type']),
        (['std_msgs/String'], ['unknown-type']),
        (['std_msgs/msg/String/x'], ['unknown-type']),
    ],
)
def test_the_callback_of_a_subscription_that_code_creates_is_given_its_messages(
    check, types, rules
):
    made = [f"node.create_subscription('{each}', 'in{i}', hear)" for i, each in enumerate(types)]
    code = run(USES_ALL, *made) + run('print(message.x)', head='def hear(node, message):')
    assert [rule for _, rule in check(NODE, code)] == rules


def test_a_choice_of_another_node_with_the_same_behaviour_is_no_finding(check):
    text = """
  a: {parameters: {gear: {default: low, choices: [low]}}, on_start: parts:run}
  b: {parameters: {gear: {default: high, choices: [high]}}, on_start: parts:run}
"""
    assert check(text, run("print(node.parameters.gear == 'high')")) == []


def test_of_a_function_that_lacks_the_node_only_its_signature_is_a_finding(check):
    ends = 'subscriptions: {heard: {type: std_msgs/msg/String, external: true, behaviour: parts:hear}}'
    found = check(
        f'{NODE}    {ends}\n', f'{run(USES_ALL)}def hear(message):\n    print(message.data)\n'
    )
    assert [rule for _, rule in found] == ['bad-signature']


@pytest.mark.parametrize('line', ['.cancel()', '.feedback', '.result().sequence', '.status'])
@pytest.mark.parametrize('condition', ['', 'if node.parameters.speed > 2: '])
def test_what_a_goal_takes_is_used_wherever_its_handle_goes(check, condition, line):
    ends = 'action_clients: {count: {type: test_msgs/action/Fibonacci, external: true}}'
    goal = "node.send_goal('count', {'order': int(node.parameters.speed)})"
    assert (
        check(
            NODE + f'    {ends}\n',
            run("node.publish('out', '')", f'{condition}print({goal}{line})'),
        )
        == []
    )


@pytest.mark.parametrize(
    'line',
    [
        "if node.name == 'b': node.publish('outt', 1)",
        "node.parameters.get('spee_limit', 1.0)",
        "if 'limit' in node.parameters: print(node.parameters.limit)",
        "if hasattr(node.parameters, 'limit'): print(node.parameters.limit)",
        "print(node.parameters.get('limit', 1.0))",
        "if node.parameters.speed > 2: node.publish('out2', 'far')",
        'print(node.parameters.use_sim_time)',
        "with contextlib.suppress(KeyError): print(node.parameters['sped'])",
    ],
)
def test_a_behaviour_that_copes_without_is_right(check, line):
    assert check(NODE, run(USES_ALL, line) + 'import contextlib\n') == []


@pytest.mark.parametrize(
    ('lines', 'is_found'),
    [
        (["print(changes['limit'])"], True),
        (["if 'speed' in changes:", "    print(changes['limit'])"], True),
        (["print(changes['speed'])"], False),
        (["print(changes['use_sim_time'])"], False),
        (["print(changes['qos_overrides./out.publisher.depth'])"], False),
        (["if 'limit' in changes:", "    print(changes['limit'])"], False),
        (["if node.name == 'b':", "    print(changes['limit'])"], False),
        (["node.ros.declare_parameter('limit', 1)", "print(changes['limit'])"], False),
    ],
)
def test_a_change_is_of_a_parameter_that_is_declared(check, lines, is_found):
    text = f'{NODE}    on_parameters: parts:decide\n'
    code = run(USES_ALL) + run(*lines, head='def decide(node, changes):')
    assert check(text, code) == ([(3 + len(lines), 'unknown-parameter')] if is_found else [])


def test_a_parameter_may_be_declared_with_rclpy(check):
    lines = ["node.ros.declare_parameter('mode', 0)", 'print(node.parameters.mode)']
    assert check(NODE, run(USES_ALL, *lines)) == []
    assert check(NODE, run(USES_ALL, lines[1])) == [(3, 'unknown-parameter')]


def test_helpers_are_followed_through_modules(check, tmp_path):
    (tmp_path / 'far.py').write_text('def far(node, name):\n    node.publish("outt", name)\n')
    code = 'from far import far\n\ndef near(to): far(to, 1)\n' + run(USES_ALL, 'near(node)')
    assert check(NODE, code) == [(2, 'unknown-publisher')]


def test_a_behaviour_that_is_imported_is_read_where_it_is(check, tmp_path):
    (tmp_path / 'far.py').write_text(run(USES_ALL, "node.call('ask')"))
    assert check(NODE, 'from far import run\n') == [(3, 'unknown-service-client')]


def test_what_nobody_uses_is_warned_of(check):
    assert check(NODE, run('pass')) == [(4, 'unused-parameter'), (5, 'unused-publisher')]


@pytest.mark.parametrize(
    'line',
    [
        'sys.settrace(node)',
        'sys.modules["far"].helper(node)',
        'node.publish(sys.argv[1], node.parameters[sys.argv[2]])',
        'lambda: node.publish("out", node.parameters.get("speed"))',
        'if False: node.publish("out", node.parameters.speed)',
    ],
)
def test_what_may_be_used_is_used(check, line):
    assert check(NODE, 'import sys\n' + run(line)) == []


def test_parameters_may_be_there_for_others(check):
    read = "node.get_parameters('a', ['speed'])"
    nodes = NODE + '  b:\n    on_start: parts:read\n'
    code = run('node.publish("out", "x")') + run(read, head='def read(node):')
    assert check(nodes, code) == []
    assert check('  a:\n    parameters: {speed: 1.0}\n') == []
    heard = NODE + '    on_parameters: parts:decide\n'
    decide = run('return None', head='def decide(node, changes):')
    assert check(heard, run('node.publish("out", "x")') + decide) == []


def test_what_nodes_share_is_used_if_one_of_them_uses_it(check):
    before = 'x-shared: &shared {out: {type: std_msgs/msg/String, external: true}}\n'
    nodes = """
  a:
    publishers: *shared
    timers: {tick: {period: 1, publish: out, message: hello}}
  b:
    publishers: *shared
"""
    assert check(nodes, before=before) == []


@pytest.mark.parametrize(
    ('annotation', 'value', 'fits'),
    [
        ('int', '3', True),
        ('int', '3.5', False),
        ('int', 'three', False),
        ('float', '3', True),
        ('float', '"3"', False),
        ('str', 'null', True),
        ('bool', 'yes', False),
        ('int | None', 'three', False),
        ('Path', '3', True),
        ('list[int]', '3', False),
        ('list[int]', '[a]', False),
        ('dict[str, int]', '[3]', False),
    ],
)
def test_a_constant_argument_is_of_the_annotated_type(check, annotation, value, fits):
    nodes = f"""
  n:
    on_start: {{behaviour: parts:begin, with: {{value: {value}}}}}
"""
    code = f"""
        def begin(node, value: {annotation}): ...
    """
    assert check(nodes, code) == ([] if fits else [(4, 'bad-argument')])


@pytest.mark.parametrize(
    ('line', 'is_unused'),
    [
        ('print(node.parameters.speed)', True),
        ('print(node.state.laps)', False),
        ("print(hasattr(node.state, 'laps'))", False),
        ("for each in ('laps',): print(getattr(node.state, each))", False),
        ('import vendor; vendor.use(node)', False),
    ],
)
def test_state_that_no_behaviour_uses_is_found(check, line, is_unused):
    system = NODE.replace('    publishers', '    state: {laps: 0}\n    publishers')
    found = check(system, run(USES_ALL, line), rule='unused-state')
    assert bool(found) == is_unused


GIVEN = 'def __init__(self, node): self.kept = node\n    '
PROPERTY = '@property\n    def node(self): return self.kept\n'
WITHIN = 'with self.open() as n:\n            '


@pytest.mark.parametrize(
    ('code', 'node', 'before'),
    [
        (f'class C:\n    {GIVEN}{PROPERTY}', 'self.node', ''),
        (f'class M:\n    {PROPERTY}class C(M):\n    {GIVEN}', 'self.node', ''),
        (f'class C:\n    {GIVEN}{PROPERTY}', 'n', 'n = self.node; '),
        (f'class C:\n    {GIVEN}def __getattr__(self, name): return 1\n', 'self', ''),
        (
            f'class C:\n    {GIVEN}@contextmanager\n    def open(self): yield self.kept\n',
            'n',
            WITHIN,
        ),
        ('@dataclass\nclass C:\n    node: object\n', 'self.node', ''),
        ('N = 0\nclass C:\n    def __init__(self, node):\n        global N; N = node\n', 'N', ''),
        ('class C:\n    def __init__(self, n): C.c = self; self.n = n\n', 'C.c.n', ''),
        (f'class C:\n    {GIVEN}', 'copy(self).kept', ''),
        (f'class C:\n    {GIVEN}', 'self.kept', 'Thread(target=self.work).start()'),
        (f'class C:\n    {GIVEN}', 'self.kept', 'F(self.work)()'),
        (f'class C:\n    {GIVEN}', 'self.kept', 'vars(self)["work"]()'),
    ],
)
def test_what_is_done_through_a_node_that_nobody_can_follow_is_done(check, code, node, before):
    used = [
        f"{node}.state.heard = 1; {node}.own_state['x'] = 1; {node}.publish('out', 'a')",
        f"{node}.create_publisher('std_msgs/msg/String', 'extra', 10)",
        f'print({node}.parameters.speed)',
    ]
    lines = '; '.join(used)
    is_apart = before[-1:] == ')'
    code += f"""
    def run(self, node):
        {before or 'pass; '}{'' if is_apart else lines}
        print(node.state.heard, node.own_state['x'])
        node.publish('extra', 'b')

    def work(self):
        {lines if is_apart else 'pass'}

from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from threading import Thread
class F:
    def __init__(self, f): self.f = f
    def __call__(self): self.f()
"""
    assert check(NODE.replace('parts:run', 'parts:C.run'), code) == []


@pytest.mark.parametrize(
    ('line', 'use', 'is_found'),
    [
        ("entries = node.own_state; entries |= {'x': 1}", "node.own_state['x']", False),
        ('json.loads().node.own_state.update(x=1)', "node.own_state['x']", False),
        ("setattr(json.loads('').node.state, 'x', 1)", 'node.state.x', False),
        ("getattr(node, 'create_publisher')(MSG, 'x')", "node.publish('x', '')", False),
        (
            "json.loads('').node.create_publisher(MSG, '/a', name='x')",
            "node.publish('x', '')",
            False,
        ),
        ('json.loads().node.create_publisher(MSG, sys.argv[1])', "node.publish('x', '')", False),
        (
            "json.loads('').node.create_publisher(msg_type=MSG, topic='x')",
            "node.publish('x', '')",
            False,
        ),
        ("f = json.loads('').create_publisher; f(MSG, 'x')", "node.publish('x', '')", False),
        ("for k in 'xy': setattr(json.loads('').state, k, 1)", 'node.state.x', False),
        ("for k in 'xy': json.loads('').own_state[k] = 1", "node.own_state['x']", False),
        ("json.loads('').node.create_publisher(MSG, 'y')", "node.publish('x', '')", True),
        (
            "print(json.loads('').x, json.loads('').state.x, json.loads('').own_state['x'])",
            'node.state.x',
            True,
        ),
        (
            "print(json.loads('').x, json.loads('').state.x, json.loads('').own_state['x'])",
            "node.own_state['x']",
            True,
        ),
    ],
)
def test_of_what_may_be_made_only_that_name_is_known(check, line, use, is_found):
    code = "import json, sys\nMSG = 'std_msgs/msg/String'\n" + run(USES_ALL, line, use)
    assert bool(check(NODE, code)) == is_found


@pytest.mark.parametrize('line', ['Thread(target=self.work).start()', 'register(self.work)'])
def test_a_method_that_is_handed_on_is_read(check, line):
    code = f"""
from threading import Thread
from far import register
class C:
    {GIVEN}
    def run(self, node): {USES_ALL}; {line}
    def work(self): self.kept.publish('outt', '')
"""
    assert (8, 'unknown-publisher') in check(NODE.replace('parts:run', 'parts:C.run'), code)
