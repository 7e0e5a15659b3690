"""One error in an idiom of Python is found in its line; the idiom without it has no finding."""

import re
from textwrap import dedent

import pytest

SYSTEM = """
  rover:
    parameters: {speed: 1.0, mode: slow}
    state: {distance: 0.0, goal: null}
    publishers:
      command: {type: geometry_msgs/msg/Twist, external: true}
      level: {type: std_msgs/msg/UInt8, external: true}
    timers: {use: {period: 1.0, behaviour: parts:use}}
    subscriptions:
      odom: {type: nav_msgs/msg/Odometry, external: true, behaviour: parts:hear}
    service_clients: {enable: {type: std_srvs/srv/SetBool, external: true}}
    action_clients: {count: {type: test_msgs/action/Fibonacci, external: true}}
"""
USE_ALL = """

def use(node):
    node.publish('command', {})
    node.publish('level', 1)
    node.call('enable', True)
    node.send_goal('count', 3)
    node.state.distance = node.parameters.speed if node.parameters.mode else 0.0
"""
# What is wrong, and what is right in its place: <wrong|right>.
PLANTED = {
    'a method of a base': """
        class Base:
            def __init__(self, node):
                self.node = node
            def send(self):
                self.node.publish('<comand|command>', {})
        class Sub(Base):
            def send(self):
                super().send()
        def hear(node, m):
            Sub(node).send()
        """,
    'the name that a subclass gives its base': """
        class Base:
            def __init__(self, node, name):
                self.node, self.name = node, name
            def send(self):
                self.node.publish(self.name, {})
        class Sub(Base):
            def __init__(self, node):
                super().__init__(node, '<comand|command>')
        def hear(node, m):
            Sub(node).send()
        """,
    'an attribute of a class that a subclass overrides': """
        class Base:
            topic = 'level'
            def send(self, node, payload):
                node.publish(self.topic, payload)
        class Sub(Base):
            topic = '<comand|command>'
        def hear(node, m):
            Base().send(node, 1)
            Sub().send(node, {})
        """,
    'a mixin': """
        class Sending:
            def send(self):
                self.node.publish(self.topic, {})
        class Holding:
            def __init__(self, node):
                self.node = node
        class Talker(Sending, Holding):
            topic = '<comand|command>'
        def hear(node, m):
            Talker(node).send()
        """,
    'a method that a base calls': """
        from abc import ABC, abstractmethod
        class Step(ABC):
            def go(self, node):
                node.publish('command', self.payload())
            @abstractmethod
            def payload(self):
                ...
        class Turn(Step):
            def payload(self):
                return {'<angulr|angular>': {'z': 1.0}}
        def hear(node, m):
            Turn().go(node)
        """,
    'the payload of a base, changed': """
        class Base:
            def payload(self):
                return {'linear': {'x': 1.0}}
        class Sub(Base):
            def payload(self):
                made = super().payload()
                made['<angulr|angular>'] = {}
                return made
        def hear(node, m):
            node.publish('command', Sub().payload())
        """,
    'a property': """
        class Talker:
            def __init__(self, m):
                self.m = m
            @property
            def place(self):
                return self.m.pose.pose.<positon|position>
        def hear(node, m):
            print(Talker(m).place)
        """,
    'a cached property': """
        from functools import cached_property
        class Talker:
            def __init__(self, m):
                self.m = m
            @cached_property
            def place(self):
                return self.m.pose.pose.<positon|position>
        def hear(node, m):
            print(Talker(m).place.x)
        """,
    'the setter of a property': """
        class Talker:
            def __init__(self, node):
                self.node = node
            @property
            def level(self):
                return 0
            @level.setter
            def level(self, value):
                self.node.publish('<levle|level>', value)
        def hear(node, m):
            Talker(node).level = 3
        """,
    'a class method': """
        class Talker:
            topic = '<comand|command>'
            @classmethod
            def send(cls, node):
                node.publish(cls.topic, {})
        def hear(node, m):
            Talker.send(node)
        """,
    'another constructor': """
        class Place:
            def __init__(self, x):
                self.x = x
            @classmethod
            def of(cls, m):
                return cls(m.pose.<pse|pose>.position.x)
        def hear(node, m):
            print(Place.of(m).x)
        """,
    'a static method': """
        class Talker:
            @staticmethod
            def send(node):
                node.publish('<comand|command>', {})
        def hear(node, m):
            Talker().send(node)
        """,
    'an object that is called': """
        class Send:
            def __init__(self, topic):
                self.topic = topic
            def __call__(self, node, payload):
                node.publish(self.topic, payload)
        SEND = Send('<comand|command>')
        def hear(node, m):
            SEND(node, {})
        """,
    'a private attribute': """
        class Talker:
            def __init__(self, node):
                self.__publish = node.publish
            def go(self):
                self.__publish('<comand|command>', {})
        def hear(node, m):
            Talker(node).go()
        """,
    'the default of a dataclass': """
        from dataclasses import dataclass
        @dataclass
        class Task:
            count: int
            action: str = '<cuont|count>'
        def hear(node, m):
            task = Task(3)
            node.send_goal(task.action, task.count)
        """,
    'a dataclass of a dataclass': """
        from dataclasses import dataclass, field
        @dataclass
        class Base:
            topic: str = 'level'
        @dataclass(frozen=True)
        class Task(Base):
            topic: str = '<comand|command>'
            payload: dict = field(default_factory=dict)
        def hear(node, m):
            task = Task()
            node.publish(task.topic, task.payload)
        """,
    'a named tuple': """
        from typing import NamedTuple
        class Step(NamedTuple):
            topic: str
            payload: object = 1
        PLAN = (Step('level'), Step('<comand|command>', {}))
        def hear(node, m):
            for step in PLAN:
                node.publish(step.topic, step.payload)
        """,
    'a named tuple, unpacked': """
        from typing import NamedTuple
        class Step(NamedTuple):
            topic: str
            payload: object = 1
        def hear(node, m):
            for topic, payload in [Step('level'), Step('<comand|command>', {})]:
                node.publish(topic, payload)
        """,
    'a member of an enumeration': """
        from enum import Enum
        class Topic(Enum):
            LEVEL = 'level'
            COMMAND = '<comand|command>'
        def hear(node, m):
            node.publish(Topic.COMMAND.value, {})
        """,
    'a member that is a text': """
        from enum import StrEnum, auto
        class Topic(StrEnum):
            <LEVLE|LEVEL> = auto()
        def hear(node, m):
            for topic in Topic:
                node.publish(topic, 1)
        """,
    'all members of an enumeration': """
        from enum import Enum
        class Client(str, Enum):
            ENABLE = 'enable'
            STOP = '<disable|enable>'
        def hear(node, m):
            for each in Client:
                node.call(each, True)
        """,
    'a decorator of the project': """
        import functools
        def marked(function):
            @functools.wraps(function)
            def wrapper(node, m):
                node.publish('<levle|level>', 1)
                return function(node, m)
            return wrapper
        @marked
        def hear(node, m):
            node.publish('command', {})
        """,
    'a decorator with arguments': """
        import functools
        def announced(topic):
            def wrap(function):
                @functools.wraps(function)
                def wrapper(node, *args):
                    node.publish(topic, 1)
                    return function(node, *args)
                return wrapper
            return wrap
        @announced('<levle|level>')
        def hear(node, m):
            node.publish('command', {})
        """,
    'a decorated method': """
        def logged(method):
            def wrapper(self, *args):
                self.node.logger.<inof|info>('call')
                return method(self, *args)
            return wrapper
        class Talker:
            def __init__(self, node):
                self.node = node
            @logged
            def go(self, payload):
                self.node.publish('command', payload)
        def hear(node, m):
            Talker(node).go({})
        """,
    'a context manager of the project': """
        class Busy:
            def __init__(self, node):
                self.node = node
            def __enter__(self):
                self.node.publish('<levle|level>', 1)
                return self
            def __exit__(self, *reason):
                self.node.publish('level', 0)
        def hear(node, m):
            with Busy(node):
                node.publish('command', {})
        """,
    'the end of a context manager': """
        class Busy:
            def __init__(self, node):
                self.node = node
            def __enter__(self):
                return self
            def __exit__(self, *reason):
                self.node.publish('<levle|level>', 0)
        def hear(node, m):
            with Busy(node):
                node.publish('command', {})
        """,
    'what a context manager gives': """
        from contextlib import contextmanager
        @contextmanager
        def announced(node):
            yield node.publish
            node.publish('<levle|level>', 0)
        def hear(node, m):
            with announced(node) as publish:
                publish('command', {})
        """,
    'an iterator of the project': """
        class Topics:
            def __iter__(self):
                yield '<comand|command>'
        def hear(node, m):
            for topic in Topics():
                node.publish(topic, {})
        """,
    'a descriptor': """
        class Topic:
            def __init__(self, name):
                self.name = name
            def __get__(self, owner, kind=None):
                return self.name
        class Talker:
            topic = Topic('<comand|command>')
        def hear(node, m):
            node.publish(Talker().topic, {})
        """,
    'a proxy': """
        class Proxy:
            def __init__(self, node):
                self._node = node
            def __getattr__(self, name):
                return getattr(self._node, name)
        def hear(node, m):
            Proxy(node).publish('<comand|command>', {})
        """,
    'an operator of the project': """
        class Output:
            def __init__(self, publish, name):
                self._publish, self._name = publish, name
            def __lshift__(self, payload):
                self._publish(self._name, payload)
                return self
        def hear(node, m):
            Output(node.publish, '<levle|level>') << 1 << 2
        """,
    'a function or another one': """
        def drive(node):
            node.publish('<comand|command>', {})
        def hear(node, m):
            act = node.own_state.get('act') or drive
            act(node)
        """,
    'a goal that an object keeps': """
        class Counter:
            def __init__(self, node):
                self.node, self.goal = node, None
            def start(self):
                self.goal = self.node.send_goal('count', 3)
            def stop(self):
                if self.goal is not None:
                    self.goal.<cancel_goal|cancel>()
                    self.goal = None
        def hear(node, m):
            counter = Counter(node)
            counter.start()
            counter.stop()
        """,
    'a table of what is next': """
        TABLE = {
            'idle': {'go': ('busy', 'command')},
            'busy': {'stop': ('idle', '<Command|command>')},
        }
        def hear(node, m):
            state = node.own_state.get('state', 'idle')
            following, output = TABLE[state].get(m.child_frame_id, (state, None))
            if output is not None:
                node.publish(output, {})
            node.own_state['state'] = following
        """,
    'closure factory': """
        def sender(node, name):
            def send(payload):
                node.publish(name, payload)
            return send
        def hear(node, m):
            send = sender(node, '<comand|command>')
            send({})
        """,
    'closures over a loop': """
        def hear(node, m):
            senders = []
            for name in ('level', '<levle|level>'):
                senders.append(lambda value, name=name: node.publish(name, value))
            for each in senders:
                each(1)
        """,
    'nonlocal': """
        def hear(node, m):
            name = 'level'
            def change():
                nonlocal name
                node.publish('<levle|level>', 1)
                name = 'command'
            change()
        """,
    'match on a class': """
        from dataclasses import dataclass
        @dataclass
        class Go:
            speed: float
        @dataclass
        class Stop:
            reason: str
        def act(node, order):
            match order:
                case Go(speed=speed):
                    node.publish('command', {'<liner|linear>': {'x': speed}})
                case Stop():
                    node.publish('level', 0)
        def hear(node, m):
            act(node, Go(1.0))
            act(node, Stop('x'))
        """,
    'match on a class by position': """
        from dataclasses import dataclass
        @dataclass
        class Send:
            name: str
            payload: object
        def act(node, order):
            match order:
                case Send(name, payload):
                    node.publish(name, payload)
        def hear(node, m):
            act(node, Send('<comand|command>', {}))
        """,
    'match on a literal': """
        def hear(node, m):
            match m.child_frame_id:
                case 'base' | 'odom':
                    node.publish('<comand|command>', {})
                case _:
                    node.publish('level', 1)
        """,
    'match on a tuple': """
        def hear(node, m):
            for each in (('level', 1), ('<comand|command>', {})):
                match each:
                    case (name, payload):
                        node.publish(name, payload)
        """,
    'match on a dict': """
        def hear(node, m):
            for order in ({'topic': 'level', 'value': 1}, {'topic': '<comand|command>', 'value': {}}):
                match order:
                    case {'topic': name, 'value': value}:
                        node.publish(name, value)
        """,
    'walrus in a condition': """
        def hear(node, m):
            if (reply := node.call('enable', True)) and not reply.<sucess|success>:
                node.publish('level', 1)
        """,
    'walrus of a name': """
        def hear(node, m):
            node.publish(name := '<comand|command>', {})
            node.logger.info(name)
        """,
    'a chained comparison': """
        def hear(node, m):
            if 0.0 < m.twist.twist.linear.<X|x> < 1.0:
                node.publish('level', 1)
        """,
    'a nested comprehension': """
        def hear(node, m):
            [node.publish(a + b, 1) for a in ('le', 'le') for b in ('vel', '<val|vel>')]
        """,
    'a dispatch table of methods': """
        class Robot:
            def __init__(self, node):
                self.node = node
                self.actions = {'go': self.go, 'stop': self.stop}
            def go(self):
                self.node.publish('<comand|command>', {})
            def stop(self):
                self.node.publish('level', 0)
            def act(self, what):
                self.actions[what]()
        def hear(node, m):
            Robot(node).act(m.child_frame_id)
        """,
    'a dispatch by getattr': """
        class Robot:
            def __init__(self, node):
                self.node = node
            def do_go(self):
                self.node.publish('<comand|command>', {})
            def act(self, what):
                getattr(self, f'do_{what}')()
        def hear(node, m):
            Robot(node).act('go')
        """,
    'a table of classes': """
        class Go:
            def run(self, node):
                node.publish('<comand|command>', {})
        class Stop:
            def run(self, node):
                node.publish('level', 0)
        KINDS = {'go': Go, 'stop': Stop}
        def hear(node, m):
            KINDS.get(m.child_frame_id, Stop)().run(node)
        """,
    'a table of names in a class': """
        class Robot:
            TOPICS = {'go': '<comand|command>', 'stop': 'level'}
            def go(self, node):
                node.publish(self.TOPICS['go'], {})
        def hear(node, m):
            Robot().go(node)
        """,
    'all subclasses': """
        class Action:
            def run(self, node):
                node.publish(self.topic, self.payload)
        class Go(Action):
            topic, payload = '<comand|command>', {}
        class Stop(Action):
            topic, payload = 'level', 0
        def hear(node, m):
            for each in Action.__subclasses__():
                each().run(node)
        """,
    'slots': """
        class Talker:
            __slots__ = ('node', 'topic')
            def __init__(self, node, topic='<comand|command>'):
                self.node = node
                self.topic = topic
            def go(self):
                self.node.publish(self.topic, {})
        def hear(node, m):
            Talker(node).go()
        """,
    'a class as a namespace': """
        class Names:
            class Out:
                DRIVE = '<comand|command>'
        def hear(node, m):
            node.publish(Names.Out.DRIVE, {})
        """,
    'a default dict': """
        from collections import defaultdict
        NAMES = defaultdict(lambda: 'level', go='<comand|command>')
        def hear(node, m):
            node.publish(NAMES['go'], {})
        """,
    'format': """
        def hear(node, m):
            node.publish('{}{}'.format('le', '<val|vel>'), 1)
        """,
    'percent': """
        def hear(node, m):
            node.publish('%s' % '<levle|level>', 1)
        """,
    'join': """
        def hear(node, m):
            node.publish(''.join(['le', '<val|vel>']), 1)
        """,
    'a reduced call': """
        from functools import reduce
        def hear(node, m):
            reduce(lambda made, name: node.publish(name, 1), ['level', '<levle|level>'], None)
        """,
    'a thread': """
        import threading
        def work(node, name):
            node.publish(name, {})
        def hear(node, m):
            threading.Thread(target=work, args=(node, '<comand|command>')).start()
        """,
    'a thread class': """
        import threading
        class Worker(threading.Thread):
            def __init__(self, node):
                super().__init__(daemon=True)
                self.node = node
            def run(self):
                self.node.publish('<comand|command>', {})
        def hear(node, m):
            Worker(node).start()
        """,
    'a pool': """
        from concurrent.futures import ThreadPoolExecutor
        def work(node, name):
            node.publish(name, {})
        def hear(node, m):
            with ThreadPoolExecutor() as pool:
                pool.submit(work, node, '<comand|command>')
        """,
    'star arguments': """
        def send(node, *names):
            for name in names:
                node.publish(name, 1)
        def hear(node, m):
            send(node, 'level', '<levle|level>')
        """,
    'keyword arguments': """
        def send(node, **values):
            for name, value in values.items():
                node.publish(name, value)
        def hear(node, m):
            send(node, level=1, <comand|command>={})
        """,
    'a coroutine of a generator': """
        def talk(node):
            while True:
                value = yield
                node.publish('<levle|level>', value)
        def hear(node, m):
            talker = talk(node)
            next(talker)
            talker.send(3)
        """,
    'yield from': """
        def names():
            yield from ('level', '<levle|level>')
        def hear(node, m):
            for name in names():
                node.publish(name, 1)
        """,
    'an async context manager': """
        class Busy:
            def __init__(self, node):
                self.node = node
            async def __aenter__(self):
                return self.node.publish
            async def __aexit__(self, *reason):
                self.node.publish('level', 0)
        async def hear(node, m):
            async with Busy(node) as publish:
                publish('<comand|command>', {})
        """,
    'an async iterator': """
        class Names:
            def __init__(self):
                self.left = [1]
            def __aiter__(self):
                return self
            async def __anext__(self):
                if not self.left:
                    raise StopAsyncIteration
                return '<comand|command>'
        async def hear(node, m):
            async for name in Names():
                node.publish(name, {})
        """,
    'an async method of a base': """
        class Base:
            def __init__(self, node):
                self.node = node
            async def ask(self, value):
                return await self.node.call_async('<enabel|enable>', value)
        class Sub(Base):
            async def ask(self):
                return (await super().ask(True)).success
        async def hear(node, m):
            await Sub(node).ask()
        """,
    'an exception of the project': """
        class Late(Exception):
            topic = '<levle|level>'
        def hear(node, m):
            try:
                raise Late('x')
            except Late as error:
                node.publish(error.topic, 1)
        """,
    'an object in another object': """
        class Out:
            def __init__(self, node):
                self.node = node
            def send(self, name):
                self.node.publish(name, {})
        class Robot:
            def __init__(self, node):
                self.out = Out(node)
            def go(self):
                self.out.send('<comand|command>')
        def hear(node, m):
            Robot(node).go()
        """,
    'a fluent builder': """
        class Twister:
            def __init__(self):
                self.made = {}
            def turn(self, z):
                self.made['<angulr|angular>'] = {'z': z}
                return self
            def build(self):
                return self.made
        def hear(node, m):
            node.publish('command', Twister().turn(1.0).build())
        """,
    'a singleton': """
        class Robot:
            _one = None
            @classmethod
            def get(cls, node):
                if cls._one is None:
                    cls._one = cls(node)
                return cls._one
            def __init__(self, node):
                self.node = node
            def go(self):
                self.node.publish('<comand|command>', {})
        def hear(node, m):
            Robot.get(node).go()
        """,
    'a global object': """
        ROBOT = None
        class Robot:
            def __init__(self, node):
                self.node = node
            def go(self):
                self.node.publish('<comand|command>', {})
        def hear(node, m):
            global ROBOT
            if ROBOT is None:
                ROBOT = Robot(node)
            ROBOT.go()
        """,
    'an observer': """
        class Bus:
            def __init__(self):
                self.listeners = []
            def on(self, listener):
                self.listeners.append(listener)
            def emit(self, value):
                for each in self.listeners:
                    each(value)
        def hear(node, m):
            bus = Bus()
            bus.on(lambda value: node.publish('<levle|level>', value))
            bus.emit(3)
        """,
    'a state of a state machine': """
        class State:
            def __init__(self, machine):
                self.machine = machine
        class Idle(State):
            def step(self):
                self.machine.node.publish('level', 0)
                return Drive(self.machine)
        class Drive(State):
            def step(self):
                self.machine.node.publish('<comand|command>', {})
                return Idle(self.machine)
        class Machine:
            def __init__(self, node):
                self.node = node
                self.state = Idle(self)
            def step(self):
                self.state = self.state.step()
        def hear(node, m):
            machine = Machine(node)
            machine.step()
            machine.step()
        """,
    'an abstract property': """
        from abc import ABC, abstractmethod
        class Base(ABC):
            @property
            @abstractmethod
            def topic(self): ...
            def go(self, node):
                node.publish(self.topic, {})
        class Sub(Base):
            @property
            def topic(self):
                return '<comand|command>'
        def hear(node, m):
            Sub().go(node)
        """,
    'an alternative of two classes': """
        class Fast:
            def go(self, node):
                node.publish('<comand|command>', {})
        class Slow:
            def go(self, node):
                node.publish('level', 1)
        def hear(node, m):
            kind = Fast if m.child_frame_id else Slow
            kind().go(node)
        """,
    'a function by name': """
        def go(node):
            node.publish('<comand|command>', {})
        def hear(node, m):
            globals()['go'](node)
        """,
    'a condition that joins two things': """
        def hear(node, m):
            if m.child_frame_id and node.parameters.speed > 1.0:
                node.publish('<comand|command>', {})
        """,
    'a container of the project': """
        class Names:
            def __init__(self, **names):
                self._names = names
            def __getitem__(self, key):
                return self._names[key]
        def hear(node, m):
            node.publish(Names(go='<comand|command>')['go'], {})
        """,
    'an exit stack': """
        from contextlib import ExitStack
        def hear(node, m):
            with ExitStack() as stack:
                stack.callback(node.publish, '<levle|level>', 0)
        """,
    'finally': """
        def hear(node, m):
            try:
                node.publish('level', 1)
            finally:
                node.publish('<levle|level>', 0)
        """,
    'a retry decorator': """
        import functools
        def retry(times):
            def wrap(function):
                @functools.wraps(function)
                def wrapper(*args, **kwargs):
                    for _ in range(times):
                        if function(*args, **kwargs):
                            return True
                    return False
                return wrapper
            return wrap
        @retry(times=3)
        def ask(node, value):
            return node.call('<enabel|enable>', value).success
        def hear(node, m):
            ask(node, True)
        """,
    'a decorator class': """
        import functools
        class Counted:
            def __init__(self, function):
                functools.update_wrapper(self, function)
                self.function = function
                self.count = 0
            def __call__(self, node, m):
                self.count += 1
                node.publish('<levle|level>', self.count % 256)
                return self.function(node, m)
        @Counted
        def hear(node, m):
            node.publish('command', {})
        """,
    'a decorator class with arguments': """
        class announced:
            def __init__(self, topic):
                self.topic = topic
            def __call__(self, function):
                def wrapper(node, m):
                    node.publish(self.topic, 1)
                    return function(node, m)
                return wrapper
        @announced('<levle|level>')
        def hear(node, m):
            node.publish('command', {})
        """,
    'two decorators': """
        from functools import wraps
        def first(function):
            @wraps(function)
            def inner(node, m):
                return function(node, m)
            return inner
        def second(function):
            @wraps(function)
            def inner(node, m):
                function(node, m)
                node.publish('<levle|level>', 1)
            return inner
        @first
        @second
        def hear(node, m):
            node.publish('command', {})
        """,
    'a decorated body': """
        from functools import wraps
        def quiet(function):
            @wraps(function)
            def inner(*args, **kwargs):
                return function(*args, **kwargs)
            return inner
        @quiet
        def hear(node, m):
            node.publish('<comand|command>', {})
        """,
    'a decorator of the behaviour with a payload': """
        def scaled(function):
            def inner(node, m):
                node.publish('command', {'linear': {'x': function(node, m)}})
            return inner
        @scaled
        def hear(node, m):
            return m.twist.twist.linear.<X|x>
        """,
    'set of subclasses': """
        class Base:
            topics = ()
            def go(self, node):
                for name in self.topics:
                    node.publish(name, 1)
        class Sub(Base):
            topics = ('level', '<levle|level>')
        def hear(node, m):
            Sub().go(node)
        """,
    'cooperative init': """
        class A:
            def __init__(self, node, **rest):
                super().__init__(**rest)
                self.node = node
        class B:
            def __init__(self, topic, **rest):
                super().__init__(**rest)
                self.topic = topic
        class C(A, B):
            def go(self):
                self.node.publish(self.topic, 1)
        def hear(node, m):
            C(node, topic='<levle|level>').go()
        """,
    'method passed as callback': """
        class Robot:
            def __init__(self, node):
                self.node = node
            def done(self, reply):
                self.node.logger.info(str(reply.<sucess|success>))
            def ask(self, then):
                then(self.node.call('enable', True))
        def hear(node, m):
            robot = Robot(node)
            robot.ask(robot.done)
        """,
    'generic class': """
        from typing import Generic, TypeVar
        T = TypeVar('T')
        class Box(Generic[T]):
            def __init__(self, value: T):
                self.value = value
        def hear(node, m):
            box = Box[str]('<comand|command>')
            node.publish(box.value, {})
        """,
    'protocol': """
        from typing import Protocol
        class Sender(Protocol):
            def send(self, node): ...
        class Fast:
            def send(self, node):
                node.publish('<comand|command>', {})
        def act(sender: Sender, node):
            sender.send(node)
        def hear(node, m):
            act(Fast(), node)
        """,
    'nested class': """
        class Robot:
            class Arm:
                def lift(self, node):
                    node.publish('<levle|level>', 1)
            def __init__(self):
                self.arm = self.Arm()
        def hear(node, m):
            Robot().arm.lift(node)
        """,
    'class in function': """
        def hear(node, m):
            class Local:
                topic = '<comand|command>'
                def go(self):
                    node.publish(self.topic, {})
            Local().go()
        """,
    'partial of class': """
        from functools import partial
        class Out:
            def __init__(self, topic, node):
                self.topic, self.node = topic, node
            def go(self):
                self.node.publish(self.topic, {})
        Drive = partial(Out, '<comand|command>')
        def hear(node, m):
            Drive(node).go()
        """,
    'iterator protocol': """
        class Names:
            def __init__(self, names):
                self.names, self.at = names, 0
            def __iter__(self):
                return self
            def __next__(self):
                if self.at >= len(self.names):
                    raise StopIteration
                self.at += 1
                return self.names[self.at - 1]
        def hear(node, m):
            for name in Names(['<levle|level>']):
                node.publish(name, 1)
        """,
    'zip and enumerate': """
        def hear(node, m):
            for i, (name, value) in enumerate(zip(('level', '<levle|level>'), (1, 2))):
                node.publish(name, value + i)
        """,
    'try else': """
        def hear(node, m):
            try:
                value = float(m.child_frame_id)
            except ValueError:
                node.publish('<levle|level>', 0)
            else:
                node.publish('command', {'linear': {'x': value}})
        """,
    'while walrus': """
        def hear(node, m):
            names = ['level', '<levle|level>']
            for name in reversed(names):
                node.publish(name, 1)
        """,
    'lambda table': """
        TABLE = {
            'go': lambda node: node.publish('<comand|command>', {}),
            'stop': lambda node: node.publish('level', 0),
        }
        def hear(node, m):
            for key in TABLE:
                TABLE[key](node)
        """,
    'lambdas of a comprehension that keep their items': """
        def hear(node, m):
            table = {
                name: (lambda name=name, value=value: node.publish(name, value))
                for name, value in [('<comand|command>', {}), ('level', 1)]
            }
            for send in table.values():
                send()
        """,
    'functions of a loop that keep their items': """
        def hear(node, m):
            for name, value in [
                ('level', 1),
                ('<comand|command>', {}),
            ]:
                def send(*, name=name):
                    node.publish(name, value)
                send()
        """,
    'a member of a plain enumeration': """
        from enum import Enum, IntEnum
        class Mode(Enum):
            SLOW = 3
        class Level(IntEnum):
            SLOW = 3
        def hear(node, m):
            node.publish('level', <Mode|Level>.SLOW)
        """,
    'a table of fields that a message is made with': """
        from geometry_msgs.msg import Twist, Vector3
        KEYS = {
            'w': {'linear': Vector3(x=0.3)},
            'a': {'<angle|angular>': Vector3(z=0.8)},
        }
        MADE = {'w': (Twist, {'linear': Vector3()}), 'a': (Vector3, {'x': 1.0})}
        def hear(node, m):
            fields = KEYS.get(m.child_frame_id)
            if fields is not None:
                node.publish('command', Twist(**fields))
            kind, values = MADE[m.child_frame_id]
            print(kind(**values))
        """,
    'a time without a stamp': """
        from rclpy.time import Time
        def hear(node, m):
            stamp = m.header.stamp
            then = Time.from_msg(stamp)
            print(node.now() - <stamp|then>)
        """,
    'a time that is compared with a number': """
        def hear(node, m):
            now, seconds = node.now(), 5
            if <now|seconds> > 3.0:
                print(now == seconds, now - now)
        """,
    'a time without a number': """
        from rclpy.duration import Duration
        def hear(node, m):
            second, one = Duration(seconds=1), 1.0
            last = node.own_state.get('last', 0)
            node.own_state['last'] = node.now()
            print(node.now() + <one|second>, last and node.now() - last)
        """,
}
# What looks wrong, and is not.
RIGHT = {
    'setitem': """
        class Led:
            def __init__(self, node, name):
                self.node, self.name = node, name
            def __setitem__(self, key, value):
                self.node.publish(self.name, value)
        def hear(node, m):
            Led(node, 'level')[0] = 1
        """,
    'contains': """
        class Led:
            def __init__(self, node, name):
                self.node, self.name = node, name
            def __contains__(self, value):
                self.node.publish(self.name, value)
                return True
        def hear(node, m):
            if 3 in Led(node, 'level'):
                node.logger.info('x')
        """,
    'str': """
        class Led:
            def __init__(self, node, name):
                self.node, self.name = node, name
            def __str__(self):
                self.node.publish(self.name, 1)
                return 'x'
        def hear(node, m):
            node.logger.info(f'{Led(node, "level")}')
        """,
    'iadd': """
        class Led:
            def __init__(self, publish, name):
                self.publish, self.name = publish, name
            def __iadd__(self, value):
                self.publish(self.name, value)
                return self
        def hear(node, m):
            led = Led(node.publish, 'level')
            led += 1
        """,
    'descriptor set': """
        class Out:
            def __init__(self, name):
                self.name = name
            def __set__(self, owner, value):
                owner.node.publish(self.name, value)
        class Robot:
            extra = Out('level')
            def __init__(self, node):
                self.node = node
        def hear(node, m):
            Robot(node).extra = 3
        """,
    'counter attr': """
        class Counter:
            def __init__(self, node):
                self.node = node
                self.count = 0
                self.mode = 'idle'
            def step(self):
                self.count += 1
                if self.mode == 'idle':
                    self.mode = 'busy'
                    return
                if self.count > 5:
                    self.node.publish('level', 1)
        def hear(node, m):
            if 'c' not in node.own_state:
                node.own_state['c'] = Counter(node)
            node.own_state['c'].step()
        """,
    'global counter': """
        class Counter:
            count = 0
            mode = None
            def step(self, node):
                self.count += 1
                if self.mode is None:
                    self.mode = 'busy'
                    return
                if self.count > 5:
                    node.publish('level', 1)
        COUNTER = Counter()
        def hear(node, m):
            COUNTER.step(node)
        """,
    'enum state machine': """
        from enum import Enum, auto
        class Mode(Enum):
            IDLE = auto()
            DRIVE = auto()
        class Machine:
            def __init__(self, node):
                self.node, self.mode = node, Mode.IDLE
            def step(self):
                if self.mode is Mode.IDLE:
                    self.mode = Mode.DRIVE
                    return
                self.node.publish('level', 1)
        MACHINES = {}
        def hear(node, m):
            machine = MACHINES.setdefault(node.name, Machine(node))
            machine.step()
        """,
    'enum in state': """
        from enum import Enum
        class Mode(Enum):
            IDLE = 'idle'
            DRIVE = 'drive'
        def hear(node, m):
            mode = node.own_state.get('mode', Mode.IDLE)
            if mode is Mode.IDLE:
                node.own_state['mode'] = Mode.DRIVE
                return
            node.publish('level', 1)
        """,
    'enum local loop': """
        from enum import Enum
        class Mode(Enum):
            IDLE = 'idle'
            DRIVE = 'drive'
        def hear(node, m):
            mode = Mode.IDLE
            for _ in range(20):
                if mode is Mode.DRIVE:
                    node.publish('level', 1)
                mode = Mode.DRIVE
        """,
    'loop with range filter': """
        NAMES = ('level', 'never')
        def hear(node, m):
            for i in range(len(NAMES)):
                if i == 0:
                    node.publish(NAMES[i], 1)
        """,
    'loop with lookup': """
        ON = {'level': True, 'never': False}
        def hear(node, m):
            for name in ('level', 'never'):
                if ON[name]:
                    node.publish(name, 1)
        """,
    'loop with helper': """
        def is_on(name):
            return name in ('level',)
        def hear(node, m):
            for name in ('level', 'never'):
                if is_on(name):
                    node.publish(name, 1)
        """,
    'loop with try': """
        def hear(node, m):
            for name in ('never', 'level'):
                try:
                    node.publish(name, 1)
                except Exception:
                    continue
                break
        """,
    'loop types': """
        from std_msgs.msg import UInt8
        def hear(node, m):
            for value in (1, UInt8(data=2), {'data': 3}, 'no'):
                if isinstance(value, str):
                    continue
                node.publish('level', value)
        """,
    'subclass hook': """
        class Action:
            known = []
            def __init_subclass__(cls, **rest):
                super().__init_subclass__(**rest)
                Action.known.append(cls)
        class Go(Action):
            topic = 'level'
            def run(self, node):
                node.publish(self.topic, 1)
        def hear(node, m):
            for each in Action.known:
                each().run(node)
        """,
    'metaclass registry': """
        class Meta(type):
            known = {}
            def __new__(mcs, name, bases, space):
                made = super().__new__(mcs, name, bases, space)
                mcs.known[name] = made
                return made
        class Go(metaclass=Meta):
            topic = 'level'
            def run(self, node):
                node.publish(self.topic, 1)
        def hear(node, m):
            Meta.known['Go']().run(node)
        """,
    'getattr proxy with rename': """
        class Proxy:
            names = {'send': 'publish'}
            def __init__(self, node):
                self._node = node
            def __getattr__(self, name):
                return getattr(self._node, self.names.get(name, name), None)
        def hear(node, m):
            Proxy(node).send('level', 1)
            Proxy(node).nothing
        """,
    'abstract base unused': """
        from abc import ABC, abstractmethod
        class Base(ABC):
            topic = 'never'
            def go(self, node):
                if self.topic != 'never':
                    node.publish(self.topic, 1)
        class Sub(Base):
            topic = 'level'
        def hear(node, m):
            Base().go(node)
            Sub().go(node)
        """,
    'base without attribute': """
        class Base:
            def go(self, node):
                node.publish(self.topic, self.value())
            def value(self):
                raise NotImplementedError
        class Sub(Base):
            topic = 'level'
            def value(self):
                return 1
        def hear(node, m):
            Sub().go(node)
        """,
    'attribute by update': """
        class Bag:
            topic = 'never'
            def __init__(self, **values):
                self.__dict__.update(values)
        def hear(node, m):
            node.publish(Bag(topic='level').topic, 1)
        """,
    'attribute by setattr': """
        class Bag:
            topic = 'never'
            def __init__(self, **values):
                for name, value in values.items():
                    setattr(self, name, value)
        def hear(node, m):
            node.publish(Bag(topic='level').topic, 1)
        """,
    'attribute by object setattr': """
        class Bag:
            topic = 'never'
            def __init__(self, topic):
                object.__setattr__(self, 'topic', topic)
        def hear(node, m):
            node.publish(Bag('level').topic, 1)
        """,
    'class attribute by other module style': """
        class Names:
            out = 'never'
        def configure():
            Names.out = 'level'
        configure()
        def hear(node, m):
            node.publish(Names.out, 1)
        """,
    'class attribute by setattr': """
        class Names:
            out = 'never'
        setattr(Names, 'out', 'level')
        def hear(node, m):
            node.publish(Names.out, 1)
        """,
    'class attr by loop setattr': """
        class Names:
            out = 'never'
        for key, value in {'out': 'level'}.items():
            setattr(Names, key, value)
        def hear(node, m):
            node.publish(Names.out, 1)
        """,
    'dataclass replaced': """
        from dataclasses import dataclass, replace
        @dataclass
        class Task:
            topic: str = 'never'
        def hear(node, m):
            node.publish(replace(Task(), topic='level').topic, 1)
        """,
    'dataclass post init': """
        from dataclasses import dataclass, field
        @dataclass
        class Task:
            topic: str = 'never'
            values: list = field(default_factory=list)
            def __post_init__(self):
                self.topic = 'level'
        def hear(node, m):
            node.publish(Task().topic, 1)
        """,
    'dataclass init false': """
        from dataclasses import dataclass, field, InitVar, KW_ONLY
        @dataclass
        class Task:
            made: InitVar[int]
            topic: str = field(init=False, default='level')
            _: KW_ONLY = None
            value: int = 1
            def __post_init__(self, made):
                self.value = made
        def hear(node, m):
            task = Task(3)
            node.publish(task.topic, task.value)
        """,
    'named tuple make': """
        from typing import NamedTuple
        class Step(NamedTuple):
            topic: str
            value: int = 1
            @property
            def ok(self):
                return self.topic != 'never'
        def hear(node, m):
            for step in map(Step._make, [('level', 1), ('never', 2)]):
                if step.ok:
                    node.publish(step.topic, step.value)
            topic, value = Step('never')._replace(topic='level')
            node.publish(topic, value)
            node.publish(*Step('level'))
            node.publish(**Step('level', 3)._asdict() | {}) if False else None
        """,
    'cached factory': """
        from functools import lru_cache
        class Talker:
            def __init__(self):
                self.queue = []
                self.topic = 'never'
            def flush(self, node):
                if self.queue:
                    node.publish('level', self.queue.pop())
        @lru_cache
        def talker():
            return Talker()
        def hear(node, m):
            talker().flush(node)
            talker().queue.append(1)
        """,
    'property override': """
        class Base:
            topic = 'never'
            def go(self, node):
                node.publish(self.topic, 1)
        class Sub(Base):
            @property
            def topic(self):
                return 'level'
        def hear(node, m):
            Sub().go(node)
        """,
    'method replaced in object': """
        class Talker:
            def name(self):
                return 'never'
        def hear(node, m):
            talker = Talker()
            talker.name = lambda: 'level'
            node.publish(talker.name(), 1)
        """,
    'conditional class': """
        import sys
        class Old:
            topic = 'never'
        class New:
            topic = 'level'
        Kind = New if sys.version_info > (3, 0) else Old
        def hear(node, m):
            node.publish(Kind.topic, 1)
        """,
    'suppressing manager': """
        class Quiet:
            def __enter__(self):
                return self
            def __exit__(self, kind, error, trace):
                return kind is not None and issubclass(kind, AttributeError)
        def hear(node, m):
            with Quiet():
                print(m.nothing)
        """,
    'suppressing generator': """
        from contextlib import contextmanager
        @contextmanager
        def quiet():
            try:
                yield
            except AttributeError:
                pass
        def hear(node, m):
            with quiet():
                print(m.nothing)
        """,
    'safe decorator': """
        import functools
        def safe(function):
            @functools.wraps(function)
            def wrapper(*args):
                try:
                    return function(*args)
                except (AttributeError, KeyError):
                    return None
            return wrapper
        @safe
        def peek(m):
            return m.nothing
        def hear(node, m):
            print(peek(m))
        """,
    'registry with missing': """
        ACTIONS = {}
        def action(name):
            def wrap(function):
                ACTIONS[name] = function
                return function
            return wrap
        @action('go')
        def go(node):
            node.publish('level', 1)
        @action('odd')
        def odd(node, more):
            node.publish('level', more)
        def hear(node, m):
            act = ACTIONS.get(m.child_frame_id)
            if act is go:
                act(node)
            elif act:
                act(node, 3)
        """,
    'table mutated at runtime': """
        TABLE = {'go': 'never'}
        def configure():
            TABLE['go'] = 'level'
        def hear(node, m):
            configure()
            node.publish(TABLE['go'], 1)
        """,
    'optional callback': """
        class Talker:
            callback = None
            def fire(self, value):
                if self.callback:
                    self.callback('level', value)
        def hear(node, m):
            talker = Talker()
            talker.fire(0)
            talker.callback = node.publish
            talker.fire(1)
        """,
    'duck types': """
        class One:
            def pair(self):
                return 'level', 1
        class Two:
            def pair(self):
                return 'command', {}
        def hear(node, m):
            for each in (One(), Two()):
                node.publish(*each.pair())
        """,
    'singledispatch method': """
        from functools import singledispatchmethod
        class Talker:
            @singledispatchmethod
            def name(self, value):
                raise TypeError(value)
            @name.register
            def _(self, value: int):
                return 'level'
        def hear(node, m):
            node.publish(Talker().name(3), 1)
        """,
    'singledispatch base class': """
        from functools import singledispatch
        class A: pass
        class B(A): pass
        @singledispatch
        def name(value):
            return 'never'
        @name.register
        def _(value: A):
            return 'level'
        @name.register(int)
        @name.register(float)
        def _(value):
            return 'level'
        def hear(node, m):
            node.publish(name(B()), 1)
            node.publish(name(True), 1)
            node.publish(name(2.0), 1)
        """,
    'a base that a subclass sets up': """
        class Base:
            def __init__(self, node):
                self.node = node
                self.setup()
            def setup(self):
                pass
            def send(self):
                if getattr(self, 'topic', None):
                    self.node.publish(self.topic, 1)
        class Sub(Base):
            def setup(self):
                self.topic = 'level'
        def hear(node, m):
            Base(node).send()
            Sub(node).send()
        """,
    'an object that a class method changes': """
        class Cfg:
            topic: str = 'never'
            @classmethod
            def load(cls):
                made = cls()
                made.topic = 'level'
                return made
        def hear(node, m):
            node.publish(Cfg.load().topic, 1)
        """,
    'a lazy property': """
        class Lazy:
            def __init__(self):
                self._name = None
            @property
            def name(self):
                if self._name is None:
                    self._name = 'level'
                return self._name
        def hear(node, m):
            node.publish(Lazy().name, 1)
        """,
    'a stack': """
        class Stack:
            def __init__(self):
                self.items = []
            def push(self, item):
                self.items.append(item)
                return self
            def pop(self):
                return self.items.pop() if self.items else None
        def hear(node, m):
            stack = Stack()
            if stack.pop() is None:
                stack.push('level')
            name = stack.pop()
            if name:
                node.publish(name, 1)
        """,
    'numbers and flags': """
        from enum import IntEnum, Flag, auto
        class Level(IntEnum):
            LOW = 1
            HIGH = auto()
        class Part(Flag):
            A = auto()
            B = auto()
            AB = A | B
        def hear(node, m):
            node.publish('level', Level.HIGH)
            node.publish('level', Level(1).value + Level['LOW'])
            if Part.A in Part.AB and (Part.A | Part.B) == Part.AB:
                node.publish('level', Part.A.value)
        """,
    'depth of a context manager': """
        from contextlib import contextmanager
        class Busy:
            depth = 0
            def __enter__(self):
                self.depth += 1
            def __exit__(self, *_):
                self.depth -= 1
        BUSY = Busy()
        def hear(node, m):
            with BUSY:
                if BUSY.depth > 1:
                    return
                node.publish('level', BUSY.depth)
        """,
    'attributes made on demand': """
        class Meta:
            def __getattr__(self, name):
                if name == 'topic':
                    return 'level'
                raise AttributeError(name)
        def hear(node, m):
            node.publish(Meta().topic, 1)
            print(hasattr(Meta(), 'x'), getattr(Meta(), 'y', None))
        """,
    'filters of constants': """
        def hear(node, m):
            for name, kind in (('level', int), ('never', str)):
                if isinstance(m.twist.twist.linear.x, kind):
                    node.publish(name, 1)
            for name in ('never', 'level'):
                if not name.startswith('n'):
                    node.publish(name, 1)
            names = [n for n in ('never', 'level') if len(n) == 5 and n[0] == 'l']
            for n in names:
                node.publish(n, 1)
        """,
    'a proxy that keeps what it is given': """
        class Node2:
            def __init__(self, node):
                self.__dict__['_n'] = node
            def __getattr__(self, name):
                return getattr(self.__dict__['_n'], name)
            def __setattr__(self, name, value):
                self.__dict__[name] = value
        def hear(node, m):
            wrapped = Node2(node)
            wrapped.extra = 3
            wrapped.publish('level', wrapped.extra)
        """,
    'a class that renames its subclasses': """
        class A:
            name = 'level'
            def __init_subclass__(cls):
                cls.name = cls.__name__.lower()
        class Level(A):
            name = 'never'
        def hear(node, m):
            node.publish(Level.name, 1)
            node.publish(Level().name, 1)
        """,
    'a default of a base, changed': """
        import abc
        class A(metaclass=abc.ABCMeta):
            @abc.abstractmethod
            def name(self): return 'never'
            def go(self, node): node.publish(self.name(), 1)
        class B(A):
            def name(self): return super().name().replace('never', 'level')
        def hear(node, m): B().go(node)
        """,
}
PLACE = re.compile(r'<(\w+)\|(\w+)>')


def fill(text, group):
    return dedent(PLACE.sub(lambda found: found[group], text)) + USE_ALL


@pytest.mark.ros
@pytest.mark.sampled
@pytest.mark.parametrize('text', PLANTED.values(), ids=PLANTED)
def test_an_error_is_found_in_its_line(check, text):
    lines = [number for number, line in enumerate(text.splitlines(), 1) if PLACE.search(line)]
    assert [line for line, _ in check(SYSTEM, fill(text, 1))] == lines


@pytest.mark.ros
@pytest.mark.sampled
@pytest.mark.parametrize('text', PLANTED.values(), ids=PLANTED)
def test_an_idiom_without_an_error_has_no_finding(check, text):
    assert check(SYSTEM, fill(text, 2)) == []


@pytest.mark.ros
@pytest.mark.parametrize('text', RIGHT.values(), ids=RIGHT)
def test_what_looks_wrong_and_is_not_has_no_finding(check, text):
    assert check(SYSTEM, fill(text, 2)) == []
