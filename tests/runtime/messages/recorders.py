"""Numbers run through a system, while recorders come and go and its file is edited."""

import json
import random
from collections import Counter, defaultdict
from contextlib import contextmanager

from tests.running import wait_for
from tests.runtime.messages.outsider import Outsider
from tests.runtime.rewiring.fresh_start import running_system

_TYPE = 'std_msgs/msg/String'
_BEHAVIOURS = 'tests.runtime.messages.recorders'
_PERIOD_SEC = 0.001
# More than come while a busy machine stands still; beyond 5,000, Fast DDS refuses the newest.
_DEPTH = 4500
_TOPICS = {'a': 'reliable', 'b': 'best_effort'}
_STAY = 20
# A reliable subscription that joins a publisher which has sent 5,000 loses one in Fast DDS,
# whoever publishes: see docs/local-delivery.md.
_MOST_BEFORE_A_JOIN = 4000
_JOINED = {'sink': ['a1', 'a2'], 'relay': ['a1', 'a2'], 'other': ['a1', 'a2'], 'end': ['c']}
# By the first part of what names them in the texts.
_PUBLISHERS = {'relay': 'c'}
_traffic = []


class Traffic:
    """What was published and what came, by the publishers' names and numbers.

    A publisher or a subscription that an edit has recreated has another name.

    Attributes:
        wrong: What was lost, doubled or overtaken.
    """

    def __init__(self):
        self.published = Counter()
        self.heard = defaultdict(Counter)
        self.first = {}
        self.wrong = []

    def next_text(self, publisher):
        self.published[publisher] += 1
        return f'{publisher}:{self.published[publisher]}'

    def count(self):
        """Return how many messages each publisher has published, under all its names."""
        counts = Counter()
        for name, count in self.published.items():
            counts[_PUBLISHERS.get(name.split('_')[0], name.split('_')[0])] += count
        return counts

    def note(self, subscription, text):
        publisher, number = text.split(':')
        number, heard = int(number), self.heard[subscription]
        self.first.setdefault((subscription, publisher), number)
        if publisher in heard and number != heard[publisher] + 1:
            self.wrong.append((subscription, publisher, heard[publisher], number))
        heard[publisher] = number


def publish(node, ends):
    """Publish a number on each of some publishers; the behaviour of a timer."""
    for name, stage in ends.items():
        node.publish(name, {'data': _traffic[-1].next_text(f'{name}_{stage}')})


def note(node, message, name):
    """Note a message."""
    _traffic[-1].note(name, message.data)


def relay(node, message, name):
    """Note a message, and publish another."""
    _traffic[-1].note(name, message.data)
    return {'data': _traffic[-1].next_text(name)}


class File:
    """The file of the system; each edit has a number, which names what it recreates."""

    def __init__(self, path):
        self._path = path
        self._edits = 0
        self.stages = dict.fromkeys(['a1', 'a2', 'b1', 'c', 'sink', 'relay', 'end'], 0)
        self._before = Counter()
        self._local = {'a1': True, 'a2': True, 'b1': True, 'c': True}
        self._read_only = {'sink': False, 'other': True}
        self._has_other = True
        self.write()

    def edit(self, chance, counts):
        """Change one thing; return what.

        Args:
            counts: How many messages each publisher has published, from the first on.
        """
        self._edits += 1
        kind = chance.choice(['recreate', 'local delivery', 'read only', 'other'])
        name = chance.choice(list(self.stages)) if kind == 'recreate' else ''
        joining = 'other' if kind == 'other' and not self._has_other else name
        if old := self._list_old(_JOINED.get(joining, ()), counts):
            kind, name = 'recreate', chance.choice(old)
        if kind == 'recreate':
            self.stages[name] = self._edits
            if name in counts:
                self._before[name] = counts[name]
        elif kind == 'local delivery':
            name = chance.choice(list(self._local))
            self._local[name] = not self._local[name]
        elif kind == 'read only':
            name = chance.choice(list(self._read_only))
            self._read_only[name] = not self._read_only[name]
        else:
            self._has_other = not self._has_other
        self.write()
        return kind, name

    def _list_old(self, publishers, counts):
        return [
            each for each in publishers if counts[each] - self._before[each] > _MOST_BEFORE_A_JOIN
        ]

    def write(self):
        self._path.write_text(json.dumps(self._render()))

    def _render(self):
        stages = self.stages
        nodes = {
            name: {
                'publishers': {each: self._publisher(each) for each in ends},
                'timers': {
                    'tick': {
                        'period': _PERIOD_SEC,
                        'behaviour': f'{_BEHAVIOURS}:publish',
                        'with': {'ends': {each: stages[each] for each in ends}},
                    }
                },
            }
            for name, ends in {'source1': ['a1', 'b1'], 'source2': ['a2']}.items()
        }
        nodes['middle'] = {
            'publishers': {'c': self._publisher('c')},
            'subscriptions': {'relay': self._subscription('relay', 'a') | {'publish': 'c'}},
        }
        nodes['sink'] = {
            'subscriptions': {
                'sink': self._subscription('sink', 'a'),
                'sink_b': self._subscription('sink', 'b', 'best_effort'),
                'end': self._subscription('end', 'c'),
            }
        }
        if self._has_other:
            nodes['other'] = {'subscriptions': {'other': self._subscription('other', 'a')}}
        return {'version': 1, 'nodes': nodes}

    def _publisher(self, name):
        qos = _qos(_TOPICS.get(name[0], 'reliable'), self.stages.get(name, 0))
        return {
            'topic': f'/{name[0]}',
            'type': _TYPE,
            'qos': qos,
            'local_delivery': self._local[name],
        }

    def _subscription(self, name, topic, reliability='reliable'):
        stage = self.stages.get(name, 0)
        kind = 'relay' if name == 'relay' else 'note'
        full_name = f'{name}_{topic}_{stage}' if name in self.stages else f'{name}_{self._edits}'
        return {
            'topic': f'/{topic}',
            'type': _TYPE,
            'qos': _qos(reliability, stage),
            'behaviour': f'{_BEHAVIOURS}:{kind}',
            'with': {'name': full_name},
            'group': f'of_{name}_{topic}',
            'read_only': self._read_only.get(name, False),
        }


