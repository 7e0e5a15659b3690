"""Who meets whom: no alarm where ROS connects them, one where it cannot."""

import pytest

from composer.checks.connections import topology

TALK = 'timers: {a: {period: 1, publish: out, message: hello}}'
HEAR = 'behaviour: parts:hear'
CODE = """
    def hear(node, message): ...
    def serve(node, request): ...
    def ask(node):
        node.call('ask', {})
    def do(node, goal): ...
    def send(node):
        node.send_goal('do', {})
"""


def meeting(talker, listener):
    return f"""
  talker:
    {talker}
    publishers: {{out: {{type: std_msgs/msg/String, topic: chatter}}}}
    {TALK}
  listener:
    {listener}
    subscriptions: {{in: {{type: std_msgs/msg/String, topic: heard, {HEAR}}}}}
"""


@pytest.mark.parametrize(
    ('talker', 'listener'),
    [
        ('', 'remap: {heard: chatter}'),
        ('namespace: /a', 'remap: {heard: /a/chatter}'),
        ('namespace: /a', 'namespace: a\n    remap: {heard: chatter}'),
        ('remap: {chatter: heard}', ''),
        ('remap: {rostopic://chatter: heard, chatter: nothing}', ''),
        ('remap: {chatter: ~/heard}', 'remap: {heard: /talker/heard}'),
    ],
)
def test_names_meet_as_ros_resolves_them(check, talker, listener):
    assert check(meeting(talker, listener), CODE) == []


@pytest.mark.parametrize(
    ('talker', 'listener'),
    [
        ('', ''),
        ('namespace: /a', 'remap: {heard: chatter}'),
        ('remap: {rosservice://chatter: heard}', ''),
        ('remap: {chatter: nothing, /chatter: heard}', ''),
    ],
)
def test_names_that_do_not_meet_are_warned_of_at_both_ends(check, talker, listener):
    found = [rule for _, rule in check(meeting(talker, listener), CODE)]
    assert found == ['no-subscription', 'no-publisher']


@pytest.mark.parametrize('remaps', [False, True])
def test_actions_are_remapped_by_newer_versions_of_ros(check, monkeypatch, remaps):
    monkeypatch.setattr(topology, 'remaps_actions', lambda: remaps)
    nodes = """
  server:
    remap: {do: done}
    actions: {do: {type: test_msgs/action/Fibonacci, behaviour: parts:do}}
  client:
    action_clients: {do: {type: test_msgs/action/Fibonacci, action: DO}}
    on_start: parts:send
"""
    right, wrong = ('done', 'do') if remaps else ('do', 'done')
    assert check(nodes.replace('DO', right), CODE, rule='no-server', installed=False) == []
    assert len(check(nodes.replace('DO', wrong), CODE, rule='no-server', installed=False)) == 1


def test_what_ros_itself_serves_needs_no_other_end(check):
    nodes = """
  a:
    publishers:
      out: {type: diagnostic_msgs/msg/DiagnosticArray, topic: /diagnostics}
    subscriptions:
      clock: {type: rosgraph_msgs/msg/Clock, topic: /clock, behaviour: parts:hear}
      log: {type: rcl_interfaces/msg/Log, topic: /rosout, behaviour: parts:hear}
      status: {type: action_msgs/msg/GoalStatusArray, topic: do/_action/status, behaviour: parts:hear}
    service_clients:
      ask: {type: rcl_interfaces/srv/GetParameters, service: /b/get_parameters}
    timers:
      a: {period: 1, publish: out, message: {}}
      b: {period: 1, behaviour: parts:ask}
  b: {}
"""
    assert check(nodes, CODE, installed=False) == []
    elsewhere = nodes.replace('/b/get', '/c/get')
    assert check(elsewhere, CODE, installed=False) == [(11, 'no-server')]
    without = nodes.replace('b: {}', 'b: {parameter_services: false}')
    assert check(without, CODE, installed=False) == [(11, 'no-server')]
    change = nodes.replace('get_parameters', 'change_state')
    change = change.replace('rcl_interfaces/srv/GetParameters', 'lifecycle_msgs/srv/ChangeState')
    assert check(change, CODE, installed=False) == [(11, 'no-server')]
    managed = change.replace('b: {}', 'b: {lifecycle: true}')
    assert check(managed, CODE, installed=False) == []


