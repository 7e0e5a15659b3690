"""What is promised: a row for each figure, with its target. To promise more, add rows."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

Figure = Callable[[float, float], float]


@dataclass(frozen=True, slots=True)
class Job:
    """One process's measurement; see `benchmarks.measure`."""

    subject: str
    side: str
    size: int


@dataclass(frozen=True, slots=True)
class Side:
    """A figure of a job, by its name."""

    job: Job
    key: str


@dataclass(frozen=True, slots=True)
class Row:
    """A promise.

    Attributes:
        other: What ours is held against, measured in turn with it.
        figure: Makes of ours and the other what the target is for.
        sense: How the figure relates to the target where the promise is kept.
    """

    what: str
    ours: Side
    other: Side | None
    figure: Figure
    sense: Literal['>=', '<=']
    target: float

    @property
    def jobs(self) -> list[Job]:
        """What must be measured for it, ours first."""
        return [self.ours.job] + ([self.other.job] if self.other else [])


def times(ours: float, other: float) -> float:
    """Return how many times as much ours is."""
    return ours / other if other else float('inf')


def times_less(ours: float, other: float) -> float:
    """Return how many times as much the other is."""
    return times(other, ours)


def more(ours: float, other: float) -> float:
    """Return how much more ours is."""
    return ours - other


def alone(ours: float, _other: float) -> float:
    """Return ours, whatever the other is."""
    return ours


def _side(subject: str, side: str, size: int, key: str) -> Side:
    return Side(Job(subject, side, size), key)


def _round_trips() -> list[Row]:
    def rate(executor: str, idle: int) -> Side:
        return _side('round_trips', executor, idle, 'rate')

    def row(ours: str, how: str, other: str, name: str, idle: int, target: float) -> Row:
        what = f'round trips/s, {how}, {idle} idle nodes, against {name}'
        return Row(what, rate(ours, idle), rate(other, idle), times, '>=', target)

    rows = []
    for idle in (0, 200):
        rows += [
            row('composer-local', 'local', 'events', 'EventsExecutor', idle, 1.5),
            row('composer-heard', 'over DDS', 'events-heard', 'EventsExecutor', idle, 0.7),
            row('composer', 'over DDS', 'single', 'SingleThreadedExecutor', idle, 3),
            row(
                'composer', 'over DDS', 'multi', 'MultiThreadedExecutor', idle, 300 if idle else 3
            ),
        ]
    beside, without = rate('composer', 200), rate('composer', 0)
    what = 'round trips/s, over DDS, 200 idle nodes against 0'
    hop = Row(
        'us a composed hop (subscription, behaviour, publish), local',
        _side('thousand', 'composer', 0, 'hop_us'),
        None,
        alone,
        '<=',
        12,
    )
    return [*rows, Row(what, beside, without, times, '>=', 0.9), hop]


def _calls() -> list[Row]:
    other = _side('calls', 'events', 0, 'rate')

    def row(what: str, side: str) -> Row:
        what = f"{what} calls/s to a local server, against rclpy's call_async on EventsExecutor"
        return Row(what, _side('calls', side, 0, 'rate'), other, times, '>=', 3)

    return [
        row('node.call', 'composer'),
        row('node.call without a time-out', 'composer_unlimited'),
        row('node.call_async', 'composer_async'),
    ]


def _large_messages() -> list[Row]:
    def row(what: str, kind: str, readers: int, figure: Figure, target: float) -> Row:
        ours, other = (
            _side('large_messages', f'{way}_{kind}', readers, 'us') for way in ('local', 'dds')
        )
        return Row(what, ours, other, figure, '<=' if figure is alone else '>=', target)

    image, shared = '6 MB image, us from publish to callback', '1 MB to 10 read_only subscriptions'
    kept, kept_over_dds = (
        _side('large_messages', f'{way}_shared', 10, 'kept_share') for way in ('local', 'dds')
    )
    nobody = _side('nobody', 'composer', 0, 'us')
    return [
        row(f'{image}, against DDS', 'image', 1, times_less, 20),
        row(f'{image} (other: DDS)', 'image', 1, alone, 150),
        row(f'{shared}, us, against DDS', 'shared', 10, times_less, 10),
        Row(f'{shared}, copies of one kept (other: DDS)', kept, kept_over_dds, alone, '<=', 1.1),
        Row('us to publish to nobody', nobody, None, alone, '<=', 3),
    ]


def _overhead() -> list[Row]:
    ours = _side('overhead', 'composer', 15, 'composed_us')
    by_hand = _side('overhead', 'composer', 15, 'plain_us')
    return [Row('us a message, more than by hand', ours, by_hand, more, '<=', 5)]


