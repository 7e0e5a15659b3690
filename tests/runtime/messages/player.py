"""Plays a scenario on a system in this process, and tells what each subscription got."""

import json
import select
import threading
from collections import Counter, defaultdict
from contextlib import contextmanager
from dataclasses import dataclass, field
from unittest import mock

from rclpy.qos import QoSCompatibility, ReliabilityPolicy, qos_check_compatible

from composer.language.specs import QosSpec
from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.messages.local_delivery import LocalPublisher
from composer.runtime.messages.qos_profiles import create_qos_profile
from tests.running import DEADLINE_SEC, wait_for
from tests.runtime.rewiring.fresh_start import running_system

_OUTSIDE_QOS = {'reliability': 'reliable', 'depth': 1000}
_games = []


@dataclass
class Outcome:
    """What came of a scenario.

    Attributes:
        heard: The texts that each subscription got.
        overruns: What was dropped from its queue.
        stays: The texts that each visitor got while it was there, with their sequence numbers.
        lossless: The publishers of which the visitors get every message.
        mixed: The topics on which not all publishers take the same way at the same time.
        handed_over: How many messages took the way within the process.
    """

    heard: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    overruns: dict[str, int] = field(default_factory=dict)
    stays: list[tuple] = field(default_factory=list)
    mixed: set[int] = field(default_factory=set)
    handed_over: int = 0


def hear(node, message, name):
    """Take a message; the behaviour of all subscriptions."""
    _games[-1].hear(node, name, message.data)


def play(scenario, folder, outsider, *, is_local):
    """Play a scenario; return its outcome."""
    path = folder / f'{"local" if is_local else "sent"}.yaml'
    path.write_text(json.dumps(scenario.render(is_local=is_local)))
    with running_system([path], checks=False) as (system, _):
        game = _Game(scenario, system, outsider)
        _games.append(game)
        try:
            with _counting(game.outcome):
                game.play()
        finally:
            game.open_all()
            _games.remove(game)
        return game.outcome


