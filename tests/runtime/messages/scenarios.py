"""Random systems of publishers, subscriptions and relays, and what happens to them."""

import random
from dataclasses import dataclass, field

_PROFILES = ('default', 'sensor_data', 'parameters', 'system_default', 'best_available')
_MANY = 1000
_BEHAVIOUR = 'tests.runtime.messages.player:hear'


@dataclass
class End:
    """A publisher or a subscription of the system.

    Attributes:
        group: Its callback group; None for the node's, which it shares.
        relays_to: The publisher on which it publishes again, `copies` times, what it got.
    """

    node: str
    topic: int
    qos: object
    group: str | None = None
    relays_to: str | None = None
    copies: int = 1
    read_only: bool = False

    @property
    def can_be_held(self):
        """Whether nothing else waits for its callback."""
        return self.group not in {None, 'reentrant'}


@dataclass
class Scenario:
    """A system and the steps that are taken.

    Attributes:
        steps: Lists of events: `burst` happens while the subscriptions are held, of the topics
            given and those behind; `trickle` is done one message after the other.
    """

    seed: int
    topics: int = 0
    publishers: dict[str, End] = field(default_factory=dict)
    subscriptions: dict[str, End] = field(default_factory=dict)
    steps: list[tuple] = field(default_factory=list)

    def render(self, *, is_local):
        """Return the system as a file says it."""
        nodes = {}
        for name, end in self.publishers.items():
            entry = {'topic': f'/topic{end.topic}', 'type': 'std_msgs/msg/String', 'qos': end.qos}
            _section(nodes, end, 'publishers')[name] = entry
        for name, end in self.subscriptions.items():
            entry = {
                'topic': f'/topic{end.topic}',
                'type': 'std_msgs/msg/String',
                'qos': end.qos,
                'behaviour': _BEHAVIOUR,
                'with': {'name': name},
                'read_only': end.read_only,
            }
            if end.group is not None:
                entry['group'] = end.group
            _section(nodes, end, 'subscriptions')[name] = entry
        return {'version': 1, 'defaults': {'local_delivery': is_local}, 'nodes': nodes}

    def behind(self, topics):
        """Return topics with those to which relays carry what is published on them."""
        found = set(topics)
        for end in sorted(self.subscriptions.values(), key=lambda end: end.topic):
            if end.relays_to is not None and end.topic in found:
                found.add(self.publishers[end.relays_to].topic)
        return found

    def loses_nothing(self, topics):
        """Tell whether no queue behind topics can be full."""
        found = self.behind(topics)
        ends = [end for end in self.subscriptions.values() if end.topic in found]
        return all(_is_deep(end.qos) for end in ends)


def _section(nodes, end, name):
    return nodes.setdefault(end.node, {}).setdefault(name, {})


def _is_deep(qos):
    return isinstance(qos, dict) and (
        qos.get('history') == 'keep_all' or qos.get('depth', 0) >= _MANY
    )


def create_scenario(seed):
    """Return the scenario of a seed."""
    return _Maker(seed).make()


class _Maker:
    def __init__(self, seed):
        self._random = random.Random(seed)
        self._scenario = Scenario(seed)
        # In most systems, most ends have what is handed over.
        self._is_plain = self._random.random() < 0.6

    def make(self):
        scenario, chance = self._scenario, self._random
        scenario.topics = chance.randint(1, 3)
        nodes = [f'node{number}' for number in range(chance.randint(1, 4))]
        for topic in range(scenario.topics):
            base = self._policies()
            for _ in range(chance.choice([1, 1, 2, 3])):
                name = f'p{len(scenario.publishers)}'
                scenario.publishers[name] = End(chance.choice(nodes), topic, self._qos(base))
            for _ in range(chance.choice([1, 1, 2, 3, 4])):
                self._add_subscription(chance.choice(nodes), topic, base)
        self._add_relays()
        for _ in range(chance.randint(2, 5)):
            scenario.steps.append(self._step())
        return scenario

    def _add_subscription(self, node, topic, base):
        chance = self._random
        name = f's{len(self._scenario.subscriptions)}'
        group = chance.choice([f'of_{name}'] * 4 + [None, 'reentrant'])
        end = End(node, topic, self._qos(base), group, read_only=chance.random() < 0.3)
        if not end.can_be_held:
            policies = {'profile': end.qos} if isinstance(end.qos, str) else end.qos
            end.qos = {**policies, 'history': 'keep_last', 'depth': _MANY}
        self._scenario.subscriptions[name] = end

    def _add_relays(self):
        """Let some subscriptions publish on topics behind theirs."""
        for end in self._scenario.subscriptions.values():
            behind = [
                name
                for name, other in self._scenario.publishers.items()
                if other.topic > end.topic and other.node == end.node
            ]
            if behind and end.can_be_held and self._random.random() < 0.6:
                end.relays_to = self._random.choice(behind)
                end.copies = self._random.choice([1, 1, 2, 7])

    def _policies(self):
        """Return policies for the ends of a topic, which may differ in some."""
        chance = self._random
        policies = {
            'reliability': chance.choice(['reliable', 'best_effort']),
            'depth': chance.choice([1, 1, 2, 3, 5, 10]),
        }
        if chance.random() < 0.15:
            policies['history'] = 'keep_all'
        if self._is_plain:
            return policies
        exotic = {
            'history': ['system_default'],
            'reliability': ['system_default', 'best_available'],
            'durability': ['transient_local', 'system_default', 'best_available'],
            'deadline': [100.0],
            'lifespan': [100.0, 'infinite'],
            'liveliness': ['automatic', 'manual_by_topic', 'system_default', 'best_available'],
            'liveliness_lease_duration': [100.0, 'infinite'],
        }
        for name in chance.sample(list(exotic), chance.choice([0, 0, 1, 2])):
            policies[name] = chance.choice(exotic[name])
        return policies

    def _qos(self, base):
        chance = self._random
        if not self._is_plain and chance.random() < 0.15:
            return chance.choice(_PROFILES)
        other = self._policies()
        changed = chance.sample(list(other), min(len(other), chance.choice([0, 0, 1, 1, 2])))
        return base | {name: other[name] for name in changed}

    def _step(self):
        chance, scenario = self._random, self._scenario
        kind = chance.choice(['burst', 'burst', 'burst', 'trickle', 'flood'])
        if kind == 'burst':
            topics = sorted(
                chance.sample(range(scenario.topics), chance.randint(1, scenario.topics))
            )
            publishers = [name for name, end in scenario.publishers.items() if end.topic in topics]
            events = [
                (chance.choice(publishers), chance.randint(1, 15))
                for _ in range(chance.randint(2, 7))
            ]
            return ('burst', events, topics)
        name = chance.choice(list(scenario.publishers))
        is_flood = kind == 'flood' and scenario.loses_nothing([scenario.publishers[name].topic])
        return ('flood' if is_flood else 'trickle', [(name, chance.randint(1, 20))])