def _recording() -> list[Row]:
    def row(what: str, key: str, target: float) -> Row:
        ours, other = (_side('recording', side, 0, key) for side in ('recorded', 'alone'))
        return Row(f'us to record a message of 1 kB, {what}', ours, other, more, '<=', target)

    traced, alone_us = (_side('recording', side, 0, 'cpu_us') for side in ('traced', 'alone'))
    return [
        row('all in all', 'cpu_us', 18),
        row('in the behaviour', 'publish_us', 10),
        Row('us to trace a message and its callback', traced, alone_us, more, '<=', 5),
    ]


def _foxglove() -> list[Row]:
    def row(what: str, side: str, target: float) -> Row:
        ours, other = (_side('foxglove_bridge', name, 50, 'percent') for name in (side, 'alone'))
        return Row(
            f'50 nodes at 100 Hz, % of a core for Foxglove, {what}',
            ours,
            other,
            more,
            '<=',
            target,
        )

    return [row('without a client', 'idle', 1), row('one subscribes to all', 'subscribed', 15)]


def _page() -> list[Row]:
    def row(what: str, target: float) -> Row:
        ours, other = (_side('page', 'system', 50, key) for key in (what, 'alone'))
        title = f'50 nodes at 100 Hz, % of a core for a page that is {what}'
        return Row(title, ours, other, more, '<=', target)

    def picture(size: int, target: float) -> Row:
        ours = _side('page', 'picture', size, 'seconds')
        return Row(f'page of {size} nodes, s until it is drawn', ours, None, alone, '<=', target)

    return [row('open', 3), row('closed', 0.5), picture(50, 1), picture(1000, 3)]


def _simulated() -> list[Row]:
    def row(size: int, target: float) -> Row:
        ours, other = (_side('simulated', side, size, 'speed') for side in ('virtual', 'real'))
        what = f'{size} nodes at 10 Hz, virtual s in a second, against real time'
        return Row(what, ours, other, times, '>=', target)

    def start(size: int) -> Row:
        ours = _side('simulated', 'case', size, 'start_sec')
        return Row(f's a case of {size} nodes after the first', ours, None, alone, '<=', 0.3)

    # An hour of 20 nodes in half a minute.
    return [row(2, 600), row(20, 120), row(200, 10), start(2), start(20)]


def _forty() -> list[Row]:
    def side(name: str, key: str) -> Side:
        return _side('forty', name, 40, key)

    def row(what: str, key: str, target: float) -> Row:
        ours, other = side('composer', key), side('processes', key)
        return Row(what, ours, other, times_less, '>=', target)

    return [
        row('40 nodes, s until all are up, against 40 processes', 'start_sec', 15),
        row('40 nodes, MB (PSS), against 40 processes', 'memory_mb', 10),
    ]


def _further_node() -> list[Row]:
    def row(
        kind: str, what: str, key: str, figure: Callable[[float, float], float], target: float
    ) -> Row:
        ours = _side('further_node', f'composer-{kind}', 100, key)
        other = _side('further_node', f'rclpy-{kind}', 100, key)
        return Row(what, ours, other, figure, '<=', target)

    beside = 'a further node with parameters, against bare rclpy'
    return [
        row('plain', 'MB a further node', 'memory_mb', alone, 0.3),
        row('plain', 'ms a further node', 'start_ms', alone, 3),
        row('parameters', f'MB {beside}', 'memory_mb', times, 1.05),
        row('parameters', f'ms {beside}', 'start_ms', times, 1.05),
    ]


def _thousand() -> list[Row]:
    def side(name: str, size: int, key: str) -> Side:
        return _side('thousand', name, size, key)

    def row(what: str, key: str, target: float) -> Row:
        return Row(
            f'1,000 nodes in one file, {what}, against bare rclpy',
            side('composer', 1000, key),
            side('rclpy', 1000, key),
            times,
            '<=',
            target,
        )

    beside, without = side('composer', 1000, 'rate'), side('composer', 0, 'rate')
    return [
        row('s until all are up', 'start_sec', 1.5),
        row('MB (PSS)', 'memory_mb', 1.3),
        Row(
            'round trips/s in a file of 1,000 idle nodes against 0',
            beside,
            without,
            times,
            '>=',
            0.85,
        ),
    ]


def _start_stop() -> list[Row]:
    def side(name: str, key: str) -> Side:
        return _side('start_stop', name, 500, key)

    def row(what: str, key: str, figure: Figure, target: float) -> Row:
        what = f'500 nodes with parameter services, {what}'
        return Row(what, side('composer', key), side('rclpy', key), figure, '<=', target)

    return [
        row('s until all are up, against rclpy', 'start_sec', times, 1.5),
        row('s to stop (other: rclpy)', 'stop_sec', alone, 3),
    ]