@pytest.mark.parametrize(
    ('section', 'name', 'right'),
    [
        ('publishers', '/rosout', 'rcl_interfaces/msg/Log'),
        ('publishers', '/parameter_events', 'rcl_interfaces/msg/ParameterEvent'),
        ('subscriptions', '/elsewhere/_action/status', 'action_msgs/msg/GoalStatusArray'),
        ('subscriptions', '/act/_action/feedback', None),
        ('service_clients', '/act/_action/cancel_goal', 'action_msgs/srv/CancelGoal'),
        ('service_clients', '~/get_parameters', 'rcl_interfaces/srv/GetParameters'),
        ('service_clients', '/c/change_state', 'lifecycle_msgs/srv/ChangeState'),
    ],
)
def test_what_ros_has_itself_has_the_types_of_ros(check, section, name, right):
    folder = 'srv' if section == 'service_clients' else 'msg'
    key = 'service' if section == 'service_clients' else 'topic'
    more = ', behaviour: parts:hear' if section == 'subscriptions' else ''
    nodes = f"""
  a:
    {section}:
      it: {{type: TYPE, {key}: {name}, external: true{more}}}
    on_start: parts:use
  b: {{actions: {{/act: {{type: test_msgs/action/Fibonacci, behaviour: parts:do}}}}}}
  c: {{parameter_services: false, logger_services: true, lifecycle: true}}
"""
    code = (
        CODE
        + """
    def use(node):
        node.publish('it', {})
        node.call('it', {})
    """
    )
    rule = 'conflicting-types'
    found = check(nodes.replace('TYPE', f'std/{folder}/Wrong'), code, rule=rule, installed=False)
    assert len(found) == (right is None or not right.startswith('any/'))
    if right:
        text = nodes.replace('TYPE', right)
        assert check(text, code, rule=rule, installed=False) == []


DEADLINE = """
  a:
    publishers: {out: {type: std_msgs/msg/String, qos: {deadline: 0.5}, external: true}}
    timers:
      one: {period: 1, publish: out, message: hello}
"""


@pytest.mark.parametrize(
    ('old', 'new'),
    [
        ('deadline: 0.5', 'deadline: 1.5'),
        ('deadline: 0.5', 'deadline: infinite'),
        ('period: 1', 'rate: 2'),
        ('period: 1', 'period: "{{ period }}"'),
        ('period: 1', 'clock: ros, period: 1'),
        ('timers:', 'timers:\n      two: {period: 0.8, publish: out, message: hello}'),
        ('timers:', 'on_start: parts:reach\n    timers:'),
        ('timers:', 'on_start: {behaviour: parts:choose, with: {name: out}}\n    timers:'),
        (
            'timers:',
            'subscriptions: {in: {type: std_msgs/msg/String, external: true, publish: out}}\n'
            '    timers:',
        ),
    ],
)
def test_a_deadline_is_kept_where_something_may_publish_in_time(check, old, new):
    code = """
        def publish(node):
            node.publish('out', 'x')
        def reach(node):
            use(node.ros)
        def choose(node, name):
            node.publish(name, 'x')
    """
    before = 'args: {period: {type: double}}\n'
    nodes = DEADLINE.replace('a:\n', 'a:\n    use_sim_time: true\n')
    text = nodes.replace('one: {', 'one: {clock: steady, ') if 'clock' not in new else nodes
    rule = 'missed-deadline'
    assert len(check(text.replace('clock: ros, ', ''), code, before=before, rule=rule)) == (
        'clock' not in new
    )
    assert check(text.replace(old, new), code, before=before, rule=rule) == []


@pytest.mark.parametrize(
    ('args', 'nodes', 'is_left'),
    [
        ('{on: false}', '  a: {when: "{{ on }}"}\n  b: {when: false}', False),
        ('{on: true}', '  a: {when: "{{ on }}"}\n  b: {when: false}', True),
        ('{on: false}', '  a: {when: "{{ on }}"}\nprocesses: {p: {command: [sh]}}', True),
        ('{on: false}', '  a: {when: "{{ on }}"}\n  b: {whne: true}', True),
        ('{on: false}', '  a: {foreach: {i: []}}', True),
    ],
)
def test_something_is_left_to_run(check, args, nodes, is_left):
    found = check(f'{nodes}\n', before=f'args: {args}\n', rule='nothing-to-run')
    assert len(found) == (not is_left)