class _Game:
    def __init__(self, scenario, system, outsider):
        self.outcome = Outcome()
        self._scenario = scenario
        self._outsider = outsider
        self._nodes = {each.ros.get_name(): each for each in system._nodes.values()}
        self._health = system._handle.health
        self._scheduler = system._executor._spinner.scheduler
        registry = system._executor._spinner.registry
        registry.refresh()
        self._sources = {
            name: registry._nodes[node.ros].sources[node.entities['subscriptions'][name].ros]
            for node in self._nodes.values()
            for name in node.entities['subscriptions']
        }
        self._published = Counter()
        self._gates = {name: threading.Event() for name in scenario.subscriptions}
        self._blocked = set()
        self._inside = {}  # The visitors that are there, and what was published before.
        self.open_all()

    def open_all(self):
        for gate in self._gates.values():
            gate.set()

    def hear(self, node, name, text):
        self.outcome.heard[name].append(text)
        gate = self._gates[name]
        if not gate.is_set():
            self._blocked.add(name)
            assert gate.wait(DEADLINE_SEC)
        end = self._scenario.subscriptions[name]
        if end.relays_to is not None:
            for _ in range(end.copies):
                self._publish(end.relays_to, node)

    def play(self):
        scenario = self._scenario
        for name, topic in scenario.outside.items():
            self._outsider.advertise(name, f'/topic{topic}', _OUTSIDE_QOS)
            self._wait_until_met(name, topic)
        self._find_mixed()
        for step in scenario.steps:
            self._take(*step)
            self._wait_until_idle()
        for name in list(self._inside):
            self._leave(name)
        for name in scenario.outside:
            self._outsider.leave(name)
        for name, end in scenario.subscriptions.items():
            health = self._health.entity(f'/{end.node}', Owner('subscription', name))
            self.outcome.overruns[name] = health._count_missed().overruns

    def _take(self, kind, events, *topics):
        if kind == 'burst':
            self._burst(events, *topics)
            return
        for event, name, *number in events:
            if kind == 'flood':
                self._happen(event, name, *number)
            else:
                for _ in range(*number or [1]):
                    self._trickle(event, name)

    def _trickle(self, kind, name):
        topic = self._topic_of(name)
        event = (kind, name, 1)
        if kind != 'come or go' and self._scenario.behind([topic]) != {topic}:
            self._burst([event], [topic])
        else:
            self._happen(*event)
            self._wait_until_idle()

    def _topic_of(self, name):
        scenario = self._scenario
        if name in scenario.publishers:
            return scenario.publishers[name].topic
        return scenario.outside[name] if name in scenario.outside else scenario.visitors[name][0]

    def _burst(self, events, topics):
        """Have the events happen while the callbacks of the subscriptions wait."""
        found = self._scenario.behind(topics)
        held = [
            (end.topic, name)
            for name, end in self._scenario.subscriptions.items()
            if end.topic in found and end.can_be_held
        ]
        for _, name in held:
            self._gates[name].clear()
        # Each gets one before those that it may drop.
        for name in [*self._scenario.publishers, *self._scenario.outside]:
            if self._topic_of(name) in found:
                self._happen('publish' if name[0] == 'p' else 'from outside', name, 1)
                self._wait_until_idle()
        for event in events:
            self._happen(*event)
        for _, name in sorted(held):
            self._wait_until_idle()
            self._blocked.discard(name)
            self._gates[name].set()
        self._wait_until_idle()

    def _happen(self, kind, name, number=1):
        if kind == 'publish':
            node = self._nodes[self._scenario.publishers[name].node].behaviour_node
            for _ in range(number):
                self._publish(name, node)
        elif kind == 'from outside':
            self._publish_outside(name, [self._next_text(name) for _ in range(number)])
        elif name in self._inside:
            self._leave(name)
        else:
            self._join(name)

    def _publish(self, name, node):
        node.publish(name, {'data': self._next_text(name)})

    def _publish_outside(self, name, texts):
        """Return when the texts are in the queues."""
        topic = self._scenario.outside[name]
        sources = [self._sources[each] for each in self._met_from_outside(topic)]
        fds = [source.event_fd.fd for source in sources]
        wait_for(lambda: not select.select(fds, [], [], 0)[0], 'what was announced')
        before = [source.observer._arrived for source in sources]
        self._outsider.publish(name, texts)

        def has_come():
            return all(
                source.observer._arrived >= number + len(texts)
                for source, number in zip(sources, before, strict=True)
            )

        wait_for(has_come, f'texts of {name}')

    def _next_text(self, name):
        self._published[name] += 1
        return f'{name}:{self._published[name]}'

    def _join(self, name):
        topic, policies, has_context = self._scenario.visitors[name]
        met = self._met_by(topic, policies)
        before = {ros: ros.get_subscription_count() for ros in met.values()}
        self._inside[name] = {each: self._published[each] for each in met}
        self._outsider.join(name, f'/topic{topic}', policies, has_context=has_context)
        wait_for(lambda: all(ros.get_subscription_count() > before[ros] for ros in before), name)

    def _leave(self, name):
        topic, policies, _ = self._scenario.visitors[name]
        met = self._met_by(topic, policies)
        published = self._inside.pop(name)
        last = {
            f'{each}:{self._published[each]}'
            for each, ros in met.items()
            if self._published[each] > published[each]
            and policies['reliability'] == 'reliable'
            and ros.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT
        }
        wait_for(
            lambda: last <= {text for text, _ in self._outsider.heard(name)},
            f'the last messages to {name}',
        )
        self.outcome.stays.append((name, self._outsider.heard(name)))
        before = {ros: ros.get_subscription_count() for ros in met.values()}
        self._outsider.leave(name)
        wait_for(lambda: all(ros.get_subscription_count() < before[ros] for ros in before), name)

    def _met_by(self, topic, policies):
        """Return the rclpy publishers that match a visitor."""
        profile = create_qos_profile(QosSpec('default', policies, ()), {})
        return {
            name: ros
            for name, end in self._scenario.publishers.items()
            if end.topic == topic
            and _is_match((ros := self._ros_of('publishers', name, end)).qos_profile, profile)
        }

    def _ros_of(self, section, name, end):
        return self._nodes[end.node].entities[section][name].ros

    def _met_from_outside(self, topic):
        """Return the subscriptions that match a publisher of another process."""
        profile = create_qos_profile(QosSpec('default', _OUTSIDE_QOS, ()), {})
        return [
            name
            for name, end in self._scenario.subscriptions.items()
            if end.topic == topic
            and _is_match(profile, self._ros_of('subscriptions', name, end).qos_profile)
        ]

    def _wait_until_met(self, name, topic):
        met = self._met_from_outside(topic)
        wait_for(lambda: self._outsider.subscriptions(name) >= len(met), f'the end of {name}')

    def _find_mixed(self):
        self.outcome.mixed.update(self._scenario.outside.values())
        ways = defaultdict(set)
        for name, end in self._scenario.publishers.items():
            entity = self._nodes[end.node].entities['publishers'][name]
            visitors = [
                visitor
                for visitor, (topic, policies, _) in self._scenario.visitors.items()
                if topic == end.topic and name in self._met_by(topic, policies)
            ]
            ways[end.topic].add((bool(entity._local.reason), *visitors))
        self.outcome.mixed.update(topic for topic, each in ways.items() if len(each) > 1)

    def _wait_until_idle(self):
        """Return when all has run that can."""

        def is_idle():
            heard = self._count_heard()
            return (
                all(self._is_empty() and self._is_resting() for _ in range(2))
                and self._count_heard() == heard
            )

        wait_for(is_idle, 'callbacks to end')

    def _count_heard(self):
        return sum(map(len, self.outcome.heard.values()))

    def _is_empty(self):
        return not any(
            source.queued or source.local or source.has_data()
            for name, source in self._sources.items()
            if name not in self._blocked
        )

    def _is_resting(self):
        return self._scheduler.running == len(self._blocked)


def _is_match(offered, asked):
    return qos_check_compatible(offered, asked)[0] != QoSCompatibility.ERROR


@contextmanager
def _counting(outcome):
    hand_over = LocalPublisher._hand_over

    def count(self, message, **options):
        outcome.handed_over += 1
        hand_over(self, message, **options)

    with mock.patch.object(LocalPublisher, '_hand_over', count):
        yield