def _workers() -> list[Row]:
    def side(subject: str, name: str, size: int, key: str) -> Side:
        return _side(subject, name, size, key)

    def hop(what: str, size: int) -> Row:
        ours, other = (side('worker_hops', name, size, 'us') for name in ('workers', 'rclpy'))
        what = f'us from a worker to another, {what}, against two rclpy processes'
        return Row(what, ours, other, times, '<=', 1.3)

    busy, one = (side('workers', name, 4, 'rate') for name in ('workers', 'one'))
    start, without = (
        side('workers', f'start_{name}', 4, 'start_sec') for name in ('workers', 'one')
    )
    return [
        Row(
            '4 nodes of 0.8 cores, calls/s in workers against one process',
            busy,
            one,
            times,
            '>=',
            1.8,
        ),
        Row(
            's until 4 nodes in 4 workers are up, against one process',
            start,
            without,
            times,
            '<=',
            2,
        ),
        hop('a small message', 100),
        hop('1 MB', 1_000_000),
    ]


def _at_rest_and_under_load() -> list[Row]:
    def jitter(what: str, key: str, target: float) -> Row:
        ours, threads = (_side('jitter', name, 0, key) for name in ('composer', 'threads'))
        return Row(f'100 Hz timer beside full load, {what}', ours, threads, alone, '<=', target)

    idle, bare = (_side('idle_cpu', name, 200, 'percent') for name in ('composer', 'rclpy'))
    return [
        Row('200 idle nodes, % of a core', idle, bare, alone, '<=', 2),
        jitter('p99 ms (other: bare threads)', 'p99_ms', 6),
        jitter('ticks lost (other: bare threads)', 'lost', 0),
    ]


def _check() -> list[Row]:
    def row(what: str, side: str, size: int, key: str, target: float) -> Row:
        ours = _side('check', side, size, key)
        return Row(f'composer check of {what}', ours, None, alone, '<=', target)

    once, twice = (_side('check', 'one', size, 'seconds') for size in (1000, 2000))
    plan, of_new = (_side('check', 'plan', 1000, f'{each}_seconds') for each in ('plan', 'check'))
    return [
        row('a small file, s', 'shipped', 2, 'seconds', 0.25),
        row('100 files of 10 nodes, s', 'many', 10, 'seconds', 2.5),
        row('1,000 nodes, 5,000 entities, s', 'one', 1000, 'seconds', 1),
        row('1,000 nodes, 5,000 entities, MB', 'one', 1000, 'megabytes', 200),
        Row('composer check of twice as large, s', twice, once, times, '<=', 2.2),
        Row('composer plan of 1,000 nodes, s, against check', plan, of_new, times, '<=', 1.5),
    ]


def _save_to_callback() -> list[Row]:
    def row(what: str, side: str, target: float) -> Row:
        ours = _side('save_to_callback', side, 50, 'p95_ms')
        what = f'50 nodes, ms from the save of {what} to its callback, p95'
        return Row(what, ours, None, alone, '<=', target)

    return [row('an entity', 'entity', 150), row('a module', 'module', 300)]


def _reloads() -> list[Row]:
    def side(key: str) -> Side:
        return _side('reloads', 'composer', 1000, key)

    def left(what: str, key: str, target: float) -> Row:
        return Row(f'1,000 reloads, {what}', side(key), None, alone, '<=', target)

    what = '1,000 reloads, longest gap in ms of a stream at 1 kHz, more than alone'
    return [
        left('messages lost', 'lost', 0),
        Row(what, side('gap_ms'), side('alone_gap_ms'), more, '<=', 10),
        left('MB grown', 'mb_grown', 5),
        *(
            left(f'{each} grown', f'{each}_grown', 0)
            for each in ('threads', 'descriptors', 'sockets', 'endpoints')
        ),
    ]


def _soak() -> list[Row]:
    def row(what: str, key: str, target: float) -> Row:
        ours = _side('soak', 'composer', 1000, key)
        return Row(f'soak at 1,000 messages/s, {what}', ours, None, alone, '<=', target)

    return [row('MB grown after warm-up', 'grown_mb', 2), row('messages lost', 'lost', 0)]


ROWS: list[Row] = [
    *_round_trips(),
    *_calls(),
    *_large_messages(),
    *_overhead(),
    *_recording(),
    *_foxglove(),
    *_page(),
    *_simulated(),
    *_forty(),
    *_further_node(),
    *_thousand(),
    *_start_stop(),
    *_workers(),
    *_at_rest_and_under_load(),
    *_check(),
    *_save_to_callback(),
    *_reloads(),
    *_soak(),
]