def _qos(reliability, stage):
    # Another depth recreates the end.
    return {'reliability': reliability, 'depth': _DEPTH + stage}


class Game:
    """A system, whose messages recorders get now and then.

    Attributes:
        published: How many messages each publisher has published.
    """

    def __init__(self, seed, file, system, reloader, domain_id):
        self._random = random.Random(seed)
        self._file = file
        self._system = system
        self._reloader = reloader
        self._domain_id = domain_id
        self._outsider = Outsider(domain_id)
        self._traffic = _traffic[-1]
        self.published = self._traffic.published

    def play(self, edits=0.2):
        """Have recorders come and go, and the file edited meanwhile; return what was done.

        Args:
            edits: The chance of an edit before they go.
        """
        chance = self._random
        topics = chance.sample(list(_TOPICS), chance.choice([1, 1, 2]))
        has_context = chance.random() < 0.5
        whole = {}
        for topic in topics:
            reliability = chance.choice(['reliable', 'best_effort'])
            whole[topic] = reliability == _TOPICS[topic] == 'reliable'
            qos = {'reliability': reliability if topic == 'a' else 'best_effort', 'depth': _DEPTH}
            self._outsider.join(topic, f'/{topic}', qos, has_context=has_context)
        done = [topics, has_context]
        for topic in topics:
            if chance.random() < edits:
                done.append(self.edit())
            if chance.random() < 0.7:
                self._outsider.heard(topic, _STAY)
            done.append(check_stay(self._outsider.heard(topic), is_whole=whole[topic]))
            self._outsider.leave(topic)
        assert not self._traffic.wrong, self._traffic.wrong[:5]
        return done

    def kill(self):
        """End the process of the recorders while two of them are there."""
        for topic in _TOPICS:
            self._outsider.join(topic, f'/{topic}', {'reliability': 'best_effort'})
            self._outsider.heard(topic, 1)
        self._outsider.kill()
        self._outsider = Outsider(self._domain_id)

    def edit(self):
        """Change the file and the system; return what was changed."""
        done = self._file.edit(self._random, self._traffic.count())
        outcome = self._reloader.reload(self._system)
        assert outcome.succeeded, (done, outcome.text)
        return done

    def end(self):
        """Check that all has come of which the subscriptions saw the beginning."""
        self._outsider.close()
        traffic, stages = self._traffic, self._file.stages
        for node in self._system._nodes.values():
            for timer in node.entities['timers'].values():
                timer.ros.cancel()

        def missing():
            assert not traffic.wrong, traffic.wrong[:5]
            return [
                (subscription, publisher, number)
                for subscription, heard in traffic.heard.items()
                if stages.get(subscription.split('_')[0]) == _stage_of(subscription)
                for publisher, number in heard.items()
                if number != traffic.published[publisher]
            ]

        wait_for(lambda: not missing(), 'the last messages')
        for (subscription, publisher), number in traffic.first.items():
            stages = _stage_of(subscription), _stage_of(publisher)
            if stages == (0, 0) or stages[0] < stages[1]:
                assert number == 1, (subscription, publisher, number)


def check_stay(heard, *, is_whole):
    """Check what a recorder got in one stay; return how much.

    Args:
        is_whole: Whether it gets every message from its first on.
    """
    offsets, first, last = {}, {}, {}
    for text, sequence_number in heard:
        publisher, number = text.split(':')
        number = int(number)
        told = publisher, first.get(publisher), last.get(publisher), text, sequence_number
        # The publisher counts what it sends: that was every message.
        assert (
            offsets.setdefault(publisher, number - sequence_number) == number - sequence_number
        ), told
        before = last.get(publisher, 0 if not is_whole else number - 1)
        assert number == before + 1 if is_whole else number > before, told
        first.setdefault(publisher, number)
        last[publisher] = number
    return len(heard)


def _stage_of(name):
    return int(name.split('_')[-1])


@contextmanager
def playing(folder, seed, domain_id):
    """Yield a game in a folder."""
    file = File(folder / 'recorded.yaml')
    traffic = Traffic()
    _traffic.append(traffic)
    try:
        with running_system([folder / 'recorded.yaml']) as (system, reloader):
            game = Game(seed, file, system, reloader, domain_id)
            yield game
            game.end()
    finally:
        _traffic.remove(traffic)