def test_the_other_end_may_be_external(check):
    nodes = """
  a:
    publishers: {out: {type: std_msgs/msg/String, external: true}}
    subscriptions: {in: {type: std_msgs/msg/String, external: true, behaviour: parts:hear}}
    service_clients: {ask: {type: std_srvs/srv/Empty, external: true}}
    action_clients: {do: {type: test_msgs/action/Fibonacci, external: true}}
    timers:
      a: {period: 1, publish: out, message: hello}
      b: {period: 1, behaviour: parts:ask}
      c: {period: 1, behaviour: parts:send}
"""
    assert check(nodes, CODE, installed=False) == []
    alone = check(nodes.replace('external: true', 'external: false'), CODE, installed=False)
    assert alone == [
        (4, 'no-subscription'),
        (5, 'no-publisher'),
        (6, 'no-server'),
        (7, 'no-server'),
    ]


def test_the_odd_one_out_has_the_wrong_type(check):
    nodes = """
  a:
    publishers: {out: {type: std_msgs/msg/Int32, topic: chatter}}
    timers: {a: {period: 1, publish: out, message: 1}}
  b:
    subscriptions:
      one: {type: std_msgs/msg/String, topic: chatter, behaviour: parts:hear}
      two: {type: std_msgs/msg/String, topic: chatter, behaviour: parts:hear}
"""
    assert check(nodes, CODE, rule='conflicting-types') == [
        "topic '/chatter' has two types: here std_msgs/msg/Int32, elsewhere std_msgs/msg/String"
    ]


def test_one_finding_stands_for_all_ends_of_the_same_qos(check):
    names = [f's{index}' for index in range(5)]
    inputs = '\n'.join(
        f'      {name}: {{type: std_msgs/msg/String, topic: out, behaviour: parts:hear}}'
        for name in names
    )
    nodes = f"""
  a:
    publishers: {{out: {{type: std_msgs/msg/String, qos: sensor_data}}}}
    {TALK}
  b:
    subscriptions:
{inputs}
"""
    assert check(nodes, CODE) == [(4, 'incompatible-qos')]


@pytest.mark.parametrize(
    ('served', 'used'), [('reliable', 'best_effort'), ('best_effort', 'reliable')]
)
def test_requests_have_to_reach_the_server_and_responses_the_client(check, served, used):
    nodes = f"""
  a:
    services:
      ask: {{type: std_srvs/srv/Empty, qos: {{reliability: {served}}}, behaviour: parts:serve}}
  b:
    service_clients: {{ask: {{type: std_srvs/srv/Empty, qos: {{reliability: {used}}}}}}}
    on_start: parts:ask
"""
    assert check(nodes, CODE) == [(7, 'incompatible-qos')]
    assert check(nodes.replace(served, used), CODE) == []


LOOP = """
  a:
    publishers: {out: {type: std_msgs/msg/Int32, topic: chatter}}
    subscriptions:
      in: {type: std_msgs/msg/Int32, topic: chatter, behaviour: parts:hear, publish: out}
"""


@pytest.mark.parametrize(
    ('body', 'is_loop'),
    [
        ('return message', True),
        ('return {"data": 1}', True),
        ('return 1 if message.data else None', False),
        ('if message.data: return 1', False),
        ('if message.data:\n    return 1\nelse:\n    return -message.data', True),
        ('pass', False),
        ('return find(message)', False),
        ('return 1\nyield', False),
    ],
)
def test_a_loop_goes_on_for_ever_if_every_message_is_answered(check, body, is_loop):
    lines = '\n'.join(f'    {line}' for line in body.splitlines())
    found = check(LOOP, f'def hear(node, message):\n{lines}\n', rule='message-loop')
    assert bool(found) == is_loop


def test_a_chain_of_relays_is_no_loop(check):
    nodes = """
  a:
    publishers: {b: std_msgs/msg/String, c: {type: std_msgs/msg/String, external: true}}
    subscriptions:
      a: {type: std_msgs/msg/String, external: true, publish: b}
      b: {type: std_msgs/msg/String, publish: c}
"""
    assert check(nodes) == []
