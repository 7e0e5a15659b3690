"""Waits that never end, and waits that only look like it."""

import pytest

CODE = """
    import threading

    def set_it(node, request):
        return {'success': True}

    def relay(node, request):
        return node.call('set_it', request)

    async def relay_later(node, request):
        return await node.call_async('set_it', request)

    def ask(node):
        node.call('set_it')

    def ask_through(node):
        ask(node)

    async def ask_later(node):
        await node.call_async('set_it')

    def forget(node):
        ask_later(node)

    def ask_beside(node):
        threading.Thread(target=lambda: node.call('set_it')).start()

    def ask_if(node, asks):
        if asks:
            node.call('set_it')

    def do(node, goal):
        node.call('set_it')
"""
ALONE = """
  a:
    service_clients: {set_it: std_srvs/srv/SetBool}
    services: {set_it: {type: std_srvs/srv/SetBool, behaviour: parts:set_it}}
"""


def deadlocks(check, nodes):
    return [line for line, rule in check(nodes, CODE) if rule == 'service-deadlock']


@pytest.mark.parametrize('behaviour', ['ask', 'ask_through', 'ask_later'])
def test_a_timer_that_waits_for_its_own_group_never_gets_an_answer(check, behaviour):
    timer = f'    timers: {{tick: {{period: 1, behaviour: parts:{behaviour}}}}}\n'
    assert deadlocks(check, ALONE + timer) == [6]


@pytest.mark.parametrize(
    'rest',
    [
        '    timers: {tick: {period: 1, behaviour: parts:ask, group: reentrant}}\n',
        '    timers: {tick: {period: 1, behaviour: parts:ask, group: other}}\n',
        '    timers: {tick: {period: 1, behaviour: parts:ask_beside}}\n',
        '    timers: {tick: {period: 1, behaviour: parts:forget}}\n',
        '    timers: {tick: {period: 1, behaviour: parts:ask_if, with: {asks: false}}}\n',
        '    actions: {do: {type: test_msgs/action/Fibonacci, behaviour: parts:do}}\n',
    ],
)
def test_who_keeps_no_group_of_the_service_may_wait(check, rest):
    assert deadlocks(check, ALONE + rest) == []


def test_a_service_in_a_group_of_its_own_answers(check):
    timer = '    timers: {tick: {period: 1, behaviour: parts:ask}}\n'
    for group in ('reentrant', 'other'):
        nodes = ALONE.replace('parts:set_it', f'parts:set_it, group: {group}') + timer
        assert deadlocks(check, nodes) == []
    both = ALONE.replace('parts:set_it', 'parts:set_it, group: reentrant')
    both += timer.replace('parts:ask', 'parts:ask, group: reentrant')
    assert deadlocks(check, both) == []
    same = timer.replace('parts:ask', 'parts:ask, group: other')
    assert deadlocks(check, nodes.replace(timer, same)) == [6]


@pytest.mark.parametrize(
    'body',
    [
        "if node.state.count > 3: node.call('set_it')",
        "if not node.own_state.get('seen'): return\n            node.call('set_it')",
        "try: float(node.name)\n            except ValueError: node.call('set_it')",
        "try: node.call('set_it')\n            except Exception: node.logger.warning('late')",
    ],
)
def test_a_wait_on_a_condition_of_the_running_system_never_gets_an_answer(check, body):
    code = f"""
        def set_it(node, request): ...

        def tick(node):
            {body}
            node.state.count += 1

        def use(node, request):
            node.call('too')
            node.call('set_it')
    """
    more = ALONE.replace(
        '{set_it: std', '{too: {type: std_srvs/srv/SetBool, service: set_it}, set_it: std'
    )
    timer = '    timers: {tick: {period: 1, behaviour: parts:tick}}\n    state: {count: 0}\n'
    assert check(more + timer, code, installed=False)[-1:] == [(6, 'service-deadlock')]


ACTION = """
  a:
    action_clients: {count: test_msgs/action/Fibonacci}
    actions: {count: {type: test_msgs/action/Fibonacci, behaviour: parts:do}}
"""
GOALS = """
    def do(node, goal):
        return node.send_goal('count', goal).result()

    def do_later(node, goal):
        node.send_goal('count', goal)

    def take(node, goal):
        node.send_goal('count', goal)

    def send(node):
        node.send_goal('count', 1)

    def wait(node):
        node.send_goal('count', 1).result()

    def answer(node, request): ...

    def ask(node, goal):
        node.call('answer')
"""


