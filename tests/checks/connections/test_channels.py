"""Who meets whom: no alarm where ROS connects them, one where it cannot."""

import pytest

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


def test_actions_are_not_remapped_by_name(check):
    nodes = """
  server:
    remap: {do: done}
    actions: {do: {type: test_msgs/action/Fibonacci, behaviour: parts:do}}
  client:
    action_clients: {do: test_msgs/action/Fibonacci}
    on_start: parts:send
"""
    assert check(nodes, CODE, installed=False) == [(4, 'bad-remap')]


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


def test_a_name_that_the_command_line_decides_meets_anything(check):
    before = 'args: {topic: {type: string}}\n'
    nodes = meeting('', '').replace('topic: heard', 'topic: "{{ topic }}"')
    assert check(nodes, CODE, before=before) == []


def test_a_name_with_a_finding_meets_anything(check):
    nodes = meeting('', '').replace('topic: heard', 'topic: 3')
    assert [rule for _, rule in check(nodes, CODE)] == ['wrong-type']
    nodes = meeting('', '').replace('publishers: {', 'publishers: 3 # {')
    assert 'no-publisher' not in [rule for _, rule in check(nodes, CODE)]
    nodes = meeting('', '').replace('publishers:', 'senders:')
    assert 'no-publisher' not in [rule for _, rule in check(nodes, CODE)]


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


def test_a_type_that_is_not_known_yet_is_no_conflict(check):
    nodes = meeting('', 'remap: {heard: chatter}')
    for wrong in ('type: String', 'type: "{{ kind }}"'):
        before = 'args: {kind: {type: string}}\n'
        found = check(nodes.replace('type: std_msgs/msg/String', wrong, 1), CODE, before=before)
        assert 'conflicting-types' not in [rule for _, rule in found]


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


def test_qos_that_is_not_known_is_compatible(check):
    nodes = meeting('', 'remap: {heard: chatter}')
    for qos in ('no_profile', '{reliability: besteffort}'):
        text = nodes.replace('topic: chatter', f'topic: chatter, qos: {qos}')
        assert 'incompatible-qos' not in [rule for _, rule in check(text, CODE)]
    text = nodes.replace('topic: chatter', 'topic: chatter, qos: {reliability: "{{ how }}"}')
    assert check(text, CODE, before='args: {how: {type: string}}\n') == []


def test_qos_that_the_command_line_decides_is_compatible(check):
    nodes = meeting('', 'remap: {heard: chatter}')
    nodes = nodes.replace('topic: chatter', 'topic: chatter, qos: {deadline: "{{ limit }}"}')
    nodes = nodes.replace('topic: heard', 'topic: heard, qos: {deadline: 0.001}')
    assert check(nodes, CODE, before='args: {limit: {type: double}}\n') == []


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
        ('return message.data + 1', True),
        ('return {"data": 1}', True),
        ('return Int32(data=1)', True),
        ('return 1 if message.data else None', False),
        ('if message.data: return 1', False),
        ('if message.data:\n    return 1\nelse:\n    return -message.data', True),
        ('return', False),
        ('pass', False),
        ('message = find(); return message', False),
        ('return find(message)', False),
        ('raise ValueError', False),
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


def test_a_name_is_measured_in_full_where_a_rule_leads_to(check):
    long = 'b' * 240
    nodes = f"""
  a:
    namespace: /robot_one
    remap: {{chatter: {long}}}
"""
    (message,) = check(nodes, rule='bad-name')
    assert message.endswith('and a topic name has at most 247 characters')


@pytest.mark.parametrize(('length', 'is_right'), [(226, True), (227, False)])
def test_an_action_leaves_room_for_the_names_of_its_parts(check, length, is_right):
    name = 'a' * length
    nodes = f"""
  a:
    actions: {{{name}: {{type: test_msgs/action/Fibonacci, behaviour: parts:do}}}}
"""
    assert (check(nodes, CODE, rule='bad-name') == []) == is_right
