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
    'a partial method': """
        from functools import partialmethod
        class Talker:
            def __init__(self, node):
                self.node = node
            def send(self, topic, payload):
                self.node.publish(topic, payload)
            drive = partialmethod(send, '<comand|command>')
        def hear(node, m):
            Talker(node).drive({})
        """,
    'a function that a decorator registers': """
        ACTIONS = {}
        def action(name):
            def register(function):
                ACTIONS[name] = function
                return function
            return register
        @action('drive')
        def drive(node):
            node.publish('<comand|command>', {})
        @action('lift')
        def lift(node):
            node.publish('level', 1)
        def hear(node, m):
            ACTIONS[m.child_frame_id](node)
        """,
    'a class that a decorator registers': """
        TALKERS = []
        def talker(cls):
            TALKERS.append(cls)
            return cls
        @talker
        class Talker:
            def go(self, node):
                node.publish('<comand|command>', {})
        def hear(node, m):
            for each in TALKERS:
                each().go(node)
        """,
    'a table that is filled at the top': """
        TOPICS = {}
        TOPICS['drive'] = '<comand|command>'
        TOPICS['lift'] = 'command'
        def hear(node, m):
            node.publish(TOPICS['drive'], {})
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
    'a getter of attributes': """
        from operator import attrgetter
        place = attrgetter('pose.pose.<positon|position>')
        def hear(node, m):
            print(place(m).x)
        """,
    'a getter of parameters': """
        from operator import attrgetter
        settings = attrgetter('speed', '<mod|mode>')
        def hear(node, m):
            speed, mode = settings(node.parameters)
            print(speed, mode)
        """,
    'a caller of a method': """
        from operator import methodcaller
        send = methodcaller('publish', '<comand|command>', {})
        def hear(node, m):
            send(node)
        """,
    'a key of a sort': """
        from operator import attrgetter
        def hear(node, m):
            print(sorted([m], key=attrgetter('header.<stmp|stamp>.sec')))
        """,
    'a function or another one': """
        def drive(node):
            node.publish('<comand|command>', {})
        def hear(node, m):
            act = node.own_state.get('act') or drive
            act(node)
        """,
    'a function for a class': """
        from functools import singledispatch
        from nav_msgs.msg import Odometry
        @singledispatch
        def show(message, node):
            raise TypeError(message)
        @show.register
        def _(message: Odometry, node):
            node.publish('command', message.<twst|twist>.twist)
        def hear(node, m):
            show(m, node)
        """,
}
PLACE = re.compile(r'<(\w+)\|(\w+)>')


def fill(text, group):
    return dedent(PLACE.sub(lambda found: found[group], text)) + USE_ALL


@pytest.mark.ros
@pytest.mark.parametrize('text', PLANTED.values(), ids=PLANTED)
def test_an_error_is_found_in_its_line(check, text):
    lines = [number for number, line in enumerate(text.splitlines(), 1) if PLACE.search(line)]
    assert [line for line, _ in check(SYSTEM, fill(text, 1))] == lines


@pytest.mark.ros
@pytest.mark.parametrize('text', PLANTED.values(), ids=PLANTED)
def test_an_idiom_without_an_error_has_no_finding(check, text):
    assert check(SYSTEM, fill(text, 2)) == []