@pytest.mark.ros
@pytest.mark.parametrize(
    ('server', 'message'),
    [
        ('behaviour: parts:do', None),
        ('behaviour: parts:do, concurrency: queue', 'the end of a goal of action'),
        ('behaviour: parts:do_later, concurrency: queue', None),
        ('behaviour: parts:do, accept: parts:take', "action 'count' (accept)"),
    ],
)
def test_a_goal_may_not_wait_for_what_waits_for_it(check, server, message):
    nodes = ACTION.replace('behaviour: parts:do', server)
    found = check(nodes, GOALS, rule='service-deadlock')
    assert len(found) == (message is not None)
    assert not message or message in found[0]


def ring(*names, behaviour='relay', groups=None):
    """Return nodes each of which asks the next to answer."""
    nodes = ''
    for name, following in zip(names, [*names[1:], names[0]], strict=True):
        group = f', group: {groups[name]}' if groups and name in groups else ''
        nodes += f"""
  {name}:
    service_clients: {{set_it: {{type: std_srvs/srv/SetBool, service: {following}/set_it}}}}
    services: {{~/set_it: {{type: std_srvs/srv/SetBool, behaviour: parts:{behaviour}{group}}}}}
"""
    return nodes


@pytest.mark.parametrize('behaviour', ['relay', 'relay_later'])
def test_a_ring_of_services_is_found_once(check, behaviour):
    nodes = ring('a', 'b', 'c', behaviour=behaviour)
    assert deadlocks(check, nodes) == [5]
    (message,) = check(nodes, CODE, rule='service-deadlock')
    assert message.endswith("none can continue: '/b/set_it' → '/c/set_it' → '/a/set_it'")


@pytest.mark.parametrize(
    ('hook', 'lines'), [('on_start', [6]), ('on_stop', [6]), ('on_parameters', [])]
)
def test_a_node_answers_between_its_start_and_its_stop(check, hook, lines):
    assert deadlocks(check, f'{ALONE}    {hook}: parts:ask\n') == lines


def test_on_start_may_ask_nodes_that_have_started(check):
    client = """
  client:
    service_clients: {set_it: std_srvs/srv/SetBool}
    on_start: parts:ask
"""
    server = """
  server:
    services: {set_it: {type: std_srvs/srv/SetBool, behaviour: parts:set_it}}
"""
    starting = server + '    on_start: parts:ask_if\n'
    assert deadlocks(check, server + client) == []
    assert deadlocks(check, client + server) == []
    assert deadlocks(check, starting + client) == []
    assert deadlocks(check, client + starting) == [5]


@pytest.mark.parametrize(
    ('client', 'server', 'is_deadlock'),
    [
        ('', 'wait_for: {node: client}', True),
        ('', 'wait_for: {topic: elsewhere}', True),
        ('wait_for: {node: server}', 'on_start: parts:ask_if', False),
        ('wait_for: {topic: elsewhere}', 'on_start: parts:ask_if', False),
        ('wait_for: {topic: elsewhere}', 'wait_for: {topic: elsewhere}', False),
        ('wait_for: {topic: elsewhere}', 'wait_for: {node: client}', True),
    ],
)
def test_nodes_with_wait_for_start_after_all_others(check, client, server, is_deadlock):
    nodes = f"""
  client:
    service_clients: {{set_it: std_srvs/srv/SetBool}}
    on_start: parts:ask
    {client}
  server:
    services: {{set_it: {{type: std_srvs/srv/SetBool, behaviour: parts:set_it}}}}
    {server}
"""
    assert bool(deadlocks(check, nodes)) == is_deadlock


@pytest.mark.ros
def test_what_is_refused_does_time_out_when_it_runs(compose):
    silenced = '  # composer: ignore[service-deadlock]\n'
    run = compose(
        f'version: 1\nnodes:{ALONE}'
        f'    timers: {{tick: {{period: 0.1, behaviour: parts:try_it}}}}{silenced}',
        """
        from composer import CallError

        def set_it(node, request):
            return {'success': True}

        def try_it(node):
            yield
            try:
                node.call('set_it', timeout=2.0)
                node.logger.info(f'{node.name}: answered')
            except CallError as error:
                node.logger.info(f'{node.name}: {type(error).__name__}')
        """,
    )
    run.wait_for_line('a: CallTimeoutError')
    assert run.stop() == 0
