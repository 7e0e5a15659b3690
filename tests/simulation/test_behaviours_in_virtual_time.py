"""What behaviours do takes virtual time, as it would take real time."""

import time
from textwrap import dedent, indent

import pytest

pytestmark = pytest.mark.ros

START = 'import time\nimport threading\nimport asyncio\nimport rclpy\n'

# Each case: nodes, behaviours, and what they log, with the time.
CASES = {
    'timers of all clocks': (
        """
        n:
          timers:
            a: {period: 1.0, clock: steady, behaviour: "parts:f", with: {name: a}}
            b: {period: 1.0, clock: system, behaviour: "parts:f", with: {name: b}}
            c: {period: 1.0, behaviour: "parts:f", with: {name: c}}
        """,
        """
        def f(node, name: str):
            node.logger.info(name)
        """,
        [(1.0, 'a'), (1.0, 'b'), (1.0, 'c'), (2.0, 'a'), (2.0, 'b'), (2.0, 'c')],
    ),
    'a generator': (
        'n: {timers: {t: {period: 0.5, behaviour: "parts:f"}}}',
        """
        def f(node):
            for each in 'ab':
                node.logger.info(each)
                yield
        """,
        [(0.5, 'a'), (1.0, 'b')],
    ),
    'clocks': (
        'n: {on_start: "parts:f"}',
        """
        def f(node):
            first = time.monotonic(), time.time_ns(), node.now().nanoseconds
            clocks = [rclpy.clock.Clock(clock_type=each) for each in (
                rclpy.clock.ClockType.STEADY_TIME,
                rclpy.clock.ClockType.SYSTEM_TIME,
                rclpy.clock.ClockType.ROS_TIME,
            )]
            before = [each.now() for each in clocks]
            time.sleep(0.25)
            passed = [(b.now() - a).nanoseconds for a, b in zip(before, clocks)]
            # Each look at a clock takes a nanosecond.
            node.logger.info(str([time.monotonic() - first[0], *(round(each, -3) for each in (
                time.time_ns() - first[1], node.now().nanoseconds - first[2], *passed,
            ))]))
            clocks[0].sleep_for(rclpy.duration.Duration(seconds=0.25))
            clocks[1].sleep_until(clocks[1].now() + rclpy.duration.Duration(seconds=0.25))
            node.ros.get_clock().sleep_for(rclpy.duration.Duration(seconds=0.25))
            node.logger.info('slept')
        """,
        [(0.25, '[0.25, 250000000, 250000000, 250000000, 250000000, 250000000]'), (1.0, 'slept')],
    ),
    'rates': (
        'n: {on_start: "parts:f"}',
        """
        def f(node):
            rate = node.ros.create_rate(2)
            for each in 'ab':
                rate.sleep()
                node.logger.info(each)
            node.ros.destroy_rate(rate)
        """,
        [(0.5, 'a'), (1.0, 'b')],
    ),
    'coroutines': (
        """
        n:
          timers: {t: {period: 1.0, behaviour: "parts:f"}}
          service_clients: {/s: {type: std_srvs/srv/Trigger}}
        m: {services: {/s: {type: std_srvs/srv/Trigger, behaviour: "parts:g"}}}
        """,
        """
        async def f(node):
            answer = await node.call_async('/s')
            node.logger.info(answer.message)

        def g(node, request):
            time.sleep(0.5)
            return {'success': True, 'message': 'hello'}
        """,
        [(1.5, 'hello')],
    ),
    'asyncio in a thread': (
        'n: {on_start: "parts:f"}',
        """
        async def wait():
            await asyncio.gather(asyncio.sleep(0.5), asyncio.to_thread(time.sleep, 1))

        def f(node):
            asyncio.run(wait())
            node.logger.info('f')
        """,
        [(1.0, 'f')],
    ),
    'calls and time-outs': (
        """
        n:
          timers: {t: {period: 1.0, behaviour: "parts:f"}}
          service_clients: {/s: std_srvs/srv/Trigger, /none: {type: std_srvs/srv/Trigger, external: true}}
        m: {services: {/s: {type: std_srvs/srv/Trigger, behaviour: "parts:g"}}}
        """,
        """
        def f(node):
            for name, timeout in (('/s', 5.0), ('/s', 0.25), ('/none', 0.25)):
                try:
                    node.logger.info(node.call(name, timeout=timeout).message)
                except Exception as error:
                    node.logger.info(type(error).__name__)

        def g(node, request):
            time.sleep(0.5)
            return {'success': True, 'message': 'hello'}
        """,
        [(1.5, 'hello'), (1.75, 'CallTimeoutError'), (2.0, 'ServiceNotAvailableError')],
    ),
    'an error': (
        'n: {on_error: log, timers: {t: {period: 0.5, behaviour: "parts:f"}}}',
        """
        def f(node):
            if node.now().nanoseconds % 10**9:
                raise ValueError
            node.logger.info('f')
        """,
        [(1.0, 'f'), (2.0, 'f')],
    ),
    'a restart': (
        'n: {on_error: restart, on_start: "parts:begin", timers: {t: {period: 0.5, behaviour: "parts:f"}}}',
        """
        def begin(node):
            node.logger.info('begin')

        def f(node):
            if node.now().nanoseconds < 1577836801 * 10**9:
                raise ValueError
        """,
        [(0.0, 'begin'), (0.6, 'begin')],
    ),
    'plain entities of rclpy': (
        'n: {on_start: "parts:begin"}',
        """
        from std_msgs.msg import String
        from std_srvs.srv import Trigger

        def begin(node):
            ros, log = node.ros, node.logger.info
            publisher = ros.create_publisher(String, '/plain', 5)
            ros.create_subscription(String, '/plain', lambda message: log(message.data), 5)
            client = ros.create_client(Trigger, '/ask')

            def answer(request, response):
                response.message = 'asked'
                return response

            ros.create_service(Trigger, '/ask', answer)

            def tick():
                publisher.publish(String(data='x'))
                future = client.call_async(Trigger.Request())
                future.add_done_callback(lambda done: log(done.result().message))

            ros.create_timer(1.0, tick)
        """,
        [(1.0, 'x'), (1.0, 'asked'), (2.0, 'x'), (2.0, 'asked')],
    ),
    'threads of a behaviour': (
        'n: {on_start: "parts:begin", on_stop: "parts:end"}',
        """
        def begin(node):
            node.state.ended = threading.Event()
            def run():
                while not node.state.ended.wait(0.75):
                    node.logger.info('run')
            threading.Thread(target=run).start()

        def end(node):
            node.state.ended.set()
        """,
        [(0.75, 'run'), (1.5, 'run')],
    ),
    'a busy loop': (
        'n: {timers: {t: {period: 1.0, behaviour: "parts:f"}}}',
        """
        def f(node):
            end = time.monotonic() + 0.5
            while time.monotonic() < end:
                pass
            end = node.now() + rclpy.duration.Duration(seconds=0.25)
            while node.now() < end:
                pass
            node.logger.info('f')
        """,
        [(1.75, 'f')],
    ),
    'plain executors of a behaviour': (
        'n: {on_start: "parts:begin"}',
        """
        from rclpy.executors import SingleThreadedExecutor

        def begin(node):
            context = node.ros.context
            other = rclpy.create_node('other', context=context)
            executor = SingleThreadedExecutor(context=context)
            executor.add_node(other)
            other.create_timer(0.5, lambda: node.logger.info('tick'))
            executor.spin_once(timeout_sec=0.25)
            node.logger.info('once')
            executor.spin_until_future_complete(rclpy.task.Future(), timeout_sec=1.0)
            node.logger.info('twice')
            executor.shutdown()
            other.destroy_node()
        """,
        [(0.25, 'once'), (0.5, 'tick'), (1.0, 'tick'), (1.25, 'twice')],
    ),
    'one callback after the other': (
        """
        n:
          timers:
            a: {period: 1.0, behaviour: "parts:f", with: {pause: 0.5}}
            b: {period: 1.0, behaviour: "parts:f", with: {pause: 0.25}}
        """,
        """
        def f(node, pause: float):
            node.logger.info(f'begin {pause}')
            time.sleep(pause)
            node.logger.info(f'end {pause}')
        """,
        [
            (1.0, 'begin 0.5'), (1.5, 'end 0.5'), (1.5, 'begin 0.25'), (1.75, 'end 0.25'),
            (2.0, 'begin 0.5'),
        ],
    ),
    'a late subscription': (
        """
        n: {publishers: {/kept: {type: std_msgs/msg/String, qos: {durability: transient_local, depth: 2}}}, on_start: "parts:begin"}
        m: {delay: 1.0, subscriptions: {/kept: {type: std_msgs/msg/String, qos: {durability: transient_local, depth: 2}, behaviour: "parts:hear"}}}
        """,
        """
        def begin(node):
            for each in 'abc':
                node.publish('/kept', each)

        def hear(node, message):
            node.logger.info(message.data)
        """,
        [(1.0, 'b'), (1.0, 'c')],
    ),
    'a full queue': (
        """
        n: {publishers: {/all: {type: std_msgs/msg/String, qos: {history: keep_all}}, /last: {type: std_msgs/msg/String, qos: {depth: 2}}}, timers: {t: {period: 2.0, behaviour: "parts:f"}}}
        m: {subscriptions: {/all: {type: std_msgs/msg/String, qos: {history: keep_all}, behaviour: "parts:hear"}, /last: {type: std_msgs/msg/String, qos: {depth: 2}, behaviour: "parts:hear"}}}
        """,
        """
        def f(node):
            for each in 'abc':
                node.publish('/all', each)
                node.publish('/last', each.upper())

        def hear(node, message):
            node.logger.info(message.data)
        """,
        [(2.0, 'a'), (2.0, 'B'), (2.0, 'b'), (2.0, 'C'), (2.0, 'c')],
    ),
    'parameters': (
        """
        n: {parameters: {speed: 1.0}, on_parameters: "parts:check", after_parameters_set: "parts:follow"}
        m: {timers: {t: {period: 1.0, behaviour: "parts:f"}}}
        """,
        """
        def check(node, changes):
            return 'too fast' if changes['speed'] > 2 else None

        def follow(node, changes):
            node.logger.info(str(changes))

        def f(node):
            try:
                node.set_parameters('/n', {'speed': node.now().nanoseconds / 10**9 - 1577836799})
            except Exception as error:
                node.logger.info(type(error).__name__)
        """,
        [(1.0, "{'speed': 2.0}"), (2.0, 'ParametersRefusedError')],
    ),
}  # fmt: skip


@pytest.mark.parametrize('name', CASES)
def test_behaviours_take_virtual_time(simulate, name):
    nodes, code, expected = CASES[name]
    begun = time.monotonic()
    with simulate(f'nodes:\n{indent(dedent(nodes), "  ")}', START + dedent(code)) as system:
        system.forward(2.0)
        events = list(system.events)
    logged = [
        (event.time_ns / 1e9, event.value)
        for event in events
        if event.kind == 'log' and event.name == 'info' and not event.value.startswith('Waiting')
    ]
    assert logged == expected
    assert system.notices == [] or 'thread' in name
    assert time.monotonic() - begun < 20


def test_a_behaviour_that_waits_to_the_end_says_so(simulate):
    system = simulate(
        'nodes: {n: {timers: {tick: {period: 1.0, behaviour: "parts:tick"}}}}',
        """
        import threading

        LOCK = threading.Lock()

        def tick(node):
            with LOCK, LOCK:
                pass
        """,
    )
    with system:
        system.forward(1.5)
    (error,) = [event for event in system.events if event.kind == 'error']
    assert 'it still waited here when the system ended' in str(error)
    assert 'with LOCK, LOCK:' in str(error)
    assert 'node.shutdown()' not in str(error)
