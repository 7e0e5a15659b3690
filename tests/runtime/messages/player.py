"""Plays a scenario on a system in this process, and tells what each subscription got."""

import json
import threading
from collections import Counter, defaultdict
from contextlib import contextmanager
from dataclasses import dataclass, field
from unittest import mock

from composer.runtime.behaviours.running_calls import Owner
from composer.runtime.messages.local_delivery import LocalPublisher
from tests.running import DEADLINE_SEC, wait_for
from tests.runtime.rewiring.fresh_start import running_system

_games = []


@dataclass
class Outcome:
    """What came of a scenario.

    Attributes:
        heard: The texts that each subscription got.
        overruns: What was dropped from its queue.
        mixed: The topics on which not all publishers take the same way at the same time.
        handed_over: How many messages took the way within the process.
    """

    heard: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    overruns: dict[str, int] = field(default_factory=dict)
    mixed: set[int] = field(default_factory=set)
    handed_over: int = 0


def hear(node, message, name):
    """Take a message; the behaviour of all subscriptions."""
    _games[-1].hear(node, name, message.data)


def play(scenario, folder, *, is_local):
    """Play a scenario; return its outcome."""
    path = folder / f'{"local" if is_local else "sent"}.yaml'
    path.write_text(json.dumps(scenario.render(is_local=is_local)))
    with running_system([path], checks=False) as (system, _):
        game = _Game(scenario, system)
        _games.append(game)
        try:
            with _counting(game.outcome):
                game.play()
        finally:
            game.open_all()
            _games.remove(game)
        return game.outcome


class _Game:
    def __init__(self, scenario, system):
        self.outcome = Outcome()
        self._scenario = scenario
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
        self._find_mixed()
        for kind, events, *topics in self._scenario.steps:
            if kind == 'burst':
                self._burst(events, *topics)
            for name, number in events if kind == 'flood' else ():
                self._happen(name, number)
            for name, number in events if kind == 'trickle' else ():
                for _ in range(number):
                    self._trickle(name)
            self._wait_until_idle()
        for name, end in self._scenario.subscriptions.items():
            health = self._health.entity(f'/{end.node}', Owner('subscription', name))
            self.outcome.overruns[name] = health._count_missed().overruns

    def _trickle(self, name):
        topic = self._scenario.publishers[name].topic
        if self._scenario.behind([topic]) != {topic}:
            self._burst([(name, 1)], [topic])
        else:
            self._happen(name, 1)
            self._wait_until_idle()

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
        for name, end in self._scenario.publishers.items():
            if end.topic in found:
                self._happen(name, 1)
                self._wait_until_idle()
        for event in events:
            self._happen(*event)
        for _, name in sorted(held):
            self._wait_until_idle()
            self._blocked.discard(name)
            self._gates[name].set()
        self._wait_until_idle()

    def _happen(self, name, number):
        node = self._nodes[self._scenario.publishers[name].node].behaviour_node
        for _ in range(number):
            self._publish(name, node)

    def _publish(self, name, node):
        self._published[name] += 1
        node.publish(name, {'data': f'{name}:{self._published[name]}'})

    def _find_mixed(self):
        ways = defaultdict(set)
        for name, end in self._scenario.publishers.items():
            entity = self._nodes[end.node].entities['publishers'][name]
            ways[end.topic].add(bool(entity._local.reason))
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
        return sum(map(len, list(self.outcome.heard.values())))

    def _is_empty(self):
        return not any(
            source.queued or source.local or source.has_data()
            for name, source in self._sources.items()
            if name not in self._blocked
        )

    def _is_resting(self):
        return self._scheduler.running == len(self._blocked)


@contextmanager
def _counting(outcome):
    hand_over = LocalPublisher._hand_over

    def count(self, message, **options):
        outcome.handed_over += 1
        hand_over(self, message, **options)

    with mock.patch.object(LocalPublisher, '_hand_over', count):
        yield
